//! Normalizes rows (layer normalization, Ba et al., 2016), in one forward and one backward pass.

use super::lanes::lane_sum;
use super::tile::{CHUNK, Kernel, extend_zeroed, vectorised};
use super::{Flexible, flexible, record, slice, tensor_of};
use burn::tensor::Tensor;

/// Normalizes each row to mean 0 and variance 1, then scales and shifts each channel.
///
/// Returns `None` if a tensor is not of the flex backend.
///
/// # Shapes
/// - rows and output: `[token, channel]`
/// - scale and shift: `[channel]`
pub(crate) fn layer_norm(
    rows: &Tensor<2>,
    scale: &Tensor<1>,
    shift: &Tensor<1>,
    epsilon: f32,
) -> Option<Tensor<2>> {
    let [n, dim] = rows.dims();
    let inputs = [flexible(rows)?, flexible(scale)?, flexible(shift)?];
    let [x, scale, shift] = inputs.each_ref().map(Flexible::values);
    let mut y = Vec::with_capacity(n * dim);
    vectorised(Forward {
        x: slice(&x),
        scale: slice(&scale),
        shift: slice(&shift),
        epsilon,
        y: &mut y,
    });
    record(inputs, tensor_of(y, [n, dim]), move |by_output, _| {
        let (mut by_row, mut by_scale, mut by_shift) =
            (Vec::with_capacity(n * dim), vec![0.0; dim], vec![0.0; dim]);
        let pullback = Pullback {
            scale: slice(&scale),
            epsilon,
            unit: &mut vec![0.0; dim],
            by_scale: &mut by_scale,
            by_shift: &mut by_shift,
        };
        vectorised(AllRows {
            pullback,
            x: slice(&x),
            g: slice(by_output),
            by_row: &mut by_row,
        });
        [
            tensor_of(by_row, [n, dim]),
            tensor_of(by_scale, [dim]),
            tensor_of(by_shift, [dim]),
        ]
    })
}

struct Forward<'a> {
    x: &'a [f32],
    scale: &'a [f32],
    shift: &'a [f32],
    epsilon: f32,
    y: &'a mut Vec<f32>,
}

impl Kernel for Forward<'_> {
    #[inline(always)]
    fn run(self) {
        for x in self.x.chunks(CHUNK * self.scale.len().max(1)) {
            normalize_rows(
                x,
                self.scale,
                self.shift,
                self.epsilon,
                extend_zeroed(self.y, x.len()),
            );
        }
    }
}

/// Writes each row with mean 0 and variance 1, scaled and shifted.
///
/// # Shapes
/// - x and y: `[row, channel]`
/// - scale and shift: `[channel]`
#[inline(always)]
pub(super) fn normalize_rows(x: &[f32], scale: &[f32], shift: &[f32], epsilon: f32, y: &mut [f32]) {
    let dim = scale.len().max(1);
    for (y, x) in y.chunks_exact_mut(dim).zip(x.chunks_exact(dim)) {
        normalize(x, y, epsilon);
        for ((y, scale), shift) in y.iter_mut().zip(scale).zip(shift) {
            *y = *y * scale + shift;
        }
    }
}

/// The inputs of the backward pass of a norm, and the sums to which it adds. Each slice has one number per channel.
pub(super) struct Pullback<'a> {
    pub(super) scale: &'a [f32],
    pub(super) epsilon: f32,
    /// Room for one normalized row.
    pub(super) unit: &'a mut [f32],
    pub(super) by_scale: &'a mut [f32],
    pub(super) by_shift: &'a mut [f32],
}

impl Pullback<'_> {
    /// Writes the gradients with respect to the rows `x`, from those with respect to the normalized rows.
    ///
    /// # Shapes
    /// - x, g and by_row: `[row, channel]`
    #[inline(always)]
    pub(super) fn rows(&mut self, x: &[f32], g: &[f32], by_row: &mut [f32]) {
        let dim = self.scale.len().max(1);
        let chunks = x.chunks_exact(dim).zip(g.chunks_exact(dim));
        for ((x, g), d) in chunks.zip(by_row.chunks_exact_mut(dim)) {
            let inverse = normalize(x, self.unit, self.epsilon);
            pull_back(g, self.scale, self.unit, inverse, d);
            let sums = self.by_scale.iter_mut().zip(self.by_shift.iter_mut());
            for (((s, b), &g), &unit) in sums.zip(g).zip(self.unit.iter()) {
                *s += g * unit;
                *b += g;
            }
        }
    }
}

/// The backward pass of all rows at once.
///
/// # Shapes
/// - x, g and by_row: `[token, channel]`
struct AllRows<'a> {
    pullback: Pullback<'a>,
    x: &'a [f32],
    g: &'a [f32],
    by_row: &'a mut Vec<f32>,
}

impl Kernel for AllRows<'_> {
    #[inline(always)]
    fn run(mut self) {
        let size = CHUNK * self.pullback.scale.len().max(1);
        for (x, g) in self.x.chunks(size).zip(self.g.chunks(size)) {
            self.pullback
                .rows(x, g, extend_zeroed(self.by_row, x.len()));
        }
    }
}

/// Writes the row with mean 0 and variance 1, and returns the factor by which it was multiplied.
#[inline(always)]
fn normalize(x: &[f32], unit: &mut [f32], epsilon: f32) -> f32 {
    let share = 1.0 / x.len() as f32;
    let mean = lane_sum(x, x, |x, _| x) * share;
    let variance = lane_sum(x, x, |x, _| (x - mean) * (x - mean)) * share;
    let inverse = 1.0 / (variance + epsilon).sqrt();
    for (unit, x) in unit.iter_mut().zip(x) {
        *unit = (x - mean) * inverse;
    }
    inverse
}

/// The gradient with respect to the row: the scaled gradient minus its mean and its component along the normalized row.
#[inline(always)]
fn pull_back(g: &[f32], scale: &[f32], unit: &[f32], inverse: f32, by_row: &mut [f32]) {
    for ((d, g), scale) in by_row.iter_mut().zip(g).zip(scale) {
        *d = g * scale;
    }
    let share = 1.0 / g.len() as f32;
    let mean = lane_sum(by_row, by_row, |d, _| d) * share;
    let along = lane_sum(by_row, unit, |d, unit| d * unit) * share;
    for (d, unit) in by_row.iter_mut().zip(unit) {
        *d = inverse * (*d - mean - unit * along);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check, input};
    use super::*;
    use crate::kernels::ops::composed_layer_norm;

    #[test]
    fn fused_and_composed_agree() {
        for [n, dim] in [[1, 5], [7, 33], [50, 48]] {
            check(
                &[
                    input([n, dim], "x"),
                    input([1, dim], "scale"),
                    input([1, dim], "shift"),
                ],
                |[x, scale, shift]| {
                    layer_norm(&x, &scale.flatten(0, 1), &shift.flatten(0, 1), 1e-5).unwrap()
                },
                |[x, scale, shift]| {
                    composed_layer_norm(x, scale.flatten(0, 1), shift.flatten(0, 1))
                },
            );
        }
    }
}
