//! Builds LitePT (Yue et al., CVPR 2026, arXiv 2512.13689): tokens and their hierarchy go in, and one row of features per token
//! comes out.
//!
//! The fine levels have convolutions and no attention. The coarse levels have attention and no convolution. Attention gets the
//! positions of tokens by rotary encoding along the axes of the grid. The decoder only unpools and has no blocks.

use super::backbone::{Backbone, BackboneSettings, N_FEATURES};
use super::leveled_tokens::SurroundedTokens;
use super::ptv3::block::{Mlp, Xcpe};
use super::rotary_attention::{Axes, RotaryAttention};
use super::serialization::{SerializedConfig, SizePreset};
use super::stages::Stages;
use super::stem::{STEM_VOLUME, Stem};
use super::u_net::{self, BlockSettings, DecoderStage, EncoderStage, StageBlock, UNetSettings};
use crate::data::hierarchy::{CurveOrders, Hierarchy};
use crate::data::level_rows::LevelRows;
use crate::data::tokens::Tokens;
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::LayerNorm;
use crate::model::parameters::Initializer;
use burn::module::Module;
use burn::tensor::{Device, Tensor};
use serde::{Deserialize, Serialize};

/// Channels of an attention head: three pairs per axis.
const HEAD_DIM: usize = 18;

/// The named sizes of `LitePT`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LiteptPreset {
    /// Three stages. It can be trained on a CPU.
    #[default]
    Micro,
    /// Four stages.
    Tiny,
    /// LitePT-S as published: five stages, 12.7 million parameters.
    Small,
}

impl SizePreset for LiteptPreset {
    const SIZES: &'static [Self] = &[Self::Micro, Self::Tiny, Self::Small];

    fn size_name(self) -> &'static str {
        match self {
            Self::Micro => "micro",
            Self::Tiny => "tiny",
            Self::Small => "small",
        }
    }

    fn size_stages(self) -> Stages {
        let new = |encoder: &[(usize, usize)], decoder_widths: &[usize]| {
            let (encoder_depths, encoder_widths) = encoder.iter().copied().unzip();
            Stages {
                encoder_depths,
                encoder_widths,
                decoder_depths: vec![0; decoder_widths.len()],
                decoder_widths: decoder_widths.to_vec(),
            }
        };
        match self {
            Self::Micro => new(&[(1, 36), (1, 54), (2, 72)], &[54, 54]),
            Self::Tiny => new(&[(1, 36), (1, 72), (2, 108), (2, 144)], &[72, 72, 108]),
            Self::Small => new(
                &[(2, 36), (2, 72), (2, 144), (6, 252), (2, 504)],
                &[72, 72, 144, 252],
            ),
        }
    }
}

impl LiteptPreset {
    /// The number of finest stages that have convolutions. The other stages have attention.
    fn n_convolution_stages(self) -> usize {
        match self {
            Self::Micro | Self::Tiny => 2,
            Self::Small => 3,
        }
    }
}

/// The settings of `LitePT`.
pub type LiteptConfig = SerializedConfig<LiteptPreset>;

/// The network below the embedding head.
#[derive(Module, Debug)]
pub(crate) struct Litept {
    stem: Stem,
    encoder: Vec<EncoderStage<LiteptBlock>>,
    /// The stages from the coarsest to the finest.
    decoder: Vec<DecoderStage<LiteptBlock>>,
}

/// A block: either a convolution that is added to the input or a norm, then attention and a perceptron.
#[derive(Module, Debug)]
pub(crate) struct LiteptBlock {
    xcpe: Option<Xcpe>,
    attention: Option<AttentionBranches>,
    /// Probability of leaving out a branch.
    #[module(skip)]
    drop_path: f64,
}

#[derive(Module, Debug)]
pub(crate) struct AttentionBranches {
    norm: LayerNorm,
    attention: RotaryAttention,
    mlp: Mlp,
}

impl LiteptBlock {
    fn new(
        init: &Initializer,
        name: &str,
        n_convolution_stages: usize,
        settings: BlockSettings,
    ) -> Self {
        let width = settings.width;
        let is_convolution = settings.stage < n_convolution_stages;
        let branches = || AttentionBranches {
            norm: LayerNorm::new(init, width),
            attention: RotaryAttention::new(
                init,
                &format!("{name}.attention.attention"),
                [width, HEAD_DIM],
                settings.index,
                Axes::Grid,
            ),
            mlp: Mlp::new(init, &format!("{name}.attention.mlp"), width),
        };
        Self {
            xcpe: is_convolution.then(|| Xcpe::new(init, &format!("{name}.xcpe"), width)),
            attention: (!is_convolution).then(branches),
            drop_path: settings.drop_path,
        }
    }
}

impl StageBlock for LiteptBlock {
    fn forward(&self, mut rows: Tensor<2>, level: &LevelRows, mode: &mut ForwardMode) -> Tensor<2> {
        if let Some(xcpe) = &self.xcpe {
            rows = rows.clone() + xcpe.forward(rows, level);
        }
        if let Some(branches) = &self.attention {
            rows = branches.norm.forward(rows);
            let mixed = branches.attention.forward(rows.clone(), level);
            rows = rows + mode.drop_path(mixed, self.drop_path);
            rows = rows.clone() + mode.drop_path(branches.mlp.forward(rows), self.drop_path);
        }
        rows
    }
}

impl Backbone for Litept {
    type Config = LiteptConfig;
    type Input = SurroundedTokens;

    fn prepare(config: &LiteptConfig, tokens: &Tokens, orders: &CurveOrders) -> SurroundedTokens {
        SurroundedTokens::new(tokens, Hierarchy::new(tokens, config.patch, orders))
    }

    fn new(init: &Initializer, config: &LiteptConfig) -> Self {
        let stages = config.stages();
        let settings = UNetSettings {
            stages: &stages,
            norm: config.norm,
            drop_path: config.drop_path,
        };
        let n_convolution_stages = config.preset.n_convolution_stages();
        let block =
            |name: &str, settings| LiteptBlock::new(init, name, n_convolution_stages, settings);
        let stem_width = stages.encoder_widths[0];
        Self {
            stem: Stem::new(init, config.norm, [STEM_VOLUME * N_FEATURES, stem_width]),
            encoder: EncoderStage::all(init, settings, block),
            decoder: DecoderStage::all(init, settings, block),
        }
    }

    fn forward(
        &self,
        inputs: &[&SurroundedTokens],
        device: &Device,
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        let (around, batch) = SurroundedTokens::batch(inputs, device);
        let rows = self.stem.forward(batch.features, &around, mode);
        u_net::forward(&self.encoder, &self.decoder, rows, &batch.levels, mode)
    }
}
