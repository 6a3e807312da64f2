//! The baseline without neighborhoods (after PointNet, Qi et al., CVPR 2017): a shared perceptron and one maximum.
//!
//! Feature rows in, one row a token out; a token knows of the others only through the maximum over all of them.

use crate::config::NormKind;
use crate::layers::Projection;
use crate::parameters::Initializer;
use crate::pass::Pass;
use burn::module::Module;
use burn::tensor::Tensor;

/// The network below the embedding head.
#[derive(Module, Debug)]
pub(crate) struct Pointnet {
    local: Vec<Projection>,
    merge: Projection,
}

impl Pointnet {
    /// A perceptron with these layers whose input has `n_features` channels.
    pub(crate) fn new(init: &Initializer, n_features: usize, widths: &[usize]) -> Self {
        let mut below = n_features;
        let local = widths
            .iter()
            .enumerate()
            .map(|(idx, &width)| {
                let layer = Projection::new(
                    init,
                    &format!("local.{idx}"),
                    NormKind::Layer,
                    [below, width],
                );
                below = width;
                layer
            })
            .collect();
        Self {
            local,
            merge: Projection::new(init, "merge", NormKind::Layer, [2 * below, below]),
        }
    }

    /// # Shapes
    /// - features: `[token, feature]`
    /// - output: `[token, last width]`
    pub(crate) fn forward(&self, features: Tensor<2>, pass: &mut Pass) -> Tensor<2> {
        let local = self
            .local
            .iter()
            .fold(features, |rows, layer| layer.forward(rows, pass));
        let whole = local.clone().max_dim(0).expand(local.dims());
        self.merge.forward(Tensor::cat(vec![local, whole], 1), pass)
    }
}
