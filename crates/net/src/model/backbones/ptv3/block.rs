//! Computes a block of PTv3: xCPE, patch attention and perceptron. The output of each is added to its input. On request, the
//! tokens of one cell exchange features between xCPE and attention.

use super::config::Ptv3Config;
use crate::data::hierarchy::XCPE_VOLUME;
use crate::data::level_rows::{ClusterRows, LevelRows, ShapePatches};
use crate::kernels::fused::MlpWeights;
use crate::kernels::ops;
use crate::model::backbones::u_net::{BlockSettings, StageBlock};
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::{LayerNorm, Linear};
use crate::model::parameters::Initializer;
use burn::module::Module;
use burn::tensor::Tensor;

/// Channels of an attention head.
const HEAD_DIM: usize = 16;
/// Width of the hidden layer of a block's perceptron, as a multiple of the width of the block.
const MLP_RATIO: usize = 4;

/// A block. Attention and perceptron are branches. Training may leave them out for single tokens.
#[derive(Module, Debug)]
pub(crate) struct Block {
    xcpe: Option<Xcpe>,
    exchange: Option<CellExchange>,
    attention: Option<Attention>,
    mlp: Mlp,
    /// Probability of leaving out a branch.
    #[module(skip)]
    drop_path: f64,
    /// Whether xCPE sees only the skip after an unpooling.
    #[module(skip)]
    xcpe_of_skip: bool,
}

impl Block {
    /// A block with the layers that the config has not switched off.
    pub(crate) fn new(
        init: &Initializer,
        name: &str,
        config: &Ptv3Config,
        settings: BlockSettings,
    ) -> Self {
        let BlockSettings {
            width,
            index,
            drop_path,
            ..
        } = settings;
        Self {
            xcpe: config
                .xcpe
                .then(|| Xcpe::new(init, &format!("{name}.xcpe"), width)),
            exchange: config
                .cell_exchange
                .then(|| CellExchange::new(init, &format!("{name}.exchange"), width)),
            attention: config
                .attention
                .then(|| Attention::new(init, &format!("{name}.attention"), width, index)),
            mlp: Mlp::new(init, &format!("{name}.mlp"), width),
            drop_path,
            xcpe_of_skip: config.xcpe_of_skip,
        }
    }
}

impl StageBlock for Block {
    fn forward(&self, rows: Tensor<2>, level: &LevelRows, mode: &mut ForwardMode) -> Tensor<2> {
        let seen = rows.clone();
        self.forward_seeing(rows, seen, level, mode)
    }

    fn forward_after_skip(
        &self,
        rows: Tensor<2>,
        skip: Tensor<2>,
        level: &LevelRows,
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        let seen = if self.xcpe_of_skip {
            skip
        } else {
            rows.clone()
        };
        self.forward_seeing(rows, seen, level, mode)
    }
}

impl Block {
    /// The output of the block if its xCPE sees the rows `seen`.
    ///
    /// # Shapes
    /// - rows, seen and output: `[token, width]`
    fn forward_seeing(
        &self,
        mut rows: Tensor<2>,
        seen: Tensor<2>,
        level: &LevelRows,
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        if let Some(xcpe) = &self.xcpe {
            rows = rows + xcpe.forward(seen, level);
        }
        if let (Some(exchange), Some(cells)) = (&self.exchange, &level.by_cell) {
            rows = rows.clone() + exchange.forward(rows, cells);
        }
        if let Some(attention) = &self.attention {
            rows = rows.clone() + mode.drop_path(attention.forward(rows, level), self.drop_path);
        }
        rows.clone() + mode.drop_path(self.mlp.forward(rows), self.drop_path)
    }
}

/// A 3³ submanifold convolution, a linear map and a norm. They give tokens information about their position.
#[derive(Module, Debug)]
pub(crate) struct Xcpe {
    conv: Linear,
    out: Linear,
    norm: LayerNorm,
}

impl Xcpe {
    pub(crate) fn new(init: &Initializer, name: &str, width: usize) -> Self {
        Self {
            conv: Linear::new(init, &format!("{name}.conv"), [XCPE_VOLUME * width, width]),
            out: Linear::new(init, &format!("{name}.out"), [width, width]),
            norm: LayerNorm::new(init, width),
        }
    }

    pub(crate) fn forward(&self, rows: Tensor<2>, level: &LevelRows) -> Tensor<2> {
        let mixed = ops::convolution(rows, &level.neighbors, self.conv.weight(), self.conv.bias());
        self.norm.forward(self.out.forward(mixed))
    }
}

/// The maximum over the tokens of each cell, a linear map and a norm.
///
/// Tokens are keyed by the dominant axis of their normals, so a cylinder has tokens of four axes. If a cell has tokens of two
/// axes, this layer connects them directly.
#[derive(Module, Debug)]
pub(crate) struct CellExchange {
    out: Linear,
    norm: LayerNorm,
}

impl CellExchange {
    pub(crate) fn new(init: &Initializer, name: &str, width: usize) -> Self {
        Self {
            out: Linear::new(init, &format!("{name}.out"), [width, width]),
            norm: LayerNorm::new(init, width),
        }
    }

