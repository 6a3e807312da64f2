//! Computes scaled dot-product attention within patches, as in PTv3 (Wu et al., CVPR 2024).
//!
//! One head of one patch is computed in blocks of 96 queries. The scores of a block are the only large intermediate
//! result, so memory grows with the number of tokens and not with the square of the patch size:
//!
//! ```text
//!               keys, transposed                    values
//!               [channel, patch]                    [patch, channel]
//!              ┌────┬────┬────┬───┐                 ┌───────┐
//!              │ 16 │ 16 │ 16 │ … │                 │       │
//!              └────┴────┴────┴───┘                 │       │
//!   queries     scores, then exponentials           └───────┘     output
//!   ┌───┐      ┌────┬────┬────┬───┐                              ┌───────┐
//!   │ 6 │──▶   │6×16│ ─▶ │    │   │    ──▶ 6×16 tiles again ──▶  │       │  ÷ sum of the row
//!   │ 6 │      │    │    │    │   │                              │       │
//!   │ … │      │    │    │    │   │                              │       │
//!   └───┘      └────┴────┴────┴───┘                              └───────┘
//!  [96, channel]   [96, patch], reused by each block             [96, channel]
//! ```
//!
//! A tile of 6 rows and 16 columns stays in registers (`tile`). The forward pass stores the logarithm of each row's sum of
//! exponentials. The backward pass computes the weights again from it, as in FlashAttention (Dao et al., 2022).

use super::lanes::{LANES, copy_row, exp_of_negative, lane_max, lane_sum};
use super::linear::multiply;
use super::tile::{Kernel, Panels, ROWS, RowPairs, add_outer_products, vectorised};
use super::{Flexible, flexible, record, slice, tensor_of};
use crate::data::patches::Patches;
use burn::tensor::Tensor;
use std::sync::Arc;

/// Number of queries whose scores are in memory at once.
const QUERIES: usize = 16 * ROWS;

/// Attention of each token to the tokens of its patch. Returns `None` if the tensor is not of the flex backend.
///
/// # Shapes
/// - qkv: `[token, 3 × head × channel]`
/// - output: `[token, head × channel]`
pub(crate) fn patch_attention(
    qkv: &Tensor<2>,
    patches: &Arc<Patches>,
    n_heads: usize,
) -> Option<Tensor<2>> {
    let [n, width] = qkv.dims();
    let inputs = [flexible(qkv)?];
    let [x] = inputs.each_ref().map(Flexible::values);
    let shape = AttentionShape {
        n_heads,
        head_dim: width / (3 * n_heads.max(1)),
    };
    let mut y = vec![0.0; n * shape.width()];
    let mut log_sums = vec![0.0; n * n_heads];
    vectorised(Forward {
        qkv: slice(&x),
        patches,
        shape,
        y: &mut y,
        log_sums: &mut log_sums,
    });
    let patches = Arc::clone(patches);
    record(
        inputs,
        tensor_of(y, [n, shape.width()]),
        move |by_output, _| {
            let mut by_qkv = vec![0.0; n * width];
            let (qkv, g) = (slice(&x), slice(by_output));
            vectorised(Pullback {
                qkv,
                g,
                patches: &patches,
                shape,
                log_sums: &log_sums,
                by_qkv: &mut by_qkv,
            });
            [tensor_of(by_qkv, [n, width])]
        },
    )
}

#[derive(Clone, Copy)]
struct AttentionShape {
    n_heads: usize,
    head_dim: usize,
}

/// The three thirds of a row of qkv.
#[derive(Clone, Copy)]
enum Third {
    Query = 0,
    Key = 1,
    Value = 2,
}

impl AttentionShape {
    fn width(self) -> usize {
        self.n_heads * self.head_dim
    }

    fn scale(self) -> f32 {
        1.0 / (self.head_dim as f32).sqrt()
    }

    /// The range of a token's query, key or value of a head in a row-major `qkv`.
    #[inline(always)]
    fn range(self, token: u32, third: Third, head: usize) -> std::ops::Range<usize> {
        let start = (token as usize * 3 + third as usize) * self.width() + head * self.head_dim;
        start..start + self.head_dim
    }

