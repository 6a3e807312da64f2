//! Computes the submanifold sparse convolution (Graham et al., CVPR 2018) as gather, product and scatter.
//!
//! Only cells that hold a token are multiplied.

use super::lanes::LANES;
use super::linear::{bias_or_empty, column_sums};
use super::tile::{
    Kernel, Lane, OUTER_CHUNK, Pairs, Panels, ROWS, add, add_outer_products, tile, vectorised,
};
use super::{Flexible, flexible, record, slice, tensor_of};
use crate::data::neighbor_pairs::NeighborPairs;
use burn::tensor::Tensor;
use std::sync::Arc;

/// For each token, the sum over its neighbors of their rows times the weights of their offsets, plus the bias.
///
/// Returns `None` if a tensor is not of the flex backend.
///
/// # Shapes
/// - rows: `[token, in]`
/// - weight: `[offset × in, out]`
/// - bias: `[out]`
/// - output: `[token, out]`
pub(crate) fn convolution(
    rows: &Tensor<2>,
    pairs: &Arc<NeighborPairs>,
    weight: &Tensor<2>,
    bias: Option<&Tensor<1>>,
) -> Option<Tensor<2>> {
    let [n, dim_in] = rows.dims();
    let dim_out = weight.dims()[1];
    let inputs = [
        flexible(rows)?,
        flexible(weight)?,
        bias_or_empty(bias, rows)?,
    ];
    let [x, w, b] = inputs.each_ref().map(Flexible::values);
    let depth = pairs.n_offsets() * dim_in;
    let mut y = match slice(&b) {
        [] => vec![0.0; n * dim_out],
        bias => bias.repeat(n),
    };
    let panels = Panels::of(slice(&w), depth, dim_out);
    vectorised(Scatter {
        x: slice(&x),
        panels: &panels,
        pairs,
        direction: Direction::Forward,
        y: &mut y,
    });
    let pairs = Arc::clone(pairs);
    record(
        inputs,
        tensor_of(y, [n, dim_out]),
        move |by_output, [by_x, by_w, by_b]| {
            let g = slice(by_output);
            let rows = if by_x {
                by_rows(slice(&w), g, &pairs, [n, dim_in, dim_out])
            } else {
                Vec::new()
            };
            let mut weight = vec![0.0; if by_w { depth * dim_out } else { 0 }];
            if by_w {
                vectorised(ByWeight {
                    x: slice(&x),
                    g,
                    pairs: &pairs,
                    dims: [dim_in, dim_out],
                    sum: &mut weight,
                });
            }
            let bias = if by_b {
                column_sums(g, dim_out)
            } else {
                Vec::new()
            };
            let (n_rows, n_weights, n_biases) = (
                rows.len() / dim_in.max(1),
                weight.len() / dim_out.max(1),
                bias.len(),
            );
            [
                tensor_of(rows, [n_rows, dim_in]),
                tensor_of(weight, [n_weights, dim_out]),
                tensor_of(bias, [n_biases]),
            ]
        },
    )
}

/// The gradient with respect to the rows: the sum of the gradients of all tokens of which a row is a neighbor, times the
/// transposed weights.
///
/// # Shapes
/// - w: `[offset × in, out]`
/// - g: `[token, out]`
/// - output: `[token, in]`
fn by_rows(
    w: &[f32],
    g: &[f32],
    pairs: &NeighborPairs,
    [n, dim_in, dim_out]: [usize; 3],
) -> Vec<f32> {
    let transposed = Panels::of_transposes(w, pairs.n_offsets(), dim_out, dim_in);
    let mut by_rows = vec![0.0; n * dim_in];
    vectorised(Scatter {
        x: g,
        panels: &transposed,
        pairs,
        direction: Direction::Backward,
        y: &mut by_rows,
    });
    by_rows
}

#[derive(Clone, Copy)]
enum Direction {
    /// From a neighbor to the token.
    Forward,
    /// From the token to its neighbor.
    Backward,
}

/// Adds the product of each pair's source row and its offset's weight to the pair's target row.
///
/// # Shapes
/// - x: `[token, depth]`, where `depth` is `in` forward and `out` backward
/// - panels: `[offset × depth, column]`
/// - y: `[token, column]`
struct Scatter<'a> {
    x: &'a [f32],
    /// The weights of all offsets, one below the other.
    panels: &'a Panels,
    pairs: &'a NeighborPairs,
    direction: Direction,
    y: &'a mut [f32],
}

impl Kernel for Scatter<'_> {
    #[inline(always)]
    fn run(self) {
        let depth = self.panels.depth() / self.pairs.n_offsets().max(1);
        for (offset, tokens, neighbors) in self.pairs.runs() {
            let (sources, targets) = match self.direction {
                Direction::Forward => (neighbors, tokens),
                Direction::Backward => (tokens, neighbors),
            };
            for (sources, targets) in sources.chunks(ROWS).zip(targets.chunks(ROWS)) {
                let rows = source_rows(self.x, sources, depth);
                for (columns, panel) in self.panels.iter() {
                    let sums = tile(
                        rows,
                        &panel[offset * depth..][..depth],
                        [[0.0; LANES]; ROWS],
                    );
                    add_sums(sums, &columns, targets, self.y, self.panels.n_columns());
                }
            }
        }
    }
}

