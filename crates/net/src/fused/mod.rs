//! Operations of one pass with a backward of their own, for training on the flex backend.
//!
//! Composed of burn's operations, a norm makes ten tensors and an activation calls a scalar error function; these make
//! one. Each returns none where tensors live elsewhere or no gradient is wanted, and the caller composes the same
//! function then. Sums run in 16 lanes whatever the processor has, so that its width does not reach the result.

mod gelu;
mod layer_norm;
mod softmax;

pub(crate) use gelu::gelu;
pub(crate) use layer_norm::layer_norm;
pub(crate) use softmax::softmax;

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::NoCheckpointing;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::flex::FlexTensor;
use burn::backend::{Autodiff, Flex};
use burn::tensor::{Tensor, TensorData};
use std::sync::Arc;

type Tracked = Autodiff<Flex>;
/// A tensor of the tracked flex backend, without its wrapper.
type TrackedTensor = burn::backend::tensor::FloatTensor<Tracked>;

/// The tensor as the flex backend holds it; none if it lives elsewhere or is not tracked.
fn tracked<const D: usize>(tensor: &Tensor<D>) -> Option<TrackedTensor> {
    if !tensor.is_autodiff() {
        return None;
    }
    tensor.clone().try_into_primitive::<Tracked>().ok()
}

/// The numbers of a tensor in row-major order.
fn contiguous(tensor: &FlexTensor) -> FlexTensor {
    tensor.to_contiguous()
}

/// The numbers of a contiguous tensor; nothing if it holds no f32, which no tensor of this crate does.
fn slice(tensor: &FlexTensor) -> &[f32] {
    tensor.as_slice::<f32>().unwrap_or_default()
}

fn tensor_of<const D: usize>(values: Vec<f32>, dims: [usize; D]) -> FlexTensor {
    FlexTensor::from_data(TensorData::new(values, dims))
}

/// Takes the gradient of an output to those of its N inputs.
type Pullback<const N: usize> = Arc<dyn Fn(&FlexTensor) -> [FlexTensor; N] + Send + Sync>;

/// Puts an output that was computed outside of burn into its graph.
fn record<const N: usize, const D: usize>(
    inputs: [TrackedTensor; N],
    output: FlexTensor,
    pullback: impl Fn(&FlexTensor) -> [FlexTensor; N] + Send + Sync + 'static,
) -> Tensor<D> {
    let guards = inputs.each_ref().map(|input| input.node());
    drop(inputs);
    let tracked = match Fused.prepare::<NoCheckpointing>(guards).compute_bound().stateful() {
        OpsKind::Tracked(preparation) => preparation.finish(Saved(Arc::new(pullback)), output),
        OpsKind::UnTracked(preparation) => preparation.finish(output),
    };
    Tensor::from_primitive::<Tracked>(tracked)
}

#[derive(Debug)]
struct Fused;

#[derive(Clone)]
struct Saved<const N: usize>(Pullback<N>);

impl<const N: usize> std::fmt::Debug for Saved<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Saved")
    }
}

impl<const N: usize> Backward<Flex, N> for Fused {
    type State = Saved<N>;

    fn backward(self, ops: Ops<Saved<N>, N>, grads: &mut Gradients, _checkpointer: &mut Checkpointer) {
        let by_output = contiguous(&grads.consume::<Flex>(&ops.node));
        let by_input = (ops.state.0)(&by_output);
        for (parent, gradient) in ops.parents.into_iter().zip(by_input) {
            if let Some(node) = parent {
                grads.register::<Flex>(node.id, gradient);
            }
        }
    }
}

/// Accumulators of a sum.
const LANES: usize = 16;