    /// The query, key or value of one head, for each of the tokens.
    ///
    /// # Shapes
    /// - output: `[token, channel]`
    #[inline(always)]
    fn gather(self, qkv: &[f32], tokens: &[u32], third: Third, head: usize) -> Vec<f32> {
        let mut rows = vec![0.0; tokens.len() * self.head_dim];
        for (row, &token) in rows.chunks_exact_mut(self.head_dim.max(1)).zip(tokens) {
            copy_row(&qkv[self.range(token, third, head)], row);
        }
        rows
    }

    /// The range of a token's output of a head in the row-major output.
    #[inline(always)]
    fn output_range(self, token: u32, head: usize) -> std::ops::Range<usize> {
        let start = token as usize * self.width() + head * self.head_dim;
        start..start + self.head_dim
    }
}

/// Keys and values of one head in one patch, ready for products with queries.
struct HeadPanels {
    /// `[channel, token]`.
    keys: Panels,
    /// `[token, channel]`.
    values: Panels,
}

/// # Shapes
/// - qkv: `[token, 3 × head × channel]`
/// - y: `[token, head × channel]`
/// - log_sums: `[token, head]`, the logarithm of each row's sum of exponentials
struct Forward<'a> {
    qkv: &'a [f32],
    patches: &'a Patches,
    shape: AttentionShape,
    y: &'a mut [f32],
    log_sums: &'a mut [f32],
}

/// Memory of the forward pass that all blocks of queries share.
struct ForwardScratch {
    /// `[query, token]`: scores, then exponentials.
    weights: Vec<f32>,
    /// `[query]`: the sum of each row of exponentials.
    sums: Vec<f32>,
    /// `[query, channel]`: the values, mixed by the exponentials.
    mixed: Vec<f32>,
}

impl Kernel for Forward<'_> {
    #[inline(always)]
    fn run(mut self) {
        let mut scratch = ForwardScratch {
            weights: vec![0.0; QUERIES * self.patches.size],
            sums: vec![0.0; QUERIES],
            mixed: vec![0.0; QUERIES * self.shape.head_dim],
        };
        let patches = self.patches;
        for (tokens, own) in patches.iter() {
            for head in 0..self.shape.n_heads {
                let panels = self.panels(tokens, head);
                for queried in own.chunks(QUERIES) {
                    self.attend(queried, head, &panels, &mut scratch);
                }
            }
        }
    }
}

impl Forward<'_> {
    #[inline(always)]
    fn panels(&self, tokens: &[u32], head: usize) -> HeadPanels {
        let dim = self.shape.head_dim;
        let keys = self.shape.gather(self.qkv, tokens, Third::Key, head);
        let values = self.shape.gather(self.qkv, tokens, Third::Value, head);
        HeadPanels {
            keys: Panels::of_transpose(&keys, dim, tokens.len()),
            values: Panels::of(&values, tokens.len(), dim),
        }
    }

    /// Writes the output of one head for one block of queries.
    #[inline(always)]
    fn attend(
        &mut self,
        queried: &[u32],
        head: usize,
        panels: &HeadPanels,
        scratch: &mut ForwardScratch,
    ) {
        let n_keys = panels.keys.n_columns();
        let queries = self.shape.gather(self.qkv, queried, Third::Query, head);
        let weights = &mut scratch.weights[..queried.len() * n_keys];
        let sums = &mut scratch.sums[..queried.len()];
        let mixed = &mut scratch.mixed[..queried.len() * self.shape.head_dim];

        multiply(&queries, &panels.keys, &[], weights);
        self.exponentials_of_rows(queried, head, weights, sums);
        multiply(weights, &panels.values, &[], mixed);
        self.write_means(queried, head, mixed, sums);
    }

    /// Replaces scores by exponentials, and stores the logarithm of each row's sum for the backward pass.
    #[inline(always)]
    fn exponentials_of_rows(
        &mut self,
        queried: &[u32],
        head: usize,
        weights: &mut [f32],
        sums: &mut [f32],
    ) {
        let scale = self.shape.scale();
        let rows = weights.chunks_exact_mut((weights.len() / queried.len().max(1)).max(1));
        for ((row, sum), &token) in rows.zip(sums.iter_mut()).zip(queried) {
            let highest = scale * lane_max(row);
            *sum = exponentials(row, scale, highest);
            self.log_sums[token as usize * self.shape.n_heads + head] = highest + sum.ln();
        }
    }

    /// Divides each mixed row by the sum of its exponentials.
    #[inline(always)]
    fn write_means(&mut self, queried: &[u32], head: usize, mixed: &[f32], sums: &[f32]) {
        let rows = mixed.chunks_exact(self.shape.head_dim);
        for ((row, &sum), &token) in rows.zip(sums).zip(queried) {
            let inverse = 1.0 / sum;
            let output = &mut self.y[self.shape.output_range(token, head)];
            for (y, x) in output.iter_mut().zip(row) {
                *y = x * inverse;
            }
        }
    }
}

