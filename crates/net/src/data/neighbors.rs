//! The occupied cells around each token, as a convolution reads them.

use super::neighbor_pairs::NeighborPairs;
use std::sync::Arc;

/// The cells around each token.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Neighbors {
    pub(crate) pairs: Arc<NeighborPairs>,
    pub(crate) n_tokens: usize,
}

impl Neighbors {
    /// Takes a dense table with `n_offsets` entries a token; the number of tokens stands for an empty cell.
    pub(crate) fn new(table: &[u32], n_offsets: usize) -> Self {
        Self {
            pairs: Arc::new(NeighborPairs::new(table, n_offsets)),
            n_tokens: table.len() / n_offsets.max(1),
        }
    }

    /// Those of several shapes, whose tokens come one behind the other.
    pub(crate) fn joined(shapes: &[&Self]) -> Self {
        if let [shape] = shapes {
            return (*shape).clone();
        }
        let parts: Vec<(&NeighborPairs, usize)> = shapes
            .iter()
            .map(|shape| (shape.pairs.as_ref(), shape.n_tokens))
            .collect();
        let n_tokens = parts.iter().map(|part| part.1).sum();
        Self {
            pairs: Arc::new(NeighborPairs::joined(&parts)),
            n_tokens,
        }
    }
}
