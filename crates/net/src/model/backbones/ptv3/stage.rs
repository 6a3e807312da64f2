//! Defines the stages of PTv3: the stem, pooling and blocks on the way up, unpooling and blocks on the way down.

use super::block::{Block, BlockSettings};
use super::config::Ptv3Config;
use crate::data::level_rows::LevelRows;
use crate::data::neighbors::Neighbors;
use crate::kernels::ops::{self};
use crate::model::backbones::stages::Stages;
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::{Linear, Norm, NormKind, Projection};
use crate::model::parameters::Initializer;
use burn::module::Module;
use burn::tensor::Tensor;

/// Cells in the neighborhood of the stem.
pub(crate) const STEM_VOLUME: usize = 125;

/// A 5³ submanifold convolution of the input features, its norm and GELU.
#[derive(Module, Debug)]
pub(crate) struct Stem {
    conv: Linear,
    norm: Norm,
}

/// Pooling, but on the finest level, and blocks.
#[derive(Module, Debug)]
pub(crate) struct EncoderStage {
    pool: Option<Projection>,
    pub(super) blocks: Vec<Block>,
}

/// Unpooling with a skip, and blocks.
#[derive(Module, Debug)]
pub(crate) struct DecoderStage {
    child: Projection,
    skip: Projection,
    blocks: Vec<Block>,
    /// Whether the first xCPE sees only the skip.
    #[module(skip)]
    xcpe_of_skip: bool,
}

impl Stem {
    pub(crate) fn new(init: &Initializer, norm: NormKind, dims: [usize; 2]) -> Self {
        Self {
            conv: Linear::without_bias(init, "stem.conv", dims),
            norm: Norm::new(init, norm, dims[1]),
        }
    }

    pub(crate) fn forward(
        &self,
        features: Tensor<2>,
        around: &Neighbors,
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        let rows = ops::convolution(features, around, self.conv.weight(), self.conv.bias());
        ops::gelu(self.norm.forward(rows, mode))
    }
}

impl EncoderStage {
    /// The stages from the finest up.
    pub(crate) fn all(init: &Initializer, stages: &Stages, config: &Ptv3Config) -> Vec<Self> {
        let (widths, depths) = (&stages.encoder_widths, &stages.encoder_depths);
        let mut rates = ramp(config.drop_path, depths.iter().sum()).into_iter();
        (0..widths.len())
            .map(|stage| {
                let name = format!("encoder.{stage}");
                let pool = stage.checked_sub(1).map(|below| {
                    Projection::new(
                        init,
                        &format!("{name}.pool"),
                        config.norm,
                        [widths[below], widths[stage]],
                    )
                });
                let rates = rates.by_ref().take(depths[stage]).collect();
                Self {
                    pool,
                    blocks: blocks(init, &name, config, widths[stage], rates),
                }
            })
            .collect()
    }

    /// Merges the rows of the level below into those of this one.
    pub(crate) fn pool(
        &self,
        rows: Tensor<2>,
        below: &LevelRows,
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        match (&self.pool, &below.pooling) {
            (Some(projection), Some(pooling)) => {
                projection.forward_pooled(rows, &pooling.members, mode)
            }
            _ => rows,
        }
    }
}

impl DecoderStage {
    /// The stages from the coarsest down.
    pub(crate) fn all(init: &Initializer, stages: &Stages, config: &Ptv3Config) -> Vec<Self> {
        // The deepest block leaves out most, as at the end of the encoder.
        let mut rates = ramp(config.drop_path, stages.decoder_depths.iter().sum())
            .into_iter()
            .rev();
        let mut above = stages.encoder_widths.last().copied().unwrap_or(0);
        (0..stages.decoder_widths.len())
            .rev()
            .map(|stage| {
                let name = format!("decoder.{stage}");
                let width = stages.decoder_widths[stage];
                let projection = |part: &str, from| {
                    Projection::new(init, &format!("{name}.{part}"), config.norm, [from, width])
                };
                let (child, skip) = (
                    projection("child", above),
                    projection("skip", stages.encoder_widths[stage]),
                );
                above = width;
                let rates = rates.by_ref().take(stages.decoder_depths[stage]).collect();
                Self {
                    child,
                    skip,
                    blocks: blocks(init, &name, config, width, rates),
                    xcpe_of_skip: config.xcpe_of_skip,
                }
            })
            .collect()
    }

    /// Adds the rows of the level above, each to all tokens of its cluster, to those that the encoder left on this level,
    /// and takes them through the blocks.
    pub(crate) fn forward(
        &self,
        rows: Tensor<2>,
        skip: Tensor<2>,
        level: &LevelRows,
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        let from_child = self.child.forward(rows, mode);
        let skip = self.skip.forward(skip, mode);
        let rows = match &level.pooling {
            Some(pooling) => ops::gather(from_child, &pooling.cluster) + skip.clone(),
            None => skip.clone(),
        };
        let Some((first, others)) = self.blocks.split_first() else {
            return rows;
        };
        let seen = if self.xcpe_of_skip {
            skip
        } else {
            rows.clone()
        };
        let rows = first.forward_seeing(rows, seen, level, mode);
        others
            .iter()
            .fold(rows, |rows, block| block.forward(rows, level, mode))
    }
}

/// Evenly spaced from 0 to `highest`; a single value is 0.
fn ramp(highest: f64, n: usize) -> Vec<f64> {
    (0..n)
        .map(|idx| highest * idx as f64 / n.saturating_sub(1).max(1) as f64)
        .collect()
}

fn blocks(
    init: &Initializer,
    stage: &str,
    config: &Ptv3Config,
    width: usize,
    rates: Vec<f64>,
) -> Vec<Block> {
    let settings = |(index, drop_path)| BlockSettings {
        width,
        index,
        drop_path,
    };
    let block = |settings: BlockSettings| {
        Block::new(
            init,
            &format!("{stage}.blocks.{}", settings.index),
            config,
            settings,
        )
    };
    rates
        .into_iter()
        .enumerate()
        .map(settings)
        .map(block)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_dropped_more_the_deeper_they_lie() {
        assert_eq!(
            ramp(0.3, 4)
                .iter()
                .map(|rate| (rate * 1e6).round() / 1e6)
                .collect::<Vec<_>>(),
            [0.0, 0.1, 0.2, 0.3]
        );
        assert_eq!(ramp(0.3, 1), [0.0]);
        assert!(ramp(0.3, 0).is_empty());
    }
}
