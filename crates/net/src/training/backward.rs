//! Computes the gradient with respect to the parameters from the gradient ∂L/∂z with respect to the embeddings, with burn's
//! autodiff graph.

use crate::kernels::ops;
use crate::model::network::Network;
use crate::model::parameters;
use burn::tensor::Tensor;

/// The gradient of the loss with respect to every parameter, in the order of the parameters.
///
/// # Shapes
/// `z` is (tokens, embedding_dim); `gradient` holds ∂L/∂z row by row.
pub(super) fn backward(network: &Network, z: Tensor<2>, gradient: &[f64]) -> Vec<f32> {
    let mut gradients =
        ops::with_gradient(z, gradient.iter().map(|&g| g as f32).collect()).backward();
    parameters::gradients(network, &mut gradients)
}
