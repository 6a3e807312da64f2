//! Computes the first layer of a backbone with convolutions. It gives each token information about the cells around it.

use crate::data::neighbor_table::neighbor_table;
use crate::data::neighbors::Neighbors;
use crate::data::tokens::Tokens;
use crate::kernels::ops;
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::{Linear, Norm, NormKind};
use crate::model::parameters::Initializer;
use burn::module::Module;
use burn::tensor::Tensor;

/// Number of cells in the neighborhood of the stem.
pub(crate) const STEM_VOLUME: usize = 125;

/// A 5³ submanifold convolution of the input features, its norm and GELU.
#[derive(Module, Debug)]
pub(crate) struct Stem {
    conv: Linear,
    norm: Norm,
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

/// The 5³ cells around each token.
pub(crate) fn stem_neighbors(tokens: &Tokens) -> Neighbors {
    Neighbors::new(&neighbor_table(&tokens.cells, &tokens.axes, 2), STEM_VOLUME)
}
