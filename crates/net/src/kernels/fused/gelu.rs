//! Computes GELU with the error function, x·Φ(x) (Hendrycks and Gimpel, 2016), in one forward and one backward pass.

use super::lanes::exp_of_negative;
use super::tile::{Kernel, vectorised};
use super::{Flexible, flexible, record, slice, tensor_of};
use burn::tensor::Tensor;

/// x·Φ(x) of each number. Returns `None` if the tensor is not of the flex backend.
///
/// # Shapes
/// - rows and output: `[token, channel]`
pub(crate) fn gelu(rows: &Tensor<2>) -> Option<Tensor<2>> {
    let dims = rows.dims();
    let inputs = [flexible(rows)?];
    let [x] = inputs.each_ref().map(Flexible::values);
    let y = gelu_of(slice(&x));
    record(inputs, tensor_of(y, dims), move |by_output, _| {
        [tensor_of(by_gelu(slice(&x), slice(by_output)), dims)]
    })
}

/// GELU of each number.
fn gelu_of(x: &[f32]) -> Vec<f32> {
    let mut y = vec![0.0; x.len()];
    vectorised(Gelu { x, y: &mut y });
    y
}

/// The gradient with respect to the input of GELU, from the gradient with respect to its output.
fn by_gelu(x: &[f32], by_output: &[f32]) -> Vec<f32> {
    let mut by_input = vec![0.0; x.len()];
    vectorised(GeluPullback {
        x,
        g: by_output,
        d: &mut by_input,
    });
    by_input
}

struct Gelu<'a> {
    x: &'a [f32],
    y: &'a mut [f32],
}

impl Kernel for Gelu<'_> {
    #[inline(always)]
    fn run(self) {
        for (y, &x) in self.y.iter_mut().zip(self.x) {
            *y = x * normal_cdf(x).0;
        }
    }
}

struct GeluPullback<'a> {
    x: &'a [f32],
    g: &'a [f32],
    d: &'a mut [f32],
}

impl Kernel for GeluPullback<'_> {
    #[inline(always)]
    fn run(self) {
        for ((d, &g), &x) in self.d.iter_mut().zip(self.g).zip(self.x) {
            let (cdf, density) = normal_cdf(x);
            *d = g * (cdf + x * density);
        }
    }
}

/// Φ(x), accurate to 1e-7 by formula 7.1.26 of Abramowitz and Stegun, and its derivative.
#[inline(always)]
pub(super) fn normal_cdf(x: f32) -> (f32, f32) {
    /// Coefficients of the rational approximation of erfc(z)·e^{z²}, from the highest power of t to the lowest.
    const A: [f32; 5] = [
        1.061_405_4,
        -1.453_152,
        1.421_413_8,
        -0.284_496_72,
        0.254_829_6,
    ];
    /// 1/√(2π).
    const DENSITY_AT_0: f32 = 0.398_942_3;
    let bell = exp_of_negative(-0.5 * x * x);
    let t = 1.0
        / x.abs()
            .mul_add(0.327_591_1 * std::f32::consts::FRAC_1_SQRT_2, 1.0);
    let polynomial = A[0]
        .mul_add(t, A[1])
        .mul_add(t, A[2])
        .mul_add(t, A[3])
        .mul_add(t, A[4])
        * t;
    let tail = 0.5 * polynomial * bell;
    (if x < 0.0 { tail } else { 1.0 - tail }, DENSITY_AT_0 * bell)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check, input};
    use super::*;
    #[cfg(feature = "ndarray")]
    use burn::tensor::Device;
    use burn::tensor::activation;

    #[test]
    fn fused_and_composed_agree() {
        for dims in [[1, 1], [7, 33], [64, 192]] {
            check(
                &[input(dims, "x")],
                |[x]| gelu(&x).unwrap(),
                |[x]| activation::gelu(x),
            );
        }
    }

    #[test]
    #[cfg(feature = "ndarray")]
    #[allow(deprecated, reason = "the backend that is not flex")]
    fn ndarray_tensors_are_left_to_the_caller() {
        assert!(gelu(&Tensor::zeros([2, 2], &Device::ndarray())).is_none());
        assert!(gelu(&Tensor::zeros([2, 2], &Device::ndarray().autodiff())).is_none());
    }
}