/// Replaces a row of scores by the exponentials of the scaled scores minus the highest one. Returns their sum.
#[inline(always)]
pub(super) fn exponentials(row: &mut [f32], scale: f32, highest: f32) -> f32 {
    let (lanes, rest) = row.as_chunks_mut::<LANES>();
    let mut sums = [0.0; LANES];
    for lane in lanes {
        for at in 0..LANES {
            lane[at] = exp_of_negative(scale.mul_add(lane[at], -highest));
            sums[at] += lane[at];
        }
    }
    let mut sum = 0.0;
    for x in rest {
        *x = exp_of_negative(scale.mul_add(*x, -highest));
        sum += *x;
    }
    lane_sum(&sums, &sums, |x, _| x) + sum
}

/// # Shapes
/// - qkv and by_qkv: `[token, 3 × head × channel]`
/// - g: `[token, head × channel]`, the gradient with respect to the output
/// - log_sums: `[token, head]`
struct Pullback<'a> {
    qkv: &'a [f32],
    g: &'a [f32],
    patches: &'a Patches,
    shape: AttentionShape,
    log_sums: &'a [f32],
    by_qkv: &'a mut [f32],
}

/// Keys and values of one head in one patch, ready for the products of the backward pass.
struct BackwardPanels {
    /// `[channel, token]`, for the scores.
    keys: Panels,
    /// `[token, channel]`, for the gradient with respect to the queries.
    key_rows: Panels,
    /// `[channel, token]`, for the gradient with respect to the weights.
    values: Panels,
}

/// Memory of the backward pass that all blocks of queries share.
struct BackwardScratch {
    /// `[query, token]`: the weights, computed again.
    weights: Vec<f32>,
    /// `[query, token]`: the gradient with respect to the weights, then to the scores.
    slopes: Vec<f32>,
    /// `[query, channel]`: the gradient with respect to the output.
    by_mixed: Vec<f32>,
    /// `[query, channel]`.
    by_queries: Vec<f32>,
    /// `[token, channel]`, summed over the blocks of queries.
    by_keys: Vec<f32>,
    /// `[token, channel]`, summed over the blocks of queries.
    by_values: Vec<f32>,
}

impl Kernel for Pullback<'_> {
    #[inline(always)]
    fn run(mut self) {
        let dim = self.shape.head_dim;
        let n_keys = self.patches.size;
        let mut scratch = BackwardScratch {
            weights: vec![0.0; QUERIES * n_keys],
            slopes: vec![0.0; QUERIES * n_keys],
            by_mixed: vec![0.0; QUERIES * dim],
            by_queries: vec![0.0; QUERIES * dim],
            by_keys: vec![0.0; n_keys * dim],
            by_values: vec![0.0; n_keys * dim],
        };
        let patches = self.patches;
        for (tokens, own) in patches.iter() {
            for head in 0..self.shape.n_heads {
                let panels = self.panels(tokens, head);
                scratch.by_keys.fill(0.0);
                scratch.by_values.fill(0.0);
                for queried in own.chunks(QUERIES) {
                    self.pull_back(queried, head, &panels, &mut scratch);
                }
                self.add_by_keys_and_values(tokens, head, &scratch);
            }
        }
    }
}

