//! Computes the perceptron of a block as one operation: layer norm, linear map, GELU, linear map.
//!
//! Rows are processed in chunks that stay in the cache. The values between the two maps are four times as wide as the rows and
//! are never written to memory. The backward pass computes them again.

use super::gelu::normal_cdf;
use super::layer_norm::{self, normalize_rows};
use super::linear::{add_rows, multiply};
use super::tile::{CHUNK, Kernel, Panels, RowPairs, add_outer_products, extend_zeroed, vectorised};
use super::{Flexible, flexible, record, slice, tensor_of};
use burn::tensor::Tensor;

/// Scale and shift of the norm, then for each of the two maps the weight and the bias, if there is one.
///
/// # Shapes
/// - norm: `[in]` each
/// - hidden: `[in, hidden]` and `[hidden]`
/// - out: `[hidden, out]` and `[out]`
pub(crate) struct MlpWeights {
    pub(crate) norm: [Tensor<1>; 2],
    pub(crate) hidden: (Tensor<2>, Option<Tensor<1>>),
    pub(crate) out: (Tensor<2>, Option<Tensor<1>>),
}

/// The perceptron of each row. Returns `None` if a tensor is not of the flex backend, or a bias is missing.
///
/// # Shapes
/// - rows: `[token, in]`
/// - output: `[token, out]`
pub(crate) fn mlp(rows: &Tensor<2>, weights: &MlpWeights, epsilon: f32) -> Option<Tensor<2>> {
    let [n, dim] = rows.dims();
    let (width, dim_out) = (weights.hidden.0.dims()[1], weights.out.0.dims()[1]);
    let [scale, shift] = &weights.norm;
    let inputs = [
        flexible(rows)?,
        flexible(scale)?,
        flexible(shift)?,
        flexible(&weights.hidden.0)?,
        flexible(weights.hidden.1.as_ref()?)?,
        flexible(&weights.out.0)?,
        flexible(weights.out.1.as_ref()?)?,
    ];
    let values = inputs.each_ref().map(Flexible::values);
    let mut y = Vec::with_capacity(n * dim_out);
    vectorised(Forward {
        layers: &Layers::new(values.each_ref().map(slice), epsilon),
        x: slice(&values[0]),
        y: &mut y,
    });
    record(inputs, tensor_of(y, [n, dim_out]), move |by_output, _| {
        let numbers = values.each_ref().map(slice);
        let mut found = values.each_ref().map(|value| vec![0.0; slice(value).len()]);
        found[0].clear();
        let layers = Layers::new(numbers, epsilon);
        vectorised(Pullback {
            layers: &layers,
            weights: numbers,
            g: slice(by_output),
            found: &mut found,
        });
        let [x, scale, shift, w1, b1, w2, b2] = found;
        [
            tensor_of(x, [n, dim]),
            tensor_of(scale, [dim]),
            tensor_of(shift, [dim]),
            tensor_of(w1, [dim, width]),
            tensor_of(b1, [width]),
            tensor_of(w2, [width, dim_out]),
            tensor_of(b2, [dim_out]),
        ]
    })
}

/// The weights, ready for products.
struct Layers<'a> {
    scale: &'a [f32],
    shift: &'a [f32],
    epsilon: f32,
    hidden: Panels,
    hidden_bias: &'a [f32],
    out: Panels,
    out_bias: &'a [f32],
}

impl<'a> Layers<'a> {
    fn new([_, scale, shift, w1, b1, w2, b2]: [&'a [f32]; 7], epsilon: f32) -> Self {
        Self {
            scale,
            shift,
            epsilon,
            hidden: Panels::of(w1, scale.len(), b1.len()),
            hidden_bias: b1,
            out: Panels::of(w2, b1.len(), b2.len()),
            out_bias: b2,
        }
    }

    /// Writes the normalized rows, and the sums before GELU.
    ///
    /// # Shapes
    /// - x and normed: `[row, in]`
    /// - before: `[row, hidden]`
    #[inline(always)]
    fn before_gelu(&self, x: &[f32], normed: &mut [f32], before: &mut [f32]) {
        normalize_rows(x, self.scale, self.shift, self.epsilon, normed);
        multiply(normed, &self.hidden, self.hidden_bias, before);
    }
}

/// # Shapes
/// - x: `[token, in]`
/// - y: `[token, out]`
struct Forward<'a> {
    layers: &'a Layers<'a>,
    x: &'a [f32],
    y: &'a mut Vec<f32>,
}