/// The rows of up to `ROWS` sources. If there are fewer, the last one is repeated, and its further products are not used.
#[inline(always)]
fn source_rows<'a>(x: &'a [f32], sources: &[u32], depth: usize) -> [&'a [f32]; ROWS] {
    let mut rows = [&x[..0]; ROWS];
    for (r, row) in rows.iter_mut().enumerate() {
        let source = sources[r.min(sources.len() - 1)];
        *row = &x[source as usize * depth..][..depth];
    }
    rows
}

/// Adds each row of sums to the columns of its target.
///
/// # Shapes
/// - targets: at most `ROWS`
/// - y: `[token, width]`
#[inline(always)]
fn add_sums(
    sums: [Lane; ROWS],
    columns: &std::ops::Range<usize>,
    targets: &[u32],
    y: &mut [f32],
    width: usize,
) {
    match <&[u32; ROWS]>::try_from(targets) {
        // The loops have a constant length. Otherwise the sums would be moved from registers to the stack first.
        Ok(targets) if columns.len() == LANES => {
            for r in 0..ROWS {
                let start = targets[r] as usize * width + columns.start;
                if let Some(target) = y[start..].first_chunk_mut::<LANES>() {
                    for c in 0..LANES {
                        target[c] += sums[r][c];
                    }
                }
            }
        }
        _ => {
            let kept = sums;
            for (lane, &target) in kept.iter().zip(targets) {
                let row = &mut y[target as usize * width..][..width];
                add(lane, &mut row[columns.clone()]);
            }
        }
    }
}

/// `sum[offset] += x[neighbor]ᵀ g[token]` over the pairs of each offset.
///
/// # Shapes
/// - x: `[token, in]`
/// - g: `[token, out]`
/// - sum: `[offset, in, out]`
struct ByWeight<'a> {
    x: &'a [f32],
    g: &'a [f32],
    pairs: &'a NeighborPairs,
    dims: [usize; 2],
    sum: &'a mut [f32],
}

impl Kernel for ByWeight<'_> {
    #[inline(always)]
    fn run(self) {
        let [dim_in, dim_out] = self.dims;
        for (offset, tokens, neighbors) in self.pairs.runs() {
            let (x, g) = (self.x, self.g);
            let sum = &mut self.sum[offset * dim_in * dim_out..][..dim_in * dim_out];
            for (tokens, neighbors) in tokens
                .chunks(OUTER_CHUNK)
                .zip(neighbors.chunks(OUTER_CHUNK))
            {
                let pairs = NeighborRows {
                    x,
                    g,
                    neighbors,
                    tokens,
                    dims: self.dims,
                };
                add_outer_products(pairs, self.dims, sum);
            }
        }
    }
}

/// The row of each neighbor, and the gradient of its token.
///
/// # Shapes
/// - x: `[token, in]`
/// - g: `[token, out]`
/// - neighbors and tokens: `[pair]`
#[derive(Clone, Copy)]
struct NeighborRows<'a> {
    x: &'a [f32],
    g: &'a [f32],
    neighbors: &'a [u32],
    tokens: &'a [u32],
    dims: [usize; 2],
}

impl Pairs for NeighborRows<'_> {
    #[inline(always)]
    fn len(self) -> usize {
        self.tokens.len()
    }

    #[inline(always)]
    fn rows(&self, at: usize) -> (&[f32], &[f32]) {
        let [dim_in, dim_out] = self.dims;
        (
            &self.x[self.neighbors[at] as usize * dim_in..][..dim_in],
            &self.g[self.tokens[at] as usize * dim_out..][..dim_out],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check, input};
    use super::*;
    use crate::data::neighbors::Neighbors;
    use crate::kernels::ops::composed_convolution;

    #[test]
    fn fused_and_composed_agree() {
        for (n, dim_in, dim_out) in [(1, 6, 32), (9, 5, 7), (700, 16, 48)] {
            let table: Vec<u32> = (0..n * 27)
                .map(|slot| ((slot * 7919 + slot / 27) % (2 * n)).min(n) as u32)
                .collect();
            let neighbors = Neighbors::new(&table, 27);
            let inputs = [
                input([n, dim_in], "x"),
                input([27 * dim_in, dim_out], "w"),
                input([1, dim_out], "b"),
            ];
            check(
                &inputs,
                |[x, w, b]| convolution(&x, &neighbors.pairs, &w, Some(&b.flatten(0, 1))).unwrap(),
                |[x, w, b]| composed_convolution(x, &neighbors, w, Some(b.flatten(0, 1))),
            );
            let [x, w, _] = inputs;
            check(
                &[x, w],
                |[x, w]| convolution(&x, &neighbors.pairs, &w, None).unwrap(),
                |[x, w]| composed_convolution(x, &neighbors, w, None),
            );
        }
    }
}
