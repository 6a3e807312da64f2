//! Computes attention among the tokens of a patch. Queries and keys are rotated, so attention depends on the positions of the
//! tokens.

use super::ptv3::block::mixed_by_patch;
use crate::data::level_rows::LevelRows;
use crate::kernels::ops;
use crate::kernels::rotary_axes::RotaryAxes;
use crate::model::layers::{LayerNorm, Linear};
use crate::model::parameters::Initializer;
use burn::module::{Module, Param};
use burn::tensor::{Tensor, TensorData};

/// The approximate ratio of the highest to the lowest frequency, as in LitePT.
const BASE: f32 = 100.0;

/// A norm, followed by attention with rotary positions.
#[derive(Module, Debug)]
pub(crate) struct RotaryAttention {
    norm: LayerNorm,
    qkv: Linear,
    out: Linear,
    /// The axes of each head if they are learned. Otherwise the axes of the grid are used.
    axes: Option<HeadAxes>,
    /// The index of the curve that the patches follow, modulo the number of curves of the level.
    #[module(skip)]
    index: usize,
    #[module(skip)]
    n_heads: usize,
    #[module(skip)]
    head_dim: usize,
}

/// The axes of the rotary encoding of a head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axes {
    /// The axes of the grid.
    Grid,
    /// Three perpendicular directions per head, which training changes.
    Learned,
}

impl RotaryAttention {
    /// `index` is that of the block in its stage. `width` must be a multiple of `head_dim`.
    pub(crate) fn new(
        init: &Initializer,
        name: &str,
        [width, head_dim]: [usize; 2],
        index: usize,
        axes: Axes,
    ) -> Self {
        let n_heads = (width / head_dim).max(1);
        Self {
            norm: LayerNorm::new(init, width),
            qkv: Linear::new(init, &format!("{name}.qkv"), [width, 3 * width]),
            out: Linear::new(init, &format!("{name}.out"), [width, width]),
            axes: (axes == Axes::Learned)
                .then(|| HeadAxes::new(init, &format!("{name}.axes"), n_heads)),
            index,
            n_heads,
            head_dim: width / n_heads,
        }
    }

    /// # Shapes
    /// - rows and output: `[token, width]`
    pub(crate) fn forward(&self, rows: Tensor<2>, level: &LevelRows) -> Tensor<2> {
        let device = rows.device();
        let n = level.cells.len() / 3;
        let cells: Tensor<2> =
            Tensor::from_data(TensorData::new(level.cells.clone(), [n, 3]), &device);
        let coordinates = match &self.axes {
            Some(axes) => axes.coordinates(cells),
            None => Tensor::cat(vec![cells; self.n_heads], 1),
        };
        let axes = RotaryAxes {
            n_heads: self.n_heads,
            head_dim: self.head_dim,
            base: BASE,
        };
        let qkv = self.qkv.forward(self.norm.forward(rows));
        let turned = ops::rotary(qkv, coordinates, axes);
        self.out
            .forward(mixed_by_patch(turned, level, self.index, self.n_heads))
    }
}

/// Three perpendicular directions per head, made of two vectors by the Gram–Schmidt method: the axes of `PointTransformerX`
/// (Reichardt, Ebert and Wasenmüller, arXiv 2604.24169).
#[derive(Module, Debug)]
pub(crate) struct HeadAxes {
    /// `[head, 3]`: the first axis has this direction.
    along: Param<Tensor<2>>,
    /// `[head, 3]`: the second axis is in the plane of this vector and the first axis.
    beside: Param<Tensor<2>>,
}

impl HeadAxes {
    fn new(init: &Initializer, name: &str, n_heads: usize) -> Self {
        Self {
            along: init.uniform(&format!("{name}.along"), [n_heads, 3], 1),
            beside: init.uniform(&format!("{name}.beside"), [n_heads, 3], 1),
        }
    }

    /// The position of each token along the axes of each head. Head h begins with its axis h modulo 3, so no axis always gets the
    /// most channels.
    ///
    /// # Shapes
    /// - cells: `[token, 3]`
    /// - output: `[token, head × 3]`
    fn coordinates(&self, cells: Tensor<2>) -> Tensor<2> {
        let first = unit(self.along.val());
        let beside = self.beside.val();
        let overlap = (beside.clone() * first.clone()).sum_dim(1);
        let second = unit(beside - first.clone() * overlap);
        let third = cross(first.clone(), second.clone());

        let axes = [first, second, third];
        let n_heads = axes[0].dims()[0];
        let rows = (0..n_heads).flat_map(|head| {
            let axes = &axes;
            (0..3).map(move |idx| axes[(head + idx) % 3].clone().slice_dim(0, head..head + 1))
        });
        cells.matmul(Tensor::cat(rows.collect(), 0).transpose())
    }
}

/// Rows of length 1.
fn unit(rows: Tensor<2>) -> Tensor<2> {
    let length = (rows.clone() * rows.clone()).sum_dim(1).sqrt();
    rows / (length + 1e-6)
}

/// The cross product of the rows of two `[n, 3]`.
fn cross(a: Tensor<2>, b: Tensor<2>) -> Tensor<2> {
    let column = |rows: &Tensor<2>, idx: usize| rows.clone().slice_dim(1, idx..idx + 1);
    let component =
        |i: usize, j: usize| column(&a, i) * column(&b, j) - column(&a, j) * column(&b, i);
    Tensor::cat(vec![component(1, 2), component(2, 0), component(0, 1)], 1)
}
