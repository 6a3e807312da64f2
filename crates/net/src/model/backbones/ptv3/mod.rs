//! Builds Point Transformer V3 (Wu et al., CVPR 2024): tokens and their hierarchy go in, and one row of features per token comes
//! out.
//!
//! The network has serialized patch attention, xCPE as a true 3³ submanifold convolution, grid pooling by code shift with a
//! maximum, and unpooling with a skip. Block i of a stage uses curve i of its level, modulo the number of curves. With `norm =
//! "layer"`, LayerNorm replaces the BatchNorm of PTv3, so that shapes do not depend on their batch. The number of parameters is
//! the same.

pub(crate) mod block;
mod config;
mod preset;

pub use config::Ptv3Config;
pub use preset::Preset;

use super::backbone::{Backbone, BackboneSettings, N_FEATURES};
use super::leveled_tokens::SurroundedTokens;
use super::stages::Stages;
use super::stem::{STEM_VOLUME, Stem};
use super::u_net::{self, DecoderStage, EncoderStage, UNetSettings};
use crate::config::ConfigError;
use crate::data::hierarchy::{CurveOrders, Hierarchy};
use crate::data::level_rows::LevelRows;
use crate::data::neighbors::Neighbors;
use crate::data::tokens::Tokens;
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::NormKind;
use crate::model::parameters::Initializer;
use block::Block;
use burn::module::Module;
use burn::tensor::{Device, Tensor};
use partprobe_carrier::Rng;

/// The network below the embedding head.
#[derive(Module, Debug)]
pub(crate) struct Ptv3 {
    stem: Stem,
    encoder: Vec<EncoderStage<Block>>,
    /// The stages from the coarsest to the finest.
    decoder: Vec<DecoderStage<Block>>,
}

impl BackboneSettings for Ptv3Config {
    fn check(&self) -> Result<(), ConfigError> {
        self.serialization().check()
    }

    fn stages(&self) -> Stages {
        self.preset.stages()
    }

    fn named_sizes(&self) -> Vec<(&'static str, Self)> {
        let with_preset = |preset: Preset| Self {
            preset,
            ..self.clone()
        };
        Preset::ALL
            .map(|preset| (preset.name(), with_preset(preset)))
            .to_vec()
    }

    fn runs_batch_as_one(&self) -> bool {
        self.norm == NormKind::Batch
    }

    fn test_orders(&self) -> CurveOrders {
        self.serialization().test_orders()
    }

    fn training_orders(&self, rng: &mut Rng) -> CurveOrders {
        self.serialization().training_orders(rng)
    }
}

impl Backbone for Ptv3 {
    type Config = Ptv3Config;
    type Input = SurroundedTokens;

    fn prepare(config: &Ptv3Config, tokens: &Tokens, orders: &CurveOrders) -> SurroundedTokens {
        let hierarchy = if config.cell_exchange {
            Hierarchy::with_cells
        } else {
            Hierarchy::new
        };
        SurroundedTokens::new(tokens, hierarchy(tokens, config.patch, orders))
    }

    fn new(init: &Initializer, config: &Ptv3Config) -> Self {
        Self::with_stages(init, &config.preset.stages(), config)
    }

    fn forward(
        &self,
        inputs: &[&SurroundedTokens],
        device: &Device,
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        let (around, batch) = SurroundedTokens::batch(inputs, device);
        self.forward_levels(batch.features, &around, &batch.levels, mode)
    }
}

impl Ptv3 {
    /// A network with these stages. The preset of `config` is not used.
    pub(crate) fn with_stages(init: &Initializer, stages: &Stages, config: &Ptv3Config) -> Self {
        let stem_width = stages.encoder_widths.first().copied().unwrap_or(0);
        let settings = UNetSettings {
            stages,
            norm: config.norm,
            drop_path: config.drop_path,
        };
        let block = |name: &str, settings| Block::new(init, name, config, settings);
        Self {
            stem: Stem::new(init, config.norm, [STEM_VOLUME * N_FEATURES, stem_width]),
            encoder: EncoderStage::all(init, settings, block),
            decoder: DecoderStage::all(init, settings, block),
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
        let rows = self.stem.forward(features, around, mode);
        u_net::forward(&self.encoder, &self.decoder, rows, levels, mode)
    }
}
