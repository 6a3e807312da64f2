//! Computes the stages that all hierarchical backbones share: pooling and blocks in the encoder, and unpooling with a skip and
//! blocks in the decoder. The backbone defines the blocks.

use super::stages::Stages;
use crate::data::level_rows::LevelRows;
use crate::kernels::ops;
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::{NormKind, Projection};
use crate::model::parameters::Initializer;
use burn::module::Module;
use burn::tensor::Tensor;

/// One block of a stage.
pub(crate) trait StageBlock: Module {
    /// # Shapes
    /// - rows and output: `[token, width]`
    fn forward(&self, rows: Tensor<2>, level: &LevelRows, mode: &mut ForwardMode) -> Tensor<2>;

    /// The same for the first block after an unpooling, which may also use the skip alone. `rows` is the sum of the skip and the
    /// level above.
    ///
    /// # Shapes
    /// - rows, skip and output: `[token, width]`
    fn forward_after_skip(
        &self,
        rows: Tensor<2>,
        _skip: Tensor<2>,
        level: &LevelRows,
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        self.forward(rows, level, mode)
    }
}

/// The settings in which the blocks of a network differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BlockSettings {
    /// The stage, counted from the finest one.
    pub(crate) stage: usize,
    /// Channels.
    pub(crate) width: usize,
    /// The index of the block in its stage.
    pub(crate) index: usize,
    /// Probability of leaving out a branch.
    pub(crate) drop_path: f64,
}

/// Depths and widths, the norm between stages, and the highest probability of leaving out a branch of a block.
#[derive(Clone, Copy)]
pub(crate) struct UNetSettings<'a> {
    pub(crate) stages: &'a Stages,
    pub(crate) norm: NormKind,
    pub(crate) drop_path: f64,
}

/// Pooling and blocks. The finest level has no pooling.
#[derive(Module, Debug)]
pub(crate) struct EncoderStage<B: StageBlock> {
    pool: Option<Projection>,
    blocks: Vec<B>,
}

/// Unpooling with a skip, and blocks.
#[derive(Module, Debug)]
pub(crate) struct DecoderStage<B: StageBlock> {
    child: Projection,
    skip: Projection,
    blocks: Vec<B>,
}

impl<B: StageBlock> EncoderStage<B> {
    /// The stages from the finest to the coarsest. `block` makes a block with a name and settings.
    pub(crate) fn all(
        init: &Initializer,
        settings: UNetSettings<'_>,
        block: impl Fn(&str, BlockSettings) -> B,
    ) -> Vec<Self> {
        let (widths, depths) = (
            &settings.stages.encoder_widths,
            &settings.stages.encoder_depths,
        );
        let mut rates = ramp(settings.drop_path, depths.iter().sum()).into_iter();
        (0..widths.len())
            .map(|stage| {
                let name = format!("encoder.{stage}");
                let pool = stage.checked_sub(1).map(|below| {
                    Projection::new(
                        init,
                        &format!("{name}.pool"),
                        settings.norm,
                        [widths[below], widths[stage]],
                    )
                });
                let rates = rates.by_ref().take(depths[stage]).collect();
                Self {
                    pool,
                    blocks: blocks(&name, [stage, widths[stage]], rates, &block),
                }
            })
            .collect()
    }

    /// Merges the rows of the level below into those of this level.
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

impl<B: StageBlock> DecoderStage<B> {
    /// The stages from the coarsest to the finest. `block` makes a block with a name and settings.
    pub(crate) fn all(
        init: &Initializer,
        settings: UNetSettings<'_>,
        block: impl Fn(&str, BlockSettings) -> B,
    ) -> Vec<Self> {
        let stages = settings.stages;
        // The deepest block has the highest probability, as at the end of the encoder.
        let mut rates = ramp(settings.drop_path, stages.decoder_depths.iter().sum())
            .into_iter()
            .rev();
        let mut above = stages.encoder_widths.last().copied().unwrap_or(0);
        (0..stages.decoder_widths.len())
            .rev()
            .map(|stage| {
                let name = format!("decoder.{stage}");
                let width = stages.decoder_widths[stage];
                let projection = |part: &str, from| {
                    Projection::new(
                        init,
                        &format!("{name}.{part}"),
                        settings.norm,
                        [from, width],
                    )
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
                    blocks: blocks(&name, [stage, width], rates, &block),
                }
            })
            .collect()
    }

    /// Adds the rows of the level above, each for all tokens of its cluster, to the rows of the encoder on this level. Then the
    /// sum passes through the blocks.
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
        let rows = first.forward_after_skip(rows, skip, level, mode);
        through(others, rows, level, mode)
    }
}

/// Up through the encoder and down through the decoder, with a skip on each level.
///
/// # Shapes
/// - rows: the output of the stem, `[token, width]`
/// - levels: as many as there are stages of the encoder
/// - output: `[token, output_width]`
pub(crate) fn forward<B: StageBlock>(
    encoder: &[EncoderStage<B>],
    decoder: &[DecoderStage<B>],
    mut rows: Tensor<2>,
    levels: &[LevelRows],
    mode: &mut ForwardMode,
) -> Tensor<2> {
    let mut skips = Vec::with_capacity(levels.len());
    for (idx, (stage, level)) in encoder.iter().zip(levels).enumerate() {
        if let Some(below) = idx.checked_sub(1) {
            rows = stage.pool(rows, &levels[below], mode);
        }
        rows = through(&stage.blocks, rows, level, mode);
        skips.push(rows.clone());
    }
    skips.pop();
    for (stage, level) in decoder.iter().zip(levels[..skips.len()].iter().rev()) {
        let Some(skip) = skips.pop() else { break };
        rows = stage.forward(rows, skip, level, mode);
    }
    rows
}

fn through<B: StageBlock>(
    blocks: &[B],
    rows: Tensor<2>,
    level: &LevelRows,
    mode: &mut ForwardMode,
) -> Tensor<2> {
    blocks
        .iter()
        .fold(rows, |rows, block| block.forward(rows, level, mode))
}

/// `n` evenly spaced numbers from 0 to `highest`. A single number is 0.
fn ramp(highest: f64, n: usize) -> Vec<f64> {
    (0..n)
        .map(|idx| highest * idx as f64 / n.saturating_sub(1).max(1) as f64)
        .collect()
}

fn blocks<B>(
    name: &str,
    [stage, width]: [usize; 2],
    rates: Vec<f64>,
    block: &impl Fn(&str, BlockSettings) -> B,
) -> Vec<B> {
    let block = |(index, drop_path)| {
        let settings = BlockSettings {
            stage,
            width,
            index,
            drop_path,
        };
        block(&format!("{name}.blocks.{index}"), settings)
    };
    rates.into_iter().enumerate().map(block).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deeper_paths_are_dropped_more_often() {
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
