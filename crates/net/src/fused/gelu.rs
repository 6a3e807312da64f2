//! GELU with the error function: x·Φ(x), in one pass each way.

use super::{contiguous, exp_of_negative, record, slice, tensor_of, tracked};
use burn::tensor::Tensor;
use pulp::Arch;

/// x·Φ(x); none if the tensor is no tracked tensor of the flex backend.
pub(crate) fn gelu(rows: &Tensor<2>) -> Option<Tensor<2>> {
    let dims = rows.dims();
    let input = tracked(rows)?;
    let x = contiguous(input.primitive());
    let mut y = vec![0.0; dims[0] * dims[1]];
    Arch::new().dispatch(|| {
        for (y, &x) in y.iter_mut().zip(slice(&x)) {
            *y = x * normal_cdf(x).0;
        }
    });
    Some(record([input], tensor_of(y, dims), move |by_output| {
        let mut by_input = vec![0.0; dims[0] * dims[1]];
        Arch::new().dispatch(|| {
            for ((d, &g), &x) in by_input.iter_mut().zip(slice(by_output)).zip(slice(&x)) {
                let (cdf, density) = normal_cdf(x);
                *d = g * (cdf + x * density);
            }
        });
        [tensor_of(by_input, dims)]
    }))
}

/// Φ(x), to 1e-7 by formula 7.1.26 of Abramowitz and Stegun, and its derivative.
#[inline(always)]
fn normal_cdf(x: f32) -> (f32, f32) {
    /// Coefficients of the rational approximation of erfc(z)·e^{z²}, by falling power of t.
    const A: [f32; 5] = [1.061_405_4, -1.453_152, 1.421_413_8, -0.284_496_72, 0.254_829_6];
    /// 1/√(2π).
    const DENSITY_AT_0: f32 = 0.398_942_3;
    let bell = exp_of_negative(-0.5 * x * x);
    let t = 1.0 / (1.0 + 0.327_591_1 * std::f32::consts::FRAC_1_SQRT_2 * x.abs());
    let polynomial = ((((A[0] * t + A[1]) * t + A[2]) * t + A[3]) * t + A[4]) * t;
    let tail = 0.5 * polynomial * bell;
    (if x < 0.0 { tail } else { 1.0 - tail }, DENSITY_AT_0 * bell)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{assert_close, forward_and_gradients};
    use super::*;
    use burn::tensor::{Device, activation};

    #[test]
    fn fused_and_composed_agree() {
        let device = Device::flex().autodiff();
        for dims in [[1, 1], [7, 33], [64, 192]] {
            let fused = forward_and_gradients(dims, &device, |rows, _, _| gelu(&rows).unwrap());
            let composed = forward_and_gradients(dims, &device, |rows, _, _| activation::gelu(rows));
            assert_close(&fused, &composed);
        }
    }

    #[test]
    fn other_tensors_are_left_to_the_caller() {
        assert!(gelu(&Tensor::zeros([2, 2], &Device::flex())).is_none());
    }
}
