//! Defines the layers of the backbones, with their initial values. `kernels::ops` computes them.

use crate::data::rows::Rows;
use crate::kernels::ops;
use crate::model::batch_norm::BatchNorm;
use crate::model::forward_mode::ForwardMode;
use crate::model::parameters::Initializer;
use burn::module::{Module, Param};
use burn::tensor::Tensor;
use serde::{Deserialize, Serialize};

/// An affine map of rows.
#[derive(Module, Debug)]
pub(crate) struct Linear {
    /// `[in, out]`: a row of `x` times this.
    weight: Param<Tensor<2>>,
    bias: Option<Param<Tensor<1>>>,
}

impl Linear {
    pub(crate) fn new(init: &Initializer, name: &str, [dim_in, dim_out]: [usize; 2]) -> Self {
        let bias = init.uniform(&format!("{name}.bias"), [dim_out], dim_in);
        Self {
            bias: Some(bias),
            ..Self::without_bias(init, name, [dim_in, dim_out])
        }
    }

    pub(crate) fn without_bias(
        init: &Initializer,
        name: &str,
        [dim_in, dim_out]: [usize; 2],
    ) -> Self {
        Self {
            weight: init.uniform(&format!("{name}.weight"), [dim_in, dim_out], dim_in),
            bias: None,
        }
    }

    /// # Shapes
    /// - rows: `[token, in]`
    /// - output: `[token, out]`
    pub(crate) fn forward(&self, rows: Tensor<2>) -> Tensor<2> {
        ops::linear(rows, self.weight(), self.bias())
    }

    pub(crate) fn weight(&self) -> Tensor<2> {
        self.weight.val()
    }

    pub(crate) fn bias(&self) -> Option<Tensor<1>> {
        self.bias.as_ref().map(Param::val)
    }
}

/// Normalization of each row to mean 0 and variance 1, then a learned scale and shift of each channel.
#[derive(Module, Debug)]
pub(crate) struct LayerNorm {
    weight: Param<Tensor<1>>,
    bias: Param<Tensor<1>>,
}

impl LayerNorm {
    pub(crate) fn new(init: &Initializer, dim: usize) -> Self {
        Self {
            weight: init.constant(dim, 1.0),
            bias: init.constant(dim, 0.0),
        }
    }

    /// Scale and shift.
    pub(crate) fn values(&self) -> [Tensor<1>; 2] {
        [self.weight.val(), self.bias.val()]
    }

    pub(crate) fn forward(&self, rows: Tensor<2>) -> Tensor<2> {
        ops::layer_norm(rows, self.weight.val(), self.bias.val())
    }
}

/// The norm in the positions where PTv3 has BatchNorm: in the stem, in pooling and in unpooling.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormKind {
    /// LayerNorm: each token is normalized independently, so no shape depends on the others of its batch.
    Layer,
    /// BatchNorm as in PTv3: in training over all tokens of the batch, at test time with running statistics.
    Batch,
}

/// The norm that a config chooses for stem, pooling and unpooling.
#[derive(Module, Debug)]
pub(crate) enum Norm {
    /// Each token is normalized independently.
    Layer(LayerNorm),
    /// Each channel is normalized over the batch.
    Batch(BatchNorm),
}

impl Norm {
    pub(crate) fn new(init: &Initializer, kind: NormKind, dim: usize) -> Self {
        match kind {
            NormKind::Layer => Self::Layer(LayerNorm::new(init, dim)),
            NormKind::Batch => Self::Batch(BatchNorm::new(init, dim)),
        }
    }

    pub(crate) fn forward(&self, rows: Tensor<2>, mode: &mut ForwardMode) -> Tensor<2> {
        match self {
            Self::Layer(norm) => norm.forward(rows),
            Self::Batch(norm) => norm.forward(rows, mode),
        }
    }
}

/// A linear map, its norm and GELU, as between the stages of PTv3.
#[derive(Module, Debug)]
pub(crate) struct Projection {
    linear: Linear,
    norm: Norm,
}

impl Projection {
    pub(crate) fn new(init: &Initializer, name: &str, kind: NormKind, dims: [usize; 2]) -> Self {
        Self {
            linear: Linear::new(init, &format!("{name}.linear"), dims),
            norm: Norm::new(init, kind, dims[1]),
        }
    }

    pub(crate) fn forward(&self, rows: Tensor<2>, mode: &mut ForwardMode) -> Tensor<2> {
        ops::gelu(self.norm.forward(self.linear.forward(rows), mode))
    }

    /// The same with a maximum over clusters between the linear map and the norm.
    pub(crate) fn forward_pooled(
        &self,
        rows: Tensor<2>,
        members: &Rows,
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        ops::gelu(
            self.norm
                .forward(ops::cluster_max(self.linear.forward(rows), members), mode),
        )
    }
}
