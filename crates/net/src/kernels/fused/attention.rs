//! Scaled dot-product attention within patches, whose scores live only while their rows are worked on.
//!
//! Forward keeps the logarithm of each row's sum of exponentials; the backward computes the weights anew from it, so
//! that memory grows with the tokens and not with the patch.

use super::lanes::{LANES, copy_row, exp_of_negative, lane_max, lane_sum};
use super::linear::multiply;
use super::tile::{Kernel, Panels, ROWS, add_outer_products, vectorised};
use super::{Flexible, flexible, record, slice, tensor_of};
use crate::hierarchy::Patches;
use burn::tensor::Tensor;
use std::sync::Arc;

/// Queries whose scores are held at once.
const QUERIES: usize = 16 * ROWS;

/// Attention of each token to the tokens of its patch; none if the tensor is not of the flex backend.
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

/// The thirds of a row of qkv.
#[derive(Clone, Copy)]
enum Part {
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

    /// Where a token's query, key or value of a head stands.
    #[inline(always)]
    fn range(self, token: u32, part: Part, head: usize) -> std::ops::Range<usize> {
        let start = (token as usize * 3 + part as usize) * self.width() + head * self.head_dim;
        start..start + self.head_dim
    }

    /// One part of one head for each of the tokens, row after row.
    #[inline(always)]
    fn gather(self, qkv: &[f32], tokens: &[u32], part: Part, head: usize) -> Vec<f32> {
        let mut rows = vec![0.0; tokens.len() * self.head_dim];
        for (row, &token) in rows.chunks_exact_mut(self.head_dim.max(1)).zip(tokens) {
            copy_row(&qkv[self.range(token, part, head)], row);
        }
        rows
    }

    /// Where a token's output of a head stands.
    #[inline(always)]
    fn output_range(self, token: u32, head: usize) -> std::ops::Range<usize> {
        let start = token as usize * self.width() + head * self.head_dim;
        start..start + self.head_dim
    }
}

struct Forward<'a> {
    qkv: &'a [f32],
    patches: &'a Patches,
    shape: AttentionShape,
    y: &'a mut [f32],
    log_sums: &'a mut [f32],
}

impl Kernel for Forward<'_> {
    #[inline(always)]
    fn run(self) {
        let Self {
            qkv,
            patches,
            shape,
            y,
            log_sums,
        } = self;
        let (dim, scale) = (shape.head_dim, shape.scale());
        let mut weights = vec![0.0; QUERIES * patches.size];
        let (mut mixed, mut sums) = (vec![0.0; QUERIES * dim], vec![0.0; QUERIES]);
        for (tokens, own) in patches.iter() {
            for head in 0..shape.n_heads {
                let keys = shape.gather(qkv, tokens, Part::Key, head);
                let keys = Panels::of_transpose(&keys, dim, tokens.len());
                let values = Panels::of(
                    &shape.gather(qkv, tokens, Part::Value, head),
                    tokens.len(),
                    dim,
                );
                for queried in own.chunks(QUERIES) {
                    let queries = shape.gather(qkv, queried, Part::Query, head);
                    let weights = &mut weights[..queried.len() * tokens.len()];
                    multiply(&queries, &keys, &[], weights);
                    let sums = &mut sums[..queried.len()];
                    for ((row, sum), &token) in weights
                        .chunks_exact_mut(tokens.len())
                        .zip(sums.iter_mut())
                        .zip(queried)
                    {
                        let highest = scale * lane_max(row);
                        *sum = exponentials(row, scale, highest);
                        log_sums[token as usize * shape.n_heads + head] = highest + sum.ln();
                    }
                    let mixed = &mut mixed[..queried.len() * dim];
                    multiply(weights, &values, &[], mixed);
                    for ((row, &sum), &token) in
                        mixed.chunks_exact(dim).zip(sums.iter()).zip(queried)
                    {
                        let inverse = 1.0 / sum;
                        for (y, x) in y[shape.output_range(token, head)].iter_mut().zip(row) {
                            *y = x * inverse;
                        }
                    }
                }
            }
        }
    }
}

