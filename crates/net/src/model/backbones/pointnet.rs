//! Builds the baseline without neighborhoods (after PointNet, Qi et al., CVPR 2017): a shared perceptron and one maximum.
//!
//! It takes one row of features per token and returns one row per token. A token receives information about the other
//! tokens only from the maximum over all of them.

use super::backbone::{Backbone, BackboneSettings, N_FEATURES, features, matrix};
use super::stages::Stages;
use crate::config::{ConfigError, ensure};
use crate::data::hierarchy::CurveOrders;
use crate::data::tokens::Tokens;
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::{NormKind, Projection};
use crate::model::parameters::Initializer;
use burn::module::Module;
use burn::tensor::{Device, Tensor};
use serde::{Deserialize, Serialize};

/// The size of the perceptron.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PointnetConfig {
    /// Widths of the layers before the maximum. The last one is the length of the global feature.
    pub widths: Vec<usize>,
}

/// The network below the embedding head.
#[derive(Module, Debug)]
pub(crate) struct Pointnet {
    local: Vec<Projection>,
    merge: Projection,
}

impl BackboneSettings for PointnetConfig {
    fn check(&self) -> Result<(), ConfigError> {
        ensure(
            !self.widths.is_empty() && self.widths.iter().all(|width| (1..=4096).contains(width)),
            "net.backbone.widths",
            "must hold at least one width, each in 1..=4096",
        )
    }

    fn stages(&self) -> Stages {
        Stages {
            encoder_depths: vec![1; self.widths.len()],
            encoder_widths: self.widths.clone(),
            decoder_depths: Vec::new(),
            decoder_widths: Vec::new(),
        }
    }

    fn named_sizes(&self) -> Vec<(&'static str, Self)> {
        vec![("pointnet", self.clone())]
    }
}

impl Backbone for Pointnet {
    type Config = PointnetConfig;
    /// The features of one shape, row by row.
    type Input = Vec<f32>;

    fn prepare(_: &PointnetConfig, tokens: &Tokens, _: &CurveOrders) -> Vec<f32> {
        features(tokens)
    }

    fn new(init: &Initializer, config: &PointnetConfig) -> Self {
        let mut below = N_FEATURES;
        let mut local = Vec::with_capacity(config.widths.len());
        for (idx, &width) in config.widths.iter().enumerate() {
            let name = format!("local.{idx}");
            let dims = [below, width];
            local.push(Projection::new(init, &name, NormKind::Layer, dims));
            below = width;
        }
        let merge = Projection::new(init, "merge", NormKind::Layer, [2 * below, below]);
        Self { local, merge }
    }

    fn forward(&self, inputs: &[&Vec<f32>], device: &Device, mode: &mut ForwardMode) -> Tensor<2> {
        let each = inputs.iter().map(|features| {
            let n_tokens = features.len() / N_FEATURES;
            self.forward_shape(matrix(features.to_vec(), n_tokens, device), mode)
        });
        Tensor::cat(each.collect(), 0)
    }
}

impl Pointnet {
    /// # Shapes
    /// - features: `[token, 6]`
    /// - output: `[token, last width]`
    fn forward_shape(&self, features: Tensor<2>, mode: &mut ForwardMode) -> Tensor<2> {
        let local = self
            .local
            .iter()
            .fold(features, |rows, layer| layer.forward(rows, mode));
        let whole = local.clone().max_dim(0).expand(local.dims());
        self.merge.forward(Tensor::cat(vec![local, whole], 1), mode)
    }
}
