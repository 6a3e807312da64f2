//! Builds `PointTransformerX` (Reichardt, Ebert and Wasenmüller, CVPR workshops 2026, arXiv 2604.24169): tokens and their
//! hierarchy become one row of features per token, without any convolution.
//!
//! It has the stages of PTv3. A linear map is its stem, blocks have attention with rotary positions along learned axes, and a
//! perceptron with the square of ReLU whose hidden layer is twice as wide as the block. The paper does not say how channels
//! are shared out to the axes, nor how fast they turn: that is as in LitePT.

use super::backbone::{Backbone, N_FEATURES};
use super::leveled_tokens::LeveledTokens;
use super::ptv3::Preset;
use super::rotary_attention::{Axes, RotaryAttention};
use super::serialization::Serialization;
use super::stages::Stages;
use super::u_net::{self, BlockSettings, DecoderStage, EncoderStage, StageBlock, UNetSettings};
use crate::config::ConfigError;
use crate::data::curve::Curve;
use crate::data::hierarchy::{CurveOrders, Hierarchy};
use crate::data::level_rows::LevelRows;
use crate::data::tokens::Tokens;
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::{LayerNorm, Linear, NormKind, Projection};
use crate::model::parameters::Initializer;
use burn::module::Module;
use burn::tensor::{Device, Tensor, activation};
use partprobe_carrier::Rng;
use serde::{Deserialize, Serialize};

/// Channels of an attention head.
const HEAD_DIM: usize = 16;
/// Width of the hidden layer of a block's perceptron, in widths of the block.
const MLP_RATIO: usize = 2;

/// The settings of `PointTransformerX`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct PtxConfig {
    /// Depths and widths of the stages: those of PTv3.
    pub preset: Preset,
    /// Tokens in a patch of the serialized attention.
    pub patch: usize,
    /// The norm of stem, pooling and unpooling; blocks always have LayerNorm.
    pub norm: NormKind,
    /// Highest probability with which training leaves out a branch of a block, drawn for each point.
    pub drop_path: f64,
    /// The curves that serialize a shape, in the order in which the blocks of a stage take turns.
    pub orders: Vec<Curve>,
    /// Whether training shuffles the curves on each level, anew for each shape and step.
    pub shuffle_orders: bool,
}

impl Default for PtxConfig {
    /// The smallest preset, on all curves.
    fn default() -> Self {
        Self {
            preset: Preset::Micro,
            patch: 128,
            norm: NormKind::Layer,
            drop_path: 0.0,
            orders: Curve::ALL.to_vec(),
            shuffle_orders: true,
        }
    }
}

impl PtxConfig {
    fn serialization(&self) -> Serialization<'_> {
        Serialization {
            n_levels: self.preset.stages().n_levels(),
            patch: self.patch,
            orders: &self.orders,
            shuffle_orders: self.shuffle_orders,
            drop_path: self.drop_path,
        }
    }
}

/// The network below the embedding head.
#[derive(Module, Debug)]
pub(crate) struct Ptx {
    stem: Projection,
    encoder: Vec<EncoderStage<PtxBlock>>,
    /// From the coarsest stage down.
    decoder: Vec<DecoderStage<PtxBlock>>,
}

/// A block: attention and a perceptron, each added to what came in.
#[derive(Module, Debug)]
pub(crate) struct PtxBlock {
    attention: RotaryAttention,
    mlp: SquaredMlp,
    /// Probability of leaving out a branch.
    #[module(skip)]
    drop_path: f64,
}

/// A perceptron with one hidden layer and the square of ReLU, behind a norm.
#[derive(Module, Debug)]
pub(crate) struct SquaredMlp {
    norm: LayerNorm,
    hidden: Linear,
    out: Linear,
}

impl SquaredMlp {
    fn new(init: &Initializer, name: &str, width: usize) -> Self {
        let hidden = MLP_RATIO * width;
        Self {
            norm: LayerNorm::new(init, width),
            hidden: Linear::new(init, &format!("{name}.hidden"), [width, hidden]),
            out: Linear::new(init, &format!("{name}.out"), [hidden, width]),
        }
    }

    fn forward(&self, rows: Tensor<2>) -> Tensor<2> {
        let hidden = activation::relu(self.hidden.forward(self.norm.forward(rows)));
        self.out.forward(hidden.clone() * hidden)
    }
}

impl PtxBlock {
    fn new(init: &Initializer, name: &str, settings: BlockSettings) -> Self {
        let attention = RotaryAttention::new(
            init,
            &format!("{name}.attention"),
            [settings.width, HEAD_DIM],
            settings.index,
            Axes::Learned,
        );
        Self {
            attention,
            mlp: SquaredMlp::new(init, &format!("{name}.mlp"), settings.width),
            drop_path: settings.drop_path,
        }
    }
}

impl StageBlock for PtxBlock {
    fn forward(&self, rows: Tensor<2>, level: &LevelRows, mode: &mut ForwardMode) -> Tensor<2> {
        let mixed = self.attention.forward(rows.clone(), level);
        let rows = rows + mode.drop_path(mixed, self.drop_path);
        rows.clone() + mode.drop_path(self.mlp.forward(rows), self.drop_path)
    }
}

impl Backbone for Ptx {
    type Config = PtxConfig;
    type Input = LeveledTokens;

    fn check(config: &PtxConfig) -> Result<(), ConfigError> {
        config.serialization().check()
    }

    fn stages(config: &PtxConfig) -> Stages {
        config.preset.stages()
    }

    fn named_sizes(config: &PtxConfig) -> Vec<(&'static str, PtxConfig)> {
        let with_preset = |preset: Preset| PtxConfig {
            preset,
            ..config.clone()
        };
        Preset::ALL
            .map(|preset| (preset.name(), with_preset(preset)))
            .to_vec()
    }

    fn runs_batch_as_one(config: &PtxConfig) -> bool {
        config.norm == NormKind::Batch
    }

    fn test_orders(config: &PtxConfig) -> CurveOrders {
        config.serialization().test_orders()
    }

    fn training_orders(config: &PtxConfig, rng: &mut Rng) -> CurveOrders {
        config.serialization().training_orders(rng)
    }

    fn prepare(config: &PtxConfig, tokens: &Tokens, orders: &CurveOrders) -> LeveledTokens {
        LeveledTokens::new(tokens, Hierarchy::new(tokens, config.patch, orders))
    }

    fn new(init: &Initializer, config: &PtxConfig) -> Self {
        let stages = config.preset.stages();
        let settings = UNetSettings {
            stages: &stages,
            norm: config.norm,
            drop_path: config.drop_path,
        };
        let block = |name: &str, settings| PtxBlock::new(init, name, settings);
        let stem_dims = [N_FEATURES, stages.encoder_widths[0]];
        Self {
            stem: Projection::new(init, "stem", config.norm, stem_dims),
            encoder: EncoderStage::all(init, settings, block),
            decoder: DecoderStage::all(init, settings, block),
        }
    }

    fn forward(
        &self,
        inputs: &[&LeveledTokens],
        device: &Device,
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        let batch = LeveledTokens::batch(inputs.iter().copied(), device);
        let rows = self.stem.forward(batch.features, mode);
        u_net::forward(&self.encoder, &self.decoder, rows, &batch.levels, mode)
    }
}