/// Turns a row of scores into the exponentials of scaled scores less the highest one; returns their sum.
#[inline(always)]
fn exponentials(row: &mut [f32], scale: f32, highest: f32) -> f32 {
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

struct Pullback<'a> {
    qkv: &'a [f32],
    g: &'a [f32],
    patches: &'a Patches,
    shape: AttentionShape,
    log_sums: &'a [f32],
    by_qkv: &'a mut [f32],
}

impl Kernel for Pullback<'_> {
    #[inline(always)]
    fn run(self) {
        let Self {
            qkv,
            g,
            patches,
            shape,
            log_sums,
            by_qkv,
        } = self;
        let (dim, scale) = (shape.head_dim, shape.scale());
        let mut weights = vec![0.0; QUERIES * patches.size];
        let mut slopes = vec![0.0; QUERIES * patches.size];
        let (mut by_queries, mut by_mixed) = (vec![0.0; QUERIES * dim], vec![0.0; QUERIES * dim]);
        let (mut by_keys, mut by_values) =
            (vec![0.0; patches.size * dim], vec![0.0; patches.size * dim]);
        for (tokens, own) in patches.iter() {
            for head in 0..shape.n_heads {
                let keys = shape.gather(qkv, tokens, Part::Key, head);
                let key_panels = Panels::of(&keys, tokens.len(), dim);
                let keys = Panels::of_transpose(&keys, dim, tokens.len());
                let values = shape.gather(qkv, tokens, Part::Value, head);
                let values = Panels::of_transpose(&values, dim, tokens.len());
                by_keys.fill(0.0);
                by_values.fill(0.0);
                for queried in own.chunks(QUERIES) {
                    let queries = shape.gather(qkv, queried, Part::Query, head);
                    let weights = &mut weights[..queried.len() * tokens.len()];
                    let slopes = &mut slopes[..queried.len() * tokens.len()];
                    let by_mixed = &mut by_mixed[..queried.len() * dim];
                    for (row, &token) in by_mixed.chunks_exact_mut(dim).zip(queried) {
                        copy_row(&g[shape.output_range(token, head)], row);
                    }
                    multiply(&queries, &keys, &[], weights);
                    multiply(by_mixed, &values, &[], slopes);
                    let rows = weights
                        .chunks_exact_mut(tokens.len())
                        .zip(slopes.chunks_exact_mut(tokens.len()));
                    for ((weights, slopes), &token) in rows.zip(queried) {
                        let log_sum = log_sums[token as usize * shape.n_heads + head];
                        score_slopes(weights, slopes, scale, log_sum);
                    }
                    add_outer_products(
                        weights
                            .chunks_exact(tokens.len())
                            .zip(by_mixed.chunks_exact(dim)),
                        [tokens.len(), dim],
                        &mut by_values,
                    );
                    add_outer_products(
                        slopes
                            .chunks_exact(tokens.len())
                            .zip(queries.chunks_exact(dim)),
                        [tokens.len(), dim],
                        &mut by_keys,
                    );
                    let by_queries = &mut by_queries[..queried.len() * dim];
                    multiply(slopes, &key_panels, &[], by_queries);
                    for (row, &token) in by_queries.chunks_exact(dim).zip(queried) {
                        add_to(&mut by_qkv[shape.range(token, Part::Query, head)], row);
                    }
                }
                // A token that fills up the last patch occurs in two of them, so that gradients add up.
                for ((by_key, by_value), &token) in by_keys
                    .chunks_exact(dim)
                    .zip(by_values.chunks_exact(dim))
                    .zip(tokens)
                {
                    add_to(&mut by_qkv[shape.range(token, Part::Key, head)], by_key);
                    add_to(&mut by_qkv[shape.range(token, Part::Value, head)], by_value);
                }
            }
        }
    }
}

/// From scores and the gradient by the weights: the weights, and the gradient by the unscaled scores.
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
    use crate::ops::composed_patch_attention;

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