impl Pullback<'_> {
    #[inline(always)]
    fn panels(&self, tokens: &[u32], head: usize) -> BackwardPanels {
        let dim = self.shape.head_dim;
        let keys = self.shape.gather(self.qkv, tokens, Third::Key, head);
        let values = self.shape.gather(self.qkv, tokens, Third::Value, head);
        BackwardPanels {
            keys: Panels::of_transpose(&keys, dim, tokens.len()),
            key_rows: Panels::of(&keys, tokens.len(), dim),
            values: Panels::of_transpose(&values, dim, tokens.len()),
        }
    }

    /// Adds the contribution of one block of queries of one head to the gradients.
    #[inline(always)]
    fn pull_back(
        &mut self,
        queried: &[u32],
        head: usize,
        panels: &BackwardPanels,
        scratch: &mut BackwardScratch,
    ) {
        let dim = self.shape.head_dim;
        let n_keys = panels.keys.n_columns();
        let queries = self.shape.gather(self.qkv, queried, Third::Query, head);
        let weights = &mut scratch.weights[..queried.len() * n_keys];
        let slopes = &mut scratch.slopes[..queried.len() * n_keys];
        let by_mixed = &mut scratch.by_mixed[..queried.len() * dim];
        let by_queries = &mut scratch.by_queries[..queried.len() * dim];

        for (row, &token) in by_mixed.chunks_exact_mut(dim).zip(queried) {
            copy_row(&self.g[self.shape.output_range(token, head)], row);
        }
        multiply(&queries, &panels.keys, &[], weights);
        multiply(by_mixed, &panels.values, &[], slopes);
        self.slopes_of_rows(queried, head, weights, slopes);

        add_outer_products(
            RowPairs {
                a: weights,
                b: by_mixed,
                widths: [n_keys, dim],
            },
            [n_keys, dim],
            &mut scratch.by_values,
        );
        add_outer_products(
            RowPairs {
                a: slopes,
                b: &queries,
                widths: [n_keys, dim],
            },
            [n_keys, dim],
            &mut scratch.by_keys,
        );

        multiply(slopes, &panels.key_rows, &[], by_queries);
        for (row, &token) in by_queries.chunks_exact(dim).zip(queried) {
            let range = self.shape.range(token, Third::Query, head);
            add_to(&mut self.by_qkv[range], row);
        }
    }

    #[inline(always)]
    fn slopes_of_rows(
        &self,
        queried: &[u32],
        head: usize,
        weights: &mut [f32],
        slopes: &mut [f32],
    ) {
        let n_keys = (weights.len() / queried.len().max(1)).max(1);
        let rows = weights
            .chunks_exact_mut(n_keys)
            .zip(slopes.chunks_exact_mut(n_keys));
        for ((weights, slopes), &token) in rows.zip(queried) {
            let log_sum = self.log_sums[token as usize * self.shape.n_heads + head];
            score_slopes(weights, slopes, self.shape.scale(), log_sum);
        }
    }

    /// A token that fills up the last patch occurs in two patches, so its gradients are added.
    #[inline(always)]
    fn add_by_keys_and_values(&mut self, tokens: &[u32], head: usize, scratch: &BackwardScratch) {
        let dim = self.shape.head_dim;
        let rows = scratch
            .by_keys
            .chunks_exact(dim)
            .zip(scratch.by_values.chunks_exact(dim));
        for ((by_key, by_value), &token) in rows.zip(tokens) {
            let key = self.shape.range(token, Third::Key, head);
            add_to(&mut self.by_qkv[key], by_key);
            let value = self.shape.range(token, Third::Value, head);
            add_to(&mut self.by_qkv[value], by_value);
        }
    }
}

/// Computes the weights and the gradient with respect to the unscaled scores, from the scores and the gradient with respect to
/// the weights.
#[inline(always)]
fn score_slopes(weights: &mut [f32], slopes: &mut [f32], scale: f32, log_sum: f32) {
    exponentials(weights, scale, log_sum);
    let mean = lane_sum(weights, slopes, |weight, slope| weight * slope);
    for (slope, weight) in slopes.iter_mut().zip(weights) {
        *slope = scale * *weight * (*slope - mean);
    }
}

#[inline(always)]
fn add_to(sum: &mut [f32], row: &[f32]) {
    for (sum, x) in sum.iter_mut().zip(row) {
        *sum += x;
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check, input};
    use super::*;
    use crate::kernels::ops::composed_patch_attention;

    #[test]
    fn fused_and_composed_agree() {
        for (n, size, n_heads, dim) in [
            (1, 128, 2, 16),
            (10, 4, 3, 5),
            (33, 1024, 1, 16),
            (300, 128, 2, 16),
        ] {
            let serialized: Vec<u32> = (0..n as u32).map(|at| (at * 7 + 3) % n as u32).collect();
            let patches = Arc::new(Patches::new(&serialized, size));
            check(
                &[input([n, 3 * n_heads * dim], "qkv")],
                |[qkv]| patch_attention(&qkv, &patches, n_heads).unwrap(),
                |[qkv]| composed_patch_attention(qkv, &patches, n_heads),
            );
        }
    }
}
