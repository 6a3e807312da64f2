//! Computes the input of a hierarchical backbone for one shape: features, the levels of tokens and, for a stem with a
//! convolution, the cells around each token. The shapes of a batch are joined here.

use super::backbone::{N_FEATURES, features, matrix};
use super::stem::stem_neighbors;
use crate::data::hierarchy::Hierarchy;
use crate::data::level_rows::{LevelRows, levels_of};
use crate::data::neighbors::Neighbors;
use crate::data::tokens::Tokens;
use burn::tensor::{Device, Tensor};

/// One shape as numbers, ready for a device.
pub(crate) struct LeveledTokens {
    /// `[token, 6]`, row by row.
    features: Vec<f32>,
    /// The levels, from the finest up.
    hierarchy: Hierarchy,
}

/// The joined shapes of a batch, on a device.
pub(crate) struct LeveledBatch {
    /// `[token, 6]`
    pub(crate) features: Tensor<2>,
    /// The levels, from the finest up.
    pub(crate) levels: Vec<LevelRows>,
}

impl LeveledTokens {
    pub(crate) fn new(tokens: &Tokens, hierarchy: Hierarchy) -> Self {
        Self {
            features: features(tokens),
            hierarchy,
        }
    }

    /// Joins the shapes, in their order.
    pub(crate) fn batch<'a>(
        shapes: impl Iterator<Item = &'a Self> + Clone,
        device: &Device,
    ) -> LeveledBatch {
        let features: Vec<f32> = shapes
            .clone()
            .flat_map(|shape| &shape.features)
            .copied()
            .collect();
        let n_tokens = features.len() / N_FEATURES;
        let hierarchies: Vec<&Hierarchy> = shapes.map(|shape| &shape.hierarchy).collect();
        LeveledBatch {
            features: matrix(features, n_tokens, device),
            levels: levels_of(&hierarchies),
        }
    }
}

/// One shape with the 5³ cells around each token.
pub(crate) struct SurroundedTokens {
    around: Neighbors,
    tokens: LeveledTokens,
}

impl SurroundedTokens {
    pub(crate) fn new(tokens: &Tokens, hierarchy: Hierarchy) -> Self {
        Self {
            around: stem_neighbors(tokens),
            tokens: LeveledTokens::new(tokens, hierarchy),
        }
    }

    /// Joins the shapes, in their order.
    pub(crate) fn batch(shapes: &[&Self], device: &Device) -> (Neighbors, LeveledBatch) {
        let around: Vec<&Neighbors> = shapes.iter().map(|shape| &shape.around).collect();
        let tokens = shapes.iter().map(|shape| &shape.tokens);
        (
            Neighbors::joined(&around),
            LeveledTokens::batch(tokens, device),
        )
    }
}