impl Kernel for Forward<'_> {
    #[inline(always)]
    fn run(self) {
        let layers = self.layers;
        let (dim, width, dim_out) = (
            layers.scale.len(),
            layers.hidden_bias.len(),
            layers.out_bias.len(),
        );
        let (mut normed, mut hidden) = (vec![0.0; CHUNK * dim], vec![0.0; CHUNK * width]);
        for x in self.x.chunks(CHUNK * dim.max(1)) {
            let n = x.len() / dim.max(1);
            let hidden = &mut hidden[..n * width];
            layers.before_gelu(x, &mut normed[..n * dim], hidden);
            for x in hidden.iter_mut() {
                *x *= normal_cdf(*x).0;
            }
            multiply(
                hidden,
                &layers.out,
                layers.out_bias,
                extend_zeroed(self.y, n * dim_out),
            );
        }
    }
}

/// # Shapes
/// - g: `[token, out]`, the gradient by the output
struct Pullback<'a> {
    layers: &'a Layers<'a>,
    /// Rows, scale, shift, and weight and bias of both maps.
    weights: [&'a [f32]; 7],
    g: &'a [f32],
    /// The gradients with respect to each of these.
    found: &'a mut [Vec<f32>; 7],
}

impl Kernel for Pullback<'_> {
    #[inline(always)]
    fn run(self) {
        let Self {
            layers,
            weights: [x, _, _, w1, _, w2, _],
            g,
            found,
        } = self;
        let [by_x, by_scale, by_shift, by_w1, by_b1, by_w2, by_b2] = found;
        let (dim, width, dim_out) = (
            layers.scale.len(),
            layers.hidden_bias.len(),
            layers.out_bias.len(),
        );
        let mut pass = BackwardPass {
            layers,
            hidden_back: Panels::of_transpose(w1, width, dim),
            out_back: Panels::of_transpose(w2, dim_out, width),
            norm: layer_norm::Pullback {
                scale: layers.scale,
                epsilon: layers.epsilon,
                unit: &mut vec![0.0; dim],
                by_scale,
                by_shift,
            },
            by_hidden_weights: [by_w1, by_b1],
            by_out_weights: [by_w2, by_b2],
        };
        let mut room = ChunkRoom::new(dim, width);
        let chunks = x
            .chunks(CHUNK * dim.max(1))
            .zip(g.chunks(CHUNK * dim_out.max(1)));
        for (x, g) in chunks {
            let chunk = room.rows(x.len() / dim.max(1), dim, width);
            pass.chunk(x, g, chunk, extend_zeroed(by_x, x.len()));
        }
    }
}

/// Memory for the values between the maps for some rows, and for the gradients with respect to them.
///
/// # Shapes
/// - normed and by_normed: `[row, in]`
/// - before, after and by_hidden: `[row, hidden]`; before and after GELU
struct ChunkRoom<T> {
    normed: T,
    by_normed: T,
    before: T,
    after: T,
    by_hidden: T,
}

impl ChunkRoom<Vec<f32>> {
    fn new(dim: usize, width: usize) -> Self {
        Self {
            normed: vec![0.0; CHUNK * dim],
            by_normed: vec![0.0; CHUNK * dim],
            before: vec![0.0; CHUNK * width],
            after: vec![0.0; CHUNK * width],
            by_hidden: vec![0.0; CHUNK * width],
        }
    }