    pub(crate) fn forward(&self, rows: Tensor<2>, cells: &ClusterRows) -> Tensor<2> {
        let by_cell = ops::cluster_max(rows, &cells.members);
        let mixed = self.norm.forward(self.out.forward(by_cell));
        ops::gather(mixed, &cells.cluster)
    }
}

/// A norm, followed by attention among the tokens of a patch.
#[derive(Module, Debug)]
pub(crate) struct Attention {
    norm: LayerNorm,
    qkv: Linear,
    out: Linear,
    /// The index of the curve that the patches follow, modulo the number of curves of the level.
    #[module(skip)]
    index: usize,
    #[module(skip)]
    n_heads: usize,
}

impl Attention {
    pub(crate) fn new(init: &Initializer, name: &str, width: usize, index: usize) -> Self {
        Self {
            norm: LayerNorm::new(init, width),
            qkv: Linear::new(init, &format!("{name}.qkv"), [width, 3 * width]),
            out: Linear::new(init, &format!("{name}.out"), [width, width]),
            index,
            n_heads: (width / HEAD_DIM).max(1),
        }
    }

    pub(crate) fn forward(&self, rows: Tensor<2>, level: &LevelRows) -> Tensor<2> {
        let qkv = self.qkv.forward(self.norm.forward(rows));
        self.out
            .forward(mixed_by_patch(qkv, level, self.index, self.n_heads))
    }
}

/// Attention within the patches of each shape, along the curve of the block with this index.
///
/// # Shapes
/// - qkv: `[token, 3 × head × channel]`
/// - output: `[token, head × channel]`
pub(crate) fn mixed_by_patch(
    qkv: Tensor<2>,
    level: &LevelRows,
    index: usize,
    n_heads: usize,
) -> Tensor<2> {
    let mix = |qkv: Tensor<2>, shape: &ShapePatches| {
        // `Serialization::check` has ensured that there is at least one curve.
        let patches = &shape.by_curve[index % shape.by_curve.len()];
        ops::patch_attention(qkv, patches, n_heads)
    };
    if let [shape] = level.shapes.as_slice() {
        return mix(qkv, shape);
    }
    let mut first = 0;
    let each = level.shapes.iter().map(|shape| {
        let own = qkv.clone().slice_dim(0, first..first + shape.n);
        first += shape.n;
        mix(own, shape)
    });
    Tensor::cat(each.collect(), 0)
}

/// A norm, followed by a perceptron with one hidden layer.
#[derive(Module, Debug)]
pub(crate) struct Mlp {
    norm: LayerNorm,
    hidden: Linear,
    out: Linear,
}

impl Mlp {
    pub(crate) fn new(init: &Initializer, name: &str, width: usize) -> Self {
        Self {
            norm: LayerNorm::new(init, width),
            hidden: Linear::new(init, &format!("{name}.hidden"), [width, MLP_RATIO * width]),
            out: Linear::new(init, &format!("{name}.out"), [MLP_RATIO * width, width]),
        }
    }

    pub(crate) fn forward(&self, rows: Tensor<2>) -> Tensor<2> {
        let weights = MlpWeights {
            norm: self.norm.values(),
            hidden: (self.hidden.weight(), self.hidden.bias()),
            out: (self.out.weight(), self.out.bias()),
        };
        ops::mlp(rows, weights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Voxels;
    use crate::data::curve::Curve;
    use crate::data::hierarchy::{Hierarchy, fixed_orders};
    use crate::data::level_rows::levels_of;
    use crate::data::tokens::tokenize;
    use crate::model::parameters::host_values;
    use crate::testing::labeled_box;
    use burn::tensor::{Device, TensorData};

    #[test]
    fn a_token_exchanges_only_with_tokens_of_its_cell() {
        let tokens = tokenize(&labeled_box(2.0, 600).sample, 60, Voxels::NormalKeyed).unwrap();
        let hierarchy = Hierarchy::with_cells(&tokens, 16, &fixed_orders(1, &Curve::ALL));
        let levels = levels_of(&[&hierarchy]);
        let (n, width, device) = (tokens.n(), 8, Device::flex());
        let exchange = CellExchange::new(&Initializer::seeded(1, &device), "exchange", width);
        let exchanged = |loud: Option<usize>| {
            let mut rows = vec![0.5; n * width];
            if let Some(token) = loud {
                rows[token * width..(token + 1) * width].fill(3.0);
                rows[token * width] = 5.0;
            }
            let rows = Tensor::from_data(TensorData::new(rows, [n, width]), &device);
            host_values(exchange.forward(rows, levels[0].by_cell.as_ref().unwrap()))
        };

        let silent = exchanged(None);
        for loud in 0..n {
            let heard = exchanged(Some(loud));
            for token in 0..n {
                let changes = heard[token * width..][..width] != silent[token * width..][..width];
                assert_eq!(changes, tokens.cells[token] == tokens.cells[loud]);
            }
        }
    }
}
