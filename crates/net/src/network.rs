//! A backbone with its embedding head, whatever the backbone is: `Tokens → un-normalized embeddings`.
//!
//! `prepare` does all that needs no tensors, so that it can run ahead of the network.

use crate::config::{BackboneConfig, NetConfig, Ptv3Config};
use crate::hierarchy::{self, CurveTurns, Hierarchy};
use crate::layers::Linear;
use crate::level_rows::levels_of;
use crate::neighbors::neighbor_table;
use crate::ops::Neighbors;
use crate::parameters::Initializer;
use crate::pass::Pass;
use crate::pointnet::Pointnet;
use crate::presets::Stages;
use crate::ptv3::{Ptv3, STEM_VOLUME};
use crate::tokens::Tokens;
use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use partprobe_carrier::Rng;

/// Input channels of a token: position and normal.
pub(crate) const N_FEATURES: usize = 6;

/// A backbone and the linear map to embeddings.
#[derive(Module, Debug)]
pub(crate) struct Network {
    backbone: Backbone,
    head: Linear,
}

#[derive(Module, Debug)]
enum Backbone {
    Ptv3(Ptv3),
    Pointnet(Pointnet),
}

/// One shape as numbers, ready for a device.
pub(crate) enum ShapeInput {
    /// Features, the 5³ neighborhood of each token, and the levels above.
    Ptv3 {
        /// `[token, feature]`.
        features: Vec<f32>,
        /// The cells that the stem sees.
        around: Neighbors,
        /// The levels.
        hierarchy: Hierarchy,
    },
    /// `[token, feature]`.
    Pointnet {
        /// The features.
        features: Vec<f32>,
    },
}

impl Network {
    pub(crate) fn new(config: &NetConfig, init: &Initializer) -> Self {
        let (backbone, width) = match &config.backbone {
            BackboneConfig::Ptv3(ptv3) => {
                let stages = Stages::of(ptv3.preset);
                (
                    Backbone::Ptv3(Ptv3::new(init, N_FEATURES, &stages, ptv3)),
                    stages.output_width(),
                )
            }
            BackboneConfig::Pointnet { widths } => {
                let width = widths.last().copied().unwrap_or(N_FEATURES);
                (
                    Backbone::Pointnet(Pointnet::new(init, N_FEATURES, widths)),
                    width,
                )
            }
        };
        Self {
            backbone,
            head: Linear::new(init, "head", [width, config.embedding_dim]),
        }
    }

    /// Parameters of the head alone.
    pub(crate) fn n_head_parameters(&self) -> usize {
        self.head.num_params()
    }

    /// The shapes go through together: that matters to batch norms and to nothing else.
    ///
    /// # Shapes
    /// - output: `[token, embedding_dim]`, the shapes one behind the other, not normalized
    pub(crate) fn forward(
        &self,
        shapes: &[&ShapeInput],
        device: &Device,
        pass: &mut Pass,
    ) -> Tensor<2> {
        let rows = match &self.backbone {
            Backbone::Ptv3(ptv3) => {
                let inputs: Vec<_> = shapes.iter().filter_map(|shape| shape.as_ptv3()).collect();
                let features = inputs.iter().flat_map(|input| input.0).copied().collect();
                let around =
                    Neighbors::joined(&inputs.iter().map(|input| input.1).collect::<Vec<_>>());
                let hierarchies: Vec<&Hierarchy> = inputs.iter().map(|input| input.2).collect();
                let n = hierarchies
                    .iter()
                    .map(|hierarchy| hierarchy.levels[0].n)
                    .sum();
                ptv3.forward(
                    matrix(features, n, device),
                    &around,
                    &levels_of(&hierarchies),
                    pass,
                )
            }
            Backbone::Pointnet(pointnet) => {
                let each = shapes
                    .iter()
                    .filter_map(|shape| shape.as_pointnet())
                    .map(|features| {
                        pointnet.forward(
                            matrix(features.to_vec(), features.len() / N_FEATURES, device),
                            pass,
                        )
                    });
                Tensor::cat(each.collect(), 0)
            }
        };
        self.head.forward(rows)
    }
}

impl ShapeInput {
    fn as_ptv3(&self) -> Option<(&[f32], &Neighbors, &Hierarchy)> {
        match self {
            Self::Ptv3 {
                features,
                around,
                hierarchy,
            } => Some((features, around, hierarchy)),
            Self::Pointnet { .. } => None,
        }
    }

    fn as_pointnet(&self) -> Option<&[f32]> {
        match self {
            Self::Ptv3 { .. } => None,
            Self::Pointnet { features } => Some(features),
        }
    }
}

pub(crate) fn matrix(values: Vec<f32>, n_rows: usize, device: &Device) -> Tensor<2> {
    let dim = values.len() / n_rows.max(1);
    Tensor::from_data(TensorData::new(values, [n_rows, dim]), device)
}

/// The turn of the curves at test time, for the network of this config.
pub(crate) fn test_turns(config: &NetConfig) -> CurveTurns {
    match &config.backbone {
        BackboneConfig::Ptv3(Ptv3Config { preset, orders, .. }) => {
            hierarchy::fixed_turns(Stages::of(*preset).n_levels(), orders)
        }
        BackboneConfig::Pointnet { .. } => CurveTurns::new(),
    }
}

/// A turn of the curves for training. The generator gives the same count of numbers whatever curves there are.
pub(crate) fn training_turns(config: &NetConfig, rng: &mut Rng) -> CurveTurns {
    match &config.backbone {
        BackboneConfig::Ptv3(Ptv3Config {
            preset,
            orders,
            shuffle_orders,
            ..
        }) => {
            let shuffled = hierarchy::shuffled_turns(Stages::of(*preset).n_levels(), orders, rng);
            if *shuffle_orders {
                shuffled
            } else {
                test_turns(config)
            }
        }
        BackboneConfig::Pointnet { .. } => CurveTurns::new(),
    }
}

/// Turns tokens into the input of the network of this config; `turns` holds one entry a level.
pub(crate) fn prepare(config: &NetConfig, tokens: &Tokens, turns: &CurveTurns) -> ShapeInput {
    let features = features(tokens);
    match &config.backbone {
        BackboneConfig::Ptv3(ptv3) => ShapeInput::Ptv3 {
            features,
            around: stem_neighbors(tokens),
            hierarchy: Hierarchy::new(tokens, ptv3.patch, turns),
        },
        BackboneConfig::Pointnet { .. } => ShapeInput::Pointnet { features },
    }
}

pub(crate) fn features(tokens: &Tokens) -> Vec<f32> {
    tokens
        .positions
        .iter()
        .zip(&tokens.normals)
        .flat_map(|(position, normal)| position.iter().chain(normal))
        .copied()
        .collect()
}

/// The 5³ cells around each token.
pub(crate) fn stem_neighbors(tokens: &Tokens) -> Neighbors {
    Neighbors::new(&neighbor_table(&tokens.cells, &tokens.axes, 2), STEM_VOLUME)
}
