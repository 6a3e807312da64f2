//! Computes operations in one pass, with their own backward passes, for the flex backend.
//!
//! If they are composed of burn's operations, a norm makes ten tensors, attention stores its scores, and a convolution multiplies
//! empty cells. The operations here avoid all of that. Each returns `None` if a tensor is not on the flex backend. The caller
//! then composes the same function (`ops`), and the tests compare the two.
//!
//! Sums run in a fixed order and in 16 lanes on every processor, so the result does not depend on its vector width.

mod attention;
mod convolution;
mod gelu;
mod lanes;
mod layer_norm;
mod linear;
mod mean_shift;
mod mlp;
mod rotary;
mod segments;
mod tile;

pub(crate) use attention::patch_attention;
pub(crate) use convolution::convolution;
pub(crate) use gelu::gelu;
pub(crate) use layer_norm::layer_norm;
pub(crate) use linear::linear;
pub(crate) use mean_shift::mean_shift_step;
pub(crate) use mlp::{MlpWeights, mlp};
pub(crate) use rotary::rotary;
pub(crate) use segments::{cluster_max, gather};
pub(crate) use tile::{Kernel, vectorised};

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

/// A tensor of the flex backend, without its wrapper.
enum Flexible {
    Tracked(TrackedTensor),
    Plain(FlexTensor),
}

/// The tensor as the flex backend holds it, or `None` if it is on another backend.
fn flexible<const D: usize>(tensor: &Tensor<D>) -> Option<Flexible> {
    let tensor = tensor.clone();
    if tensor.is_autodiff() {
        tensor
            .try_into_primitive::<Tracked>()
            .ok()
            .map(Flexible::Tracked)
    } else {
        tensor
            .try_into_primitive::<Flex>()
            .ok()
            .map(Flexible::Plain)
    }
}

impl Flexible {
    /// The numbers in row-major order.
    fn values(&self) -> FlexTensor {
        match self {
            Self::Tracked(tensor) => tensor.primitive().to_contiguous(),
            Self::Plain(tensor) => tensor.to_contiguous(),
        }
    }

    fn tracked(self) -> Option<TrackedTensor> {
        match self {
            Self::Tracked(tensor) => Some(tensor),
            Self::Plain(_) => None,
        }
    }
}

/// The numbers of a contiguous tensor. Every tensor of this crate contains f32. For any other tensor, the slice is empty.
fn slice(tensor: &FlexTensor) -> &[f32] {
    tensor.as_slice::<f32>().unwrap_or_default()
}

fn tensor_of<const D: usize>(values: Vec<f32>, dims: [usize; D]) -> FlexTensor {
    FlexTensor::from_data(TensorData::new(values, dims))
}

/// Computes the gradients of N inputs from the gradient of the output. A gradient that is not needed may have any size.
type Pullback<const N: usize> =
    Arc<dyn Fn(&FlexTensor, [bool; N]) -> [FlexTensor; N] + Send + Sync>;

/// Adds an output that was computed outside of burn to burn's graph, if there is one.
///
/// Returns `None` if some inputs are tracked and others are not, because they then belong to different devices.
fn record<const N: usize, const D: usize>(
    inputs: [Flexible; N],
    output: FlexTensor,
    pullback: impl Fn(&FlexTensor, [bool; N]) -> [FlexTensor; N] + Send + Sync + 'static,
) -> Option<Tensor<D>> {
    if inputs
        .iter()
        .all(|input| matches!(input, Flexible::Plain(_)))
    {
        return Some(Tensor::from_primitive::<Flex>(output));
    }
    let tracked: Vec<TrackedTensor> = inputs.into_iter().filter_map(Flexible::tracked).collect();
    let tracked: [TrackedTensor; N] = tracked.try_into().ok()?;
    let nodes = tracked.each_ref().map(|input| input.node());
    drop(tracked);
    let tracked = match Fused
        .prepare::<NoCheckpointing>(nodes)
        .compute_bound()
        .stateful()
    {
        OpsKind::Tracked(preparation) => {
            preparation.finish(SavedPullback(Arc::new(pullback)), output)
        }
        OpsKind::UnTracked(preparation) => preparation.finish(output),
    };
    Some(Tensor::from_primitive::<Tracked>(tracked))
}

/// The number 0, with this gradient with respect to the rows. Returns `None` if the rows are not of the flex backend.
///
/// # Shapes
/// - rows and gradient: `[token, channel]`
/// - output: `[1]`
pub(crate) fn with_gradient(rows: &Tensor<2>, gradient: &TensorData) -> Option<Tensor<1>> {
    let gradient = FlexTensor::from_data(gradient.clone());
    record([flexible(rows)?], tensor_of(vec![0.0], [1]), move |_, _| {
        [gradient.clone()]
    })
}