/// The sum of `term` over two rows of equal length.
#[inline(always)]
fn lane_sum(a: &[f32], b: &[f32], term: impl Fn(f32, f32) -> f32) -> f32 {
    let (a_lanes, a_rest) = a.as_chunks::<LANES>();
    let (b_lanes, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0f32; LANES];
    for (x, y) in a_lanes.iter().zip(b_lanes) {
        for lane in 0..LANES {
            sums[lane] += term(x[lane], y[lane]);
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(&x, &y)| term(x, y)).sum();
    sums.iter().sum::<f32>() + rest
}

/// e^x for x in −87..=0 to about 2 ulp, without a call: 2^n times a polynomial of the rest.
#[inline(always)]
fn exp_of_negative(x: f32) -> f32 {
    /// Adding this rounds to a whole number, which the lowest bits then hold.
    const ROUND: f32 = 12_582_912.0;
    /// ln 2 in two pieces, the first one exact in few bits.
    const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    let x = x.max(-87.0);
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = x - n * LN_2[0] - n * LN_2[1];
    // Taylor's series to r⁷; |r| is at most ln(2)/2.
    let series = 1.0 / 5040.0;
    let series = series * r + 1.0 / 720.0;
    let series = series * r + 1.0 / 120.0;
    let series = series * r + 1.0 / 24.0;
    let series = series * r + 1.0 / 6.0;
    let series = series * r + 0.5;
    let series = (series * r + 1.0) * r + 1.0;
    let exponent = shifted.to_bits() << 23;
    f32::from_bits(series.to_bits().wrapping_add(exponent))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::augment::unit_interval;
    use burn::tensor::Device;
    use carrier::keyed_rng;

    /// Random numbers, repeatable.
    pub(super) fn numbers(n: usize, key: &str) -> Vec<f32> {
        let rng = &mut keyed_rng(3, &[key]);
        (0..n).map(|_| (6.0 * unit_interval(rng) - 3.0) as f32).collect()
    }

    /// The output of a function of a matrix and two vectors, and the gradients of a weighted sum of it.
    pub(super) fn forward_and_gradients(
        [n, dim]: [usize; 2],
        device: &Device,
        function: impl Fn(Tensor<2>, Tensor<1>, Tensor<1>) -> Tensor<2>,
    ) -> Vec<Vec<f32>> {
        let rows = Tensor::<2>::from_data(TensorData::new(numbers(n * dim, "rows"), [n, dim]), device).require_grad();
        let vector = |key| Tensor::<1>::from_data(TensorData::new(numbers(dim, key), [dim]), device).require_grad();
        let (scale, shift) = (vector("scale"), vector("shift"));
        let output = function(rows.clone(), scale.clone(), shift.clone());
        let weights = Tensor::from_data(TensorData::new(numbers(n * dim, "weights"), [n, dim]), device);
        let mut gradients = (output.clone() * weights).sum().backward();
        let host = |tensor: Option<Tensor<1>>| tensor.map(crate::parameters::host_values).unwrap_or_default();
        vec![
            crate::parameters::host_values(output),
            rows.grad_remove(&mut gradients).map(crate::parameters::host_values).unwrap_or_default(),
            host(scale.grad_remove(&mut gradients)),
            host(shift.grad_remove(&mut gradients)),
        ]
    }

    #[track_caller]
    pub(super) fn assert_close(fused: &[Vec<f32>], composed: &[Vec<f32>]) {
        assert_eq!(fused.len(), composed.len());
        for (a, b) in fused.iter().zip(composed) {
            assert_eq!(a.len(), b.len());
            let apart: f64 = a.iter().zip(b).map(|(x, y)| f64::from(x - y).powi(2)).sum::<f64>().sqrt();
            let size: f64 = b.iter().map(|&y| f64::from(y).powi(2)).sum::<f64>().sqrt();
            assert!(apart <= 2e-6 * size, "{apart:e} of {size:e}");
        }
    }

    #[test]
    fn the_exponential_is_right_to_its_last_bits() {
        for step in 0..=8700 {
            let x = -(step as f32) / 100.0;
            let exact = f64::from(x).exp();
            assert!((f64::from(exp_of_negative(x)) / exact - 1.0).abs() < 4e-7, "{x}");
        }
        assert!(exp_of_negative(-1000.0) < 1e-37);
    }

    #[test]
    fn sums_count_every_number_once() {
        for n in [0, 1, 15, 16, 17, 48, 100] {
            let ones = vec![1.0; n];
            assert_eq!(lane_sum(&ones, &ones, |x, y| x + y), 2.0 * n as f32);
        }
    }
}
