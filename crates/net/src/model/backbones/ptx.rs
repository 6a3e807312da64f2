//! Builds `PointTransformerX` (Reichardt, Ebert and Wasenmüller, CVPR workshops 2026, arXiv 2604.24169): tokens and their
//! hierarchy become one row of features per token, without any convolution.
//!
//! It has the stages of PTv3. Its stem is a linear map. Blocks have attention with rotary positions along learned axes, and a
//! perceptron with the square of ReLU whose hidden layer is twice as wide as the block. The paper does not describe how channels
//! are divided among the axes, or with which frequencies they are rotated. These are as in LitePT.

use super::backbone::{Backbone, BackboneSettings, N_FEATURES};
use super::leveled_tokens::LeveledTokens;
use super::ptv3::Preset;
use super::rotary_attention::{Axes, RotaryAttention};
use super::serialization::SerializedConfig;
use super::u_net::{self, BlockSettings, DecoderStage, EncoderStage, StageBlock, UNetSettings};
use crate::data::hierarchy::{CurveOrders, Hierarchy};
use crate::data::level_rows::LevelRows;
use crate::data::tokens::Tokens;
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::{LayerNorm, Linear, Projection};
use crate::model::parameters::Initializer;
use burn::module::Module;
use burn::tensor::{Device, Tensor, activation};

/// Channels of an attention head.
const HEAD_DIM: usize = 16;
/// Width of the hidden layer of a block's perceptron, as a multiple of the width of the block.
const MLP_RATIO: usize = 2;

/// The settings of `PointTransformerX`, which has the sizes of PTv3.
pub type PtxConfig = SerializedConfig<Preset>;

/// The network below the embedding head.
#[derive(Module, Debug)]
pub(crate) struct Ptx {
    stem: Projection,
    encoder: Vec<EncoderStage<PtxBlock>>,
    /// The stages from the coarsest to the finest.
    decoder: Vec<DecoderStage<PtxBlock>>,
}

/// A block: attention and a perceptron. The output of each is added to its input.
#[derive(Module, Debug)]
pub(crate) struct PtxBlock {
    attention: RotaryAttention,
    mlp: SquaredMlp,
    /// Probability of leaving out a branch.
    #[module(skip)]
    drop_path: f64,
}

/// A norm, followed by a perceptron with one hidden layer and the square of ReLU.
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

    fn prepare(config: &PtxConfig, tokens: &Tokens, orders: &CurveOrders) -> LeveledTokens {
        LeveledTokens::new(tokens, Hierarchy::new(tokens, config.patch, orders))
    }

    fn new(init: &Initializer, config: &PtxConfig) -> Self {
        let stages = config.stages();
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
