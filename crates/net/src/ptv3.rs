//! Point Transformer V3 (Wu et al., CVPR 2024): tokens and their hierarchy in, one feature row a token out.
//!
//! Serialised patch attention, xCPE as a true 3³ submanifold convolution, grid pooling by code shift with a maximum,
//! unpooling with a skip. LayerNorm stands where PTv3 has BatchNorm, so that shapes do not depend on their batch;
//! the parameter count is the same. Blocks take the four curves in turn, counted through the whole network.

use crate::config::Preset;
use crate::hierarchy::{Hierarchy, Level};
use crate::layers::{LayerNorm, Linear, Projection};
use crate::ops::{self, Neighbours, PatchRows, Rows};
use crate::parameters::Initializer;
use burn::module::Module;
use burn::tensor::Tensor;

/// Channels of an attention head.
const HEAD_DIM: usize = 16;
/// Width of the hidden layer of a block's perceptron, in widths of the block.
const MLP_RATIO: usize = 4;
/// Cells in the neighbourhood of xCPE.
const XCPE_VOLUME: usize = 27;
/// Cells in the neighbourhood of the stem.
pub(crate) const STEM_VOLUME: usize = 125;

/// Depths and widths of the stages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Stages {
    pub(crate) encoder_depths: Vec<usize>,
    pub(crate) encoder_widths: Vec<usize>,
    /// From the finest stage up; one stage fewer than the encoder has.
    pub(crate) decoder_depths: Vec<usize>,
    pub(crate) decoder_widths: Vec<usize>,
}

impl Stages {
    pub(crate) fn of(preset: Preset) -> Self {
        match preset {
            Preset::Micro => Self {
                encoder_depths: vec![1, 1, 1],
                encoder_widths: vec![32, 48, 64],
                decoder_depths: vec![1, 1],
                decoder_widths: vec![48, 48],
            },
        }
    }

    /// Levels of the hierarchy that the network walks through.
    pub(crate) fn n_levels(&self) -> usize {
        self.encoder_widths.len()
    }

    /// Width of the output.
    pub(crate) fn output_width(&self) -> usize {
        self.decoder_widths.first().or(self.encoder_widths.last()).copied().unwrap_or(0)
    }
}

/// The network below the embedding head.
#[derive(Module, Debug)]
pub(crate) struct Ptv3 {
    stem: Stem,
    encoder: Vec<EncoderStage>,
    /// From the coarsest stage down.
    decoder: Vec<DecoderStage>,
}

/// A 5³ submanifold convolution of the input features, its norm and GELU.
#[derive(Module, Debug)]
struct Stem {
    conv: Linear,
    norm: LayerNorm,
}

#[derive(Module, Debug)]
struct EncoderStage {
    pool: Option<Projection>,
    blocks: Vec<Block>,
}

#[derive(Module, Debug)]
struct DecoderStage {
    child: Projection,
    skip: Projection,
    blocks: Vec<Block>,
}

/// A level of the hierarchy as the operations want it.
pub(crate) struct LevelRows {
    neighbours: Neighbours,
    patches: [PatchRows; 4],
    pooling: Option<PoolingRows>,
}

struct PoolingRows {
    members: Rows,
    cluster: Rows,
}

impl LevelRows {
    /// All levels, from the finest up.
    pub(crate) fn of(hierarchy: &Hierarchy) -> Vec<Self> {
        hierarchy.levels.iter().map(Self::new).collect()
    }

    fn new(level: &Level) -> Self {
        Self {
            neighbours: Neighbours::new(&level.neighbours, XCPE_VOLUME),
            patches: level.patches.each_ref().map(PatchRows::new),
            pooling: level.pooling.as_ref().map(|pooling| PoolingRows {
                members: Rows::new(&pooling.members, crate::hierarchy::Pooling::MAX_MEMBERS),
                cluster: Rows::new(&pooling.cluster, 1),
            }),
        }
    }
}

impl Ptv3 {
    /// A network of these stages whose input has `n_features` channels.
    pub(crate) fn new(init: &Initializer, n_features: usize, stages: &Stages) -> Self {
        let widths = &stages.encoder_widths;
        let stem_width = widths.first().copied().unwrap_or(0);
        let mut turns = 0..;
        let encoder = (0..widths.len())
            .map(|stage| {
                let name = format!("encoder.{stage}");
                let dims = |below: usize| [widths[below], widths[stage]];
                let pool =
                    stage.checked_sub(1).map(|below| Projection::new(init, &format!("{name}.pool"), dims(below)));
                let depth = stages.encoder_depths[stage];
                EncoderStage { pool, blocks: blocks(init, &name, widths[stage], turns.by_ref().take(depth)) }
            })
            .collect();
        let mut below = widths.last().copied().unwrap_or(0);
        let decoder = (0..stages.decoder_widths.len())
            .rev()
            .map(|stage| {
                let name = format!("decoder.{stage}");
                let width = stages.decoder_widths[stage];
                let child = Projection::new(init, &format!("{name}.child"), [below, width]);
                let skip = Projection::new(init, &format!("{name}.skip"), [widths[stage], width]);
                below = width;
                let depth = stages.decoder_depths[stage];
                DecoderStage { child, skip, blocks: blocks(init, &name, width, turns.by_ref().take(depth)) }
            })
            .collect();
        Self { stem: Stem::new(init, [STEM_VOLUME * n_features, stem_width]), encoder, decoder }
    }