#[derive(Debug)]
struct Fused;

#[derive(Clone)]
struct SavedPullback<const N: usize>(Pullback<N>);

impl<const N: usize> std::fmt::Debug for SavedPullback<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Saved")
    }
}

impl<const N: usize> Backward<Flex, N> for Fused {
    type State = SavedPullback<N>;

    fn backward(
        self,
        ops: Ops<SavedPullback<N>, N>,
        grads: &mut Gradients,
        _checkpointer: &mut Checkpointer,
    ) {
        let by_output = grads.consume::<Flex>(&ops.node).to_contiguous();
        let wanted = ops.parents.each_ref().map(Option::is_some);
        let by_input = (ops.state.0)(&by_output, wanted);
        for (parent, gradient) in ops.parents.into_iter().zip(by_input) {
            if let Some(node) = parent {
                grads.register::<Flex>(node.id, gradient);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::with_gradient;
    use crate::kernels::ops::composed_with_gradient;
    use crate::model::parameters::host_values;
    use burn::tensor::{Device, Tensor, TensorData};
    use partprobe_carrier::{keyed_rng, unit_interval};

    /// Random numbers that are the same in each run.
    pub(super) fn numbers(n: usize, key: &str) -> Vec<f32> {
        let rng = &mut keyed_rng(3, &[key]);
        (0..n)
            .map(|_| (6.0 * unit_interval(rng) - 3.0) as f32)
            .collect()
    }

    /// A matrix of random numbers.
    #[derive(Clone)]
    pub(super) struct Input {
        dims: [usize; 2],
        values: Vec<f32>,
    }

    pub(super) fn input(dims: [usize; 2], key: &str) -> Input {
        Input {
            dims,
            values: numbers(dims[0] * dims[1], key),
        }
    }

    impl Input {
        fn on(&self, device: &Device) -> Tensor<2> {
            Tensor::from_data(TensorData::new(self.values.clone(), self.dims), device)
        }
    }

    /// The output of a function of matrices, and the gradients of a weighted sum of it.
    fn forward_and_gradients<const N: usize>(
        inputs: &[Input; N],
        function: impl Fn([Tensor<2>; N]) -> Tensor<2>,
    ) -> Vec<Vec<f32>> {
        let device = Device::flex().autodiff();
        let inputs = inputs
            .each_ref()
            .map(|input| input.on(&device).require_grad());
        let output = function(inputs.clone());
        let weights = input(output.dims(), "weights").on(&device);
        let mut gradients = (output.clone() * weights).sum().backward();
        let by_input = inputs.map(|input| {
            input
                .grad_remove(&mut gradients)
                .map(host_values)
                .unwrap_or_default()
        });
        std::iter::once(host_values(output))
            .chain(by_input)
            .collect()
    }

    #[test]
    fn a_custom_gradient_is_used() {
        let device = Device::flex().autodiff();
        let rows = input([5, 3], "rows").on(&device).require_grad();
        let given = numbers(15, "gradient");
        for composed in [false, true] {
            let data = TensorData::new(given.clone(), [5, 3]);
            let number = match composed {
                false => with_gradient(&rows, &data).unwrap(),
                true => composed_with_gradient(rows.clone(), data),
            };
            let by_rows = rows.grad(&number.backward()).map(host_values);
            assert_eq!(by_rows.as_deref(), Some(given.as_slice()));
        }
    }

    /// Checks that fused and composed operations agree in values and gradients, with and without a graph.
    #[track_caller]
    pub(super) fn check<const N: usize>(
        inputs: &[Input; N],
        fused: impl Fn([Tensor<2>; N]) -> Tensor<2>,
        composed: impl Fn([Tensor<2>; N]) -> Tensor<2>,
    ) {
        let untracked = host_values(fused(
            inputs.each_ref().map(|input| input.on(&Device::flex())),
        ));
        let fused = forward_and_gradients(inputs, fused);
        assert_eq!(untracked, fused[0]);
        let composed = forward_and_gradients(inputs, composed);
        for (at, (a, b)) in fused.iter().zip(&composed).enumerate() {
            assert_eq!(a.len(), b.len(), "of {at}");
            let difference: f64 = a
                .iter()
                .zip(b)
                .map(|(x, y)| f64::from(x - y).powi(2))
                .sum::<f64>()
                .sqrt();
            let size: f64 = b.iter().map(|&y| f64::from(y).powi(2)).sum::<f64>().sqrt();
            // The absolute term is for gradients that nearly cancel.
            assert!(
                difference <= 3e-6 * size + 5e-7,
                "{at}: {difference:e} of {size:e}"
            );
        }
    }
}
