//! Builds Point Transformer V3 (Wu et al., CVPR 2024): tokens and their hierarchy become one row of features per token.
//!
//! Serialized patch attention, xCPE as a true 3³ submanifold convolution, grid pooling by code shift with a maximum,
//! unpooling with a skip. Block i of a stage follows curve i of its level, modulo the number of curves.
//! With `norm = "layer"`, LayerNorm replaces the BatchNorm of PTv3, so that shapes do not depend on their batch.
//! The number of parameters is the same.

pub(crate) mod block;
mod config;
pub(crate) mod input;
mod preset;
pub(crate) mod stage;

pub use config::Ptv3Config;
pub use preset::Preset;

use super::backbone::{Backbone, N_FEATURES, matrix};
use super::stages::Stages;
use crate::config::ConfigError;
use crate::data::hierarchy::{CurveOrders, Hierarchy, fixed_orders, shuffled_orders};
use crate::data::level_rows::{LevelRows, levels_of};
use crate::data::neighbors::Neighbors;
use crate::data::tokens::Tokens;
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::NormKind;
use crate::model::parameters::Initializer;
use burn::module::Module;
use burn::tensor::{Device, Tensor};
use input::Ptv3Input;
use partprobe_carrier::Rng;
use stage::{DecoderStage, EncoderStage, STEM_VOLUME, Stem};

/// The network below the embedding head.
#[derive(Module, Debug)]
pub(crate) struct Ptv3 {
    stem: Stem,
    encoder: Vec<EncoderStage>,
    /// From the coarsest stage down.
    decoder: Vec<DecoderStage>,
}

impl Backbone for Ptv3 {
    type Config = Ptv3Config;
    type Input = Ptv3Input;

    fn check(config: &Ptv3Config) -> Result<(), ConfigError> {
        config.check()
    }

    fn stages(config: &Ptv3Config) -> Stages {
        config.preset.stages()
    }

    fn named_sizes(config: &Ptv3Config) -> Vec<(&'static str, Ptv3Config)> {
        let with_preset = |preset: Preset| Ptv3Config {
            preset,
            ..config.clone()
        };
        Preset::ALL
            .map(|preset| (preset.name(), with_preset(preset)))
            .to_vec()
    }

    fn runs_batch_as_one(config: &Ptv3Config) -> bool {
        config.norm == NormKind::Batch
    }

    fn test_orders(config: &Ptv3Config) -> CurveOrders {
        fixed_orders(config.preset.stages().n_levels(), &config.orders)
    }

    fn training_orders(config: &Ptv3Config, rng: &mut Rng) -> CurveOrders {
        // Drawn in any case, so that the switch changes no other random number.
        let shuffled = shuffled_orders(config.preset.stages().n_levels(), &config.orders, rng);
        if config.shuffle_orders {
            shuffled
        } else {
            Self::test_orders(config)
        }
    }

    fn prepare(config: &Ptv3Config, tokens: &Tokens, orders: &CurveOrders) -> Ptv3Input {
        Ptv3Input::new(tokens, config, orders)
    }

    fn new(init: &Initializer, config: &Ptv3Config) -> Self {
        Self::with_stages(init, &config.preset.stages(), config)
    }

    fn forward(&self, inputs: &[&Ptv3Input], device: &Device, mode: &mut ForwardMode) -> Tensor<2> {
        let features: Vec<f32> = inputs
            .iter()
            .flat_map(|input| &input.features)
            .copied()
            .collect();
        let around: Vec<&Neighbors> = inputs.iter().map(|input| &input.around).collect();
        let hierarchies: Vec<&Hierarchy> = inputs.iter().map(|input| &input.hierarchy).collect();

        let n_tokens = features.len() / N_FEATURES;
        self.forward_levels(
            matrix(features, n_tokens, device),
            &Neighbors::joined(&around),
            &levels_of(&hierarchies),
            mode,
        )
    }
}

impl Ptv3 {
    /// A network of these stages; the preset of `config` is not used.
    pub(crate) fn with_stages(init: &Initializer, stages: &Stages, config: &Ptv3Config) -> Self {
        let stem_width = stages.encoder_widths.first().copied().unwrap_or(0);
        Self {
            stem: Stem::new(init, config.norm, [STEM_VOLUME * N_FEATURES, stem_width]),
            encoder: EncoderStage::all(init, stages, config),
            decoder: DecoderStage::all(init, stages, config),
        }
    }

    /// Up through the encoder and down through the decoder, with a skip on each level.
    ///
    /// # Shapes
    /// - features: `[token, 6]`
    /// - around: the 5³ neighborhood of each token
    /// - levels: as many as there are stages
    /// - output: `[token, output_width]`
    pub(crate) fn forward_levels(
        &self,
        features: Tensor<2>,
        around: &Neighbors,
        levels: &[LevelRows],
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        let mut rows = self.stem.forward(features, around, mode);
        let mut skips = Vec::with_capacity(levels.len());
        for (idx, (stage, level)) in self.encoder.iter().zip(levels).enumerate() {
            if let Some(below) = idx.checked_sub(1) {
                rows = stage.pool(rows, &levels[below], mode);
            }
            rows = stage
                .blocks
                .iter()
                .fold(rows, |rows, block| block.forward(rows, level, mode));
            skips.push(rows.clone());
        }
        skips.pop();
        for (stage, level) in self.decoder.iter().zip(levels[..skips.len()].iter().rev()) {
            let Some(skip) = skips.pop() else { break };
            rows = stage.forward(rows, skip, level, mode);
        }
        rows
    }
}
