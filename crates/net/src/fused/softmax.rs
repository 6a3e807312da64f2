//! The softmax of scaled scores, in one pass each way.

use super::{contiguous, exp_of_negative, lane_sum, record, slice, tensor_of, tracked};
use burn::tensor::Tensor;
use pulp::Arch;

/// softmax(`factor` · scores) along the last axis; none if the tensor is no tracked one of the flex backend.
pub(crate) fn softmax(scores: &Tensor<4>, factor: f32) -> Option<Tensor<4>> {
    let dims = scores.dims();
    let width = dims[3];
    let input = tracked(scores)?;
    let x = contiguous(input.primitive());
    let mut y = vec![0.0; dims.iter().product()];
    Arch::new().dispatch(|| {
        for (y, x) in y.chunks_exact_mut(width).zip(slice(&x).chunks_exact(width)) {
            normalise(x, y, factor);
        }
    });
    let output = tensor_of(y, dims);
    let saved = output.clone();
    Some(record([input], output, move |by_output| {
        let mut by_input = vec![0.0; dims.iter().product()];
        Arch::new().dispatch(|| {
            let rows = slice(&saved).chunks_exact(width).zip(slice(by_output).chunks_exact(width));
            for ((y, g), d) in rows.zip(by_input.chunks_exact_mut(width)) {
                let mean = lane_sum(y, g, |y, g| y * g);
                for ((d, y), g) in d.iter_mut().zip(y).zip(g) {
                    *d = factor * y * (g - mean);
                }
            }
        });
        [tensor_of(by_input, dims)]
    }))
}

#[inline(always)]
fn normalise(x: &[f32], y: &mut [f32], factor: f32) {
    // The factor is positive, so that the largest score stays the largest.
    let highest = x.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    for (y, x) in y.iter_mut().zip(x) {
        *y = exp_of_negative(factor * (x - highest));
    }
    let inverse = 1.0 / lane_sum(y, y, |y, _| y);
    y.iter_mut().for_each(|y| *y *= inverse);
}

#[cfg(test)]
mod tests {
    use super::super::tests::{assert_close, forward_and_gradients};
    use super::*;
    use burn::tensor::{Device, activation};

    #[test]
    fn fused_and_composed_agree() {
        let device = Device::flex().autodiff();
        for [n, dim] in [[4, 1], [8, 33], [12, 128]] {
            let as_scores = |rows: Tensor<2>| rows.reshape([2, 2, n / 4, dim]);
            let fused = forward_and_gradients([n, dim], &device, |rows, _, _| {
                softmax(&as_scores(rows), 0.25).unwrap().reshape([n, dim])
            });
            let composed = forward_and_gradients([n, dim], &device, |rows, _, _| {
                activation::softmax(as_scores(rows) * 0.25, 3).reshape([n, dim])
            });
            assert_close(&fused, &composed);
        }
    }
}
