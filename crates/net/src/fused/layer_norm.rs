//! Layer normalisation of rows, in one pass each way.

use super::{contiguous, lane_sum, record, slice, tensor_of, tracked};
use burn::tensor::Tensor;
use pulp::Arch;

/// Each row to mean 0 and variance 1, then scaled and shifted; none if a tensor is no tracked one of the flex backend.
pub(crate) fn layer_norm(rows: &Tensor<2>, scale: &Tensor<1>, shift: &Tensor<1>, epsilon: f32) -> Option<Tensor<2>> {
    let [n, dim] = rows.dims();
    let inputs = [tracked(rows)?, tracked(scale)?, tracked(shift)?];
    let [x, scale, shift] = inputs.each_ref().map(|input| contiguous(input.primitive()));
    let mut y = vec![0.0; n * dim];
    Arch::new().dispatch(|| {
        for (y, x) in y.chunks_exact_mut(dim).zip(slice(&x).chunks_exact(dim)) {
            normalise(x, y, epsilon);
            for ((y, scale), shift) in y.iter_mut().zip(slice(&scale)).zip(slice(&shift)) {
                *y = *y * scale + shift;
            }
        }
    });
    Some(record(inputs, tensor_of(y, [n, dim]), move |by_output| {
        let mut by_row = vec![0.0; n * dim];
        let (mut by_scale, mut by_shift) = (vec![0.0; dim], vec![0.0; dim]);
        Arch::new().dispatch(|| {
            let mut unit = vec![0.0; dim];
            let chunks = slice(&x).chunks_exact(dim).zip(slice(by_output).chunks_exact(dim));
            for ((x, g), d) in chunks.zip(by_row.chunks_exact_mut(dim)) {
                let inverse = normalise(x, &mut unit, epsilon);
                pull_back(g, slice(&scale), &unit, inverse, d);
                for (((s, b), &g), &unit) in by_scale.iter_mut().zip(&mut by_shift).zip(g).zip(&unit) {
                    *s += g * unit;
                    *b += g;
                }
            }
        });
        [tensor_of(by_row, [n, dim]), tensor_of(by_scale, [dim]), tensor_of(by_shift, [dim])]
    }))
}

/// Writes the row with mean 0 and variance 1, and returns what it was multiplied by.
#[inline(always)]
fn normalise(x: &[f32], unit: &mut [f32], epsilon: f32) -> f32 {
    let share = 1.0 / x.len() as f32;
    let mean = lane_sum(x, x, |x, _| x) * share;
    let variance = lane_sum(x, x, |x, _| (x - mean) * (x - mean)) * share;
    let inverse = 1.0 / (variance + epsilon).sqrt();
    for (unit, x) in unit.iter_mut().zip(x) {
        *unit = (x - mean) * inverse;
    }
    inverse
}

/// The gradient by the row: the scaled gradient less its mean and its component along the normalised row.
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
    use super::super::tests::{assert_close, forward_and_gradients};
    use super::*;
    use crate::ops::composed_layer_norm;
    use burn::tensor::Device;

    #[test]
    fn fused_and_composed_agree() {
        let device = Device::flex().autodiff();
        for dims in [[1, 5], [7, 33], [50, 48]] {
            let fused = forward_and_gradients(dims, &device, |rows, scale, shift| {
                layer_norm(&rows, &scale, &shift, 1e-5).unwrap()
            });
            assert_close(&fused, &forward_and_gradients(dims, &device, composed_layer_norm));
        }
    }
}