    /// The memory of the first `n` rows.
    #[inline(always)]
    fn rows(&mut self, n: usize, dim: usize, width: usize) -> ChunkRoom<&mut [f32]> {
        ChunkRoom {
            normed: &mut self.normed[..n * dim],
            by_normed: &mut self.by_normed[..n * dim],
            before: &mut self.before[..n * width],
            after: &mut self.after[..n * width],
            by_hidden: &mut self.by_hidden[..n * width],
        }
    }
}

/// The transposed maps, and the gradients with respect to all weights. Each chunk of rows adds to these gradients.
struct BackwardPass<'a> {
    layers: &'a Layers<'a>,
    hidden_back: Panels,
    out_back: Panels,
    norm: layer_norm::Pullback<'a>,
    /// The gradients with respect to the weight and the bias of the first map.
    by_hidden_weights: [&'a mut Vec<f32>; 2],
    /// The gradients with respect to the weight and the bias of the second map.
    by_out_weights: [&'a mut Vec<f32>; 2],
}

impl BackwardPass<'_> {
    /// Writes the gradients with respect to the rows `x`, from those with respect to their output.
    ///
    /// # Shapes
    /// - x and by_x: `[row, in]`
    /// - g: `[row, out]`
    #[inline(always)]
    fn chunk(&mut self, x: &[f32], g: &[f32], room: ChunkRoom<&mut [f32]>, by_x: &mut [f32]) {
        let ChunkRoom {
            normed,
            by_normed,
            before,
            after,
            by_hidden,
        } = room;
        let layers = self.layers;
        let (dim, width, dim_out) = (
            layers.scale.len(),
            layers.hidden_bias.len(),
            layers.out_bias.len(),
        );
        layers.before_gelu(x, normed, before);
        multiply(g, &self.out_back, &[], by_hidden);
        pull_back_gelu(before, after, by_hidden);
        let [by_w2, by_b2] = &mut self.by_out_weights;
        add_outer_products(
            RowPairs {
                a: after,
                b: g,
                widths: [width, dim_out],
            },
            [width, dim_out],
            by_w2,
        );
        add_rows(g, by_b2);
        let [by_w1, by_b1] = &mut self.by_hidden_weights;
        add_outer_products(
            RowPairs {
                a: normed,
                b: by_hidden,
                widths: [dim, width],
            },
            [dim, width],
            by_w1,
        );
        add_rows(by_hidden, by_b1);
        multiply(by_hidden, &self.hidden_back, &[], by_normed);
        self.norm.rows(x, by_normed, by_x);
    }
}

/// Writes GELU of `before`, and replaces the gradients with respect to its output by those with respect to its input.
#[inline(always)]
fn pull_back_gelu(before: &[f32], after: &mut [f32], by_hidden: &mut [f32]) {
    for ((after, by_hidden), &z) in after
        .iter_mut()
        .zip(by_hidden.iter_mut())
        .zip(before.iter())
    {
        let (cdf, density) = normal_cdf(z);
        *after = z * cdf;
        *by_hidden *= cdf + z * density;
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check, input};
    use super::*;
    use crate::kernels::ops::composed_mlp;

    #[test]
    fn fused_and_composed_agree() {
        for [n, dim, width] in [[1, 5, 3], [7, 16, 64], [230, 33, 50]] {
            let inputs = [
                input([n, dim], "x"),
                input([1, dim], "scale"),
                input([1, dim], "shift"),
                input([dim, width], "w1"),
                input([1, width], "b1"),
                input([width, dim], "w2"),
                input([1, dim], "b2"),
            ];
            let weights = |[scale, shift, w1, b1, w2, b2]: [Tensor<2>; 6]| MlpWeights {
                norm: [scale.flatten(0, 1), shift.flatten(0, 1)],
                hidden: (w1, Some(b1.flatten(0, 1))),
                out: (w2, Some(b2.flatten(0, 1))),
            };
            check(
                &inputs,
                |[x, rest @ ..]| mlp(&x, &weights(rest), 1e-5).unwrap(),
                |[x, rest @ ..]| composed_mlp(x, weights(rest)),
            );
        }
    }
}
