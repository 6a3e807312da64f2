//! A backbone with its embedding head, whatever the backbone is: `Tokens → un-normalised embeddings`.
//!
//! `prepare` does all that needs no tensors, so that it can run ahead of the network.

use crate::config::{BackboneConfig, NetConfig};
use crate::hierarchy::{CurveTurns, Hierarchy};
use crate::layers::Linear;
use crate::neighbours::neighbour_table;
use crate::parameters::Initializer;
use crate::pointnet::Pointnet;
use crate::ops::Neighbours;
use crate::ptv3::{LevelRows, Ptv3, STEM_VOLUME, Stages};
use crate::tokens::Tokens;
use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};

/// Input channels of a token: position and normal.
const N_FEATURES: usize = 6;

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
    /// Features, the 5³ neighbourhood of each token, and the levels above.
    Ptv3 {
        /// `[token, feature]`.
        features: Vec<f32>,
        /// The cells that the stem sees.
        around: Neighbours,
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
            BackboneConfig::Ptv3 { preset, .. } => {
                let stages = Stages::of(*preset);
                (Backbone::Ptv3(Ptv3::new(init, N_FEATURES, &stages)), stages.output_width())
            }
            BackboneConfig::Pointnet { widths } => {
                let width = widths.last().copied().unwrap_or(N_FEATURES);
                (Backbone::Pointnet(Pointnet::new(init, N_FEATURES, widths)), width)
            }
        };
        Self { backbone, head: Linear::new(init, "head", [width, config.embedding_dim]) }
    }

    /// Parameters of the head alone.
    pub(crate) fn n_head_parameters(&self) -> usize {
        self.head.num_params()
    }

    /// # Shapes
    /// - output: `[token, embedding_dim]`, not normalised
    pub(crate) fn forward(&self, input: &ShapeInput, device: &Device) -> Tensor<2> {
        let rows = match (&self.backbone, input) {
            (Backbone::Ptv3(ptv3), ShapeInput::Ptv3 { features, around, hierarchy }) => {
                let levels = LevelRows::of(hierarchy);
                ptv3.forward(matrix(features, features.len() / N_FEATURES, device), around, &levels)
            }
            (Backbone::Pointnet(pointnet), ShapeInput::Pointnet { features }) => {
                pointnet.forward(matrix(features, features.len() / N_FEATURES, device))
            }
            // `prepare` and `new` read the same config, so that network and input are of one kind.
            _ => unreachable!("input of another backbone"),
        };
        self.head.forward(rows)
    }
}

fn matrix(values: &[f32], n_rows: usize, device: &Device) -> Tensor<2> {
    let dim = values.len() / n_rows.max(1);
    Tensor::from_data(TensorData::new(values.to_vec(), [n_rows, dim]), device)
}

/// Levels of the hierarchy that the network of this config wants.
pub(crate) fn n_levels(config: &NetConfig) -> usize {
    match &config.backbone {
        BackboneConfig::Ptv3 { preset, .. } => Stages::of(*preset).n_levels(),
        BackboneConfig::Pointnet { .. } => 0,
    }
}

/// Turns tokens into the input of the network of this config; `turns` holds one entry a level.
pub(crate) fn prepare(config: &NetConfig, tokens: &Tokens, turns: &CurveTurns) -> ShapeInput {
    let features = features(tokens);
    match &config.backbone {
        BackboneConfig::Ptv3 { patch, .. } => ShapeInput::Ptv3 {
            features,
            around: Neighbours::new(&neighbour_table(&tokens.cells, &tokens.axes, 2), STEM_VOLUME),
            hierarchy: Hierarchy::new(tokens, *patch, turns),
        },
        BackboneConfig::Pointnet { .. } => ShapeInput::Pointnet { features },
    }
}

fn features(tokens: &Tokens) -> Vec<f32> {
    tokens
        .positions
        .iter()
        .zip(&tokens.normals)
        .flat_map(|(position, normal)| position.iter().chain(normal))
        .copied()
        .collect()
}
