//! Joins a backbone and its embedding head: `Tokens → embeddings that are not normalized`.

use crate::model::backbones::{AnyBackbone, ShapeInput};
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::Linear;
use crate::model::net_config::NetConfig;
use crate::model::parameters::Initializer;
use burn::module::Module;
use burn::tensor::{Device, Tensor};

/// A backbone and the linear map to embeddings.
#[derive(Module, Debug)]
pub(crate) struct Network {
    backbone: AnyBackbone,
    head: Linear,
}

impl Network {
    pub(crate) fn new(config: &NetConfig, init: &Initializer) -> Self {
        let width = config.backbone.stages().output_width();
        Self {
            backbone: AnyBackbone::new(init, &config.backbone),
            head: Linear::new(init, "head", [width, config.embedding_dim]),
        }
    }

    /// The number of parameters of the head.
    pub(crate) fn n_head_parameters(&self) -> usize {
        self.head.num_params()
    }

    /// Passes the shapes through the network together. The result of a shape depends on the other shapes only if there are batch
    /// norms.
    ///
    /// # Shapes
    /// - output: `[token, embedding_dim]`, the tokens of the first shape first, not normalized
    pub(crate) fn forward(
        &self,
        shapes: &[&ShapeInput],
        device: &Device,
        mode: &mut ForwardMode,
    ) -> Tensor<2> {
        self.head
            .forward(self.backbone.forward(shapes, device, mode))
    }
}