    /// # Shapes
    /// - features: `[token, feature]`
    /// - around: the 5³ neighbourhood of each token
    /// - levels: as many as there are stages
    /// - output: `[token, output_width]`
    pub(crate) fn forward(&self, features: Tensor<2>, around: &Neighbours, levels: &[LevelRows]) -> Tensor<2> {
        let stem = ops::convolution(features, around, self.stem.conv.weight(), None);
        let mut rows = ops::gelu(self.stem.norm.forward(stem));
        let mut skips = Vec::with_capacity(levels.len());
        for (idx, (stage, level)) in self.encoder.iter().zip(levels).enumerate() {
            let below = idx.checked_sub(1).and_then(|below| levels[below].pooling.as_ref());
            if let (Some(pool), Some(below)) = (&stage.pool, below) {
                rows = pool.forward_pooled(rows, &below.members);
            }
            rows = stage.blocks.iter().fold(rows, |rows, block| block.forward(rows, level));
            skips.push(rows.clone());
        }
        skips.pop();
        for (stage, level) in self.decoder.iter().zip(levels[..skips.len()].iter().rev()) {
            let (Some(skip), Some(pooling)) = (skips.pop(), &level.pooling) else { break };
            let from_child = ops::gather(stage.child.forward(rows), &pooling.cluster);
            rows = from_child + stage.skip.forward(skip);
            rows = stage.blocks.iter().fold(rows, |rows, block| block.forward(rows, level));
        }
        rows
    }
}

impl Stem {
    fn new(init: &Initializer, dims: [usize; 2]) -> Self {
        Self { conv: Linear::without_bias(init, "stem.conv", dims), norm: LayerNorm::new(init, dims[1]) }
    }
}

fn blocks(init: &Initializer, stage: &str, width: usize, turns: impl Iterator<Item = usize>) -> Vec<Block> {
    turns.enumerate().map(|(idx, turn)| Block::new(init, &format!("{stage}.blocks.{idx}"), width, turn)).collect()
}

/// xCPE, patch attention and perceptron, each added to what came in.
#[derive(Module, Debug)]
struct Block {
    conv: Linear,
    conv_out: Linear,
    conv_norm: LayerNorm,
    attention_norm: LayerNorm,
    qkv: Linear,
    attention_out: Linear,
    mlp_norm: LayerNorm,
    mlp_in: Linear,
    mlp_out: Linear,
    /// Which of the level's four serialisations the attention follows.
    #[module(skip)]
    turn: usize,
    #[module(skip)]
    n_heads: usize,
}

impl Block {
    fn new(init: &Initializer, name: &str, width: usize, turn: usize) -> Self {
        let linear = |layer: &str, dims| Linear::new(init, &format!("{name}.{layer}"), dims);
        Self {
            conv: linear("conv", [XCPE_VOLUME * width, width]),
            conv_out: linear("conv_out", [width, width]),
            conv_norm: LayerNorm::new(init, width),
            attention_norm: LayerNorm::new(init, width),
            qkv: linear("qkv", [width, 3 * width]),
            attention_out: linear("attention_out", [width, width]),
            mlp_norm: LayerNorm::new(init, width),
            mlp_in: linear("mlp_in", [width, MLP_RATIO * width]),
            mlp_out: linear("mlp_out", [MLP_RATIO * width, width]),
            turn: turn % 4,
            n_heads: width / HEAD_DIM,
        }
    }

    fn forward(&self, rows: Tensor<2>, level: &LevelRows) -> Tensor<2> {
        let place = ops::convolution(rows.clone(), &level.neighbours, self.conv.weight(), self.conv.bias());
        let rows = rows + self.conv_norm.forward(self.conv_out.forward(place));
        let qkv = self.qkv.forward(self.attention_norm.forward(rows.clone()));
        let mixed = ops::patch_attention(qkv, &level.patches[self.turn], self.n_heads);
        let rows = rows + self.attention_out.forward(mixed);
        let hidden = self.mlp_in.forward_gelu(self.mlp_norm.forward(rows.clone()));
        rows + self.mlp_out.forward(hidden)
    }
}
