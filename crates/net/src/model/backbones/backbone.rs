//! Defines the interface of a backbone: its settings, its input and its network.

use super::stages::Stages;
use crate::config::ConfigError;
use crate::data::hierarchy::CurveOrders;
use crate::data::tokens::Tokens;
use crate::model::forward_mode::ForwardMode;
use crate::model::parameters::Initializer;
use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use partprobe_carrier::Rng;

/// Number of input channels of a token: position and normal.
pub(crate) const N_FEATURES: usize = 6;

/// The settings of a backbone in `[net.backbone]`, with functions that need no network.
pub(crate) trait BackboneSettings: Sized {
    /// Refuses settings that no network can have.
    ///
    /// # Errors
    /// If a value is out of its range.
    fn check(&self) -> Result<(), ConfigError>;

    /// Depths and widths. The output has [`Stages::output_width`] channels.
    fn stages(&self) -> Stages;

    /// The sizes that `partprobe models` lists, each with its name.
    fn named_sizes(&self) -> Vec<(&'static str, Self)>;

    /// Whether the shapes of a batch must go through the network together, because it has batch norms.
    fn runs_batch_as_one(&self) -> bool {
        false
    }

    /// The space-filling curves of each level at test time. The list is empty if the backbone uses none.
    fn test_orders(&self) -> CurveOrders {
        CurveOrders::new()
    }

    /// The curves of each level for one training step. It draws the same number of random numbers for any settings of the
    /// backbone.
    fn training_orders(&self, _rng: &mut Rng) -> CurveOrders {
        CurveOrders::new()
    }
}

/// A network from tokens to one row of features per token. The embedding head follows it.
pub(crate) trait Backbone: Module + Sized {
    /// The settings in `[net.backbone]`.
    type Config: BackboneSettings;
    /// One shape as numbers without tensors, so that a loader thread can prepare it.
    type Input;

    /// Turns the tokens of one shape into the input of the network.
    fn prepare(config: &Self::Config, tokens: &Tokens, orders: &CurveOrders) -> Self::Input;

    /// The network with the initial values that `init` draws.
    fn new(init: &Initializer, config: &Self::Config) -> Self;

    /// Passes shapes through the network together. The result of a shape depends on the other shapes only if there are batch
    /// norms.
    ///
    /// # Shapes
    /// - output: `[token, output_width]`, the tokens of the first shape first
    fn forward(
        &self,
        inputs: &[&Self::Input],
        device: &Device,
        mode: &mut ForwardMode,
    ) -> Tensor<2>;
}

/// Position and normal of each token.
///
/// # Shapes
/// - output: `[token, 6]`, row by row
pub(crate) fn features(tokens: &Tokens) -> Vec<f32> {
    tokens
        .positions
        .iter()
        .zip(&tokens.normals)
        .flat_map(|(position, normal)| position.iter().chain(normal))
        .copied()
        .collect()
}

/// # Shapes
/// - output: `[n_rows, values.len() / n_rows]`
pub(crate) fn matrix(values: Vec<f32>, n_rows: usize, device: &Device) -> Tensor<2> {
    let dim = values.len() / n_rows.max(1);
    Tensor::from_data(TensorData::new(values, [n_rows, dim]), device)
}
