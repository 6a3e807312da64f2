//! Holds the occupied cells around each token, in the form that a convolution reads.

use super::neighbor_pairs::NeighborPairs;
use std::sync::Arc;

/// The cells around each token.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Neighbors {
    pub(crate) pairs: Arc<NeighborPairs>,
    pub(crate) n_tokens: usize,
}

impl Neighbors {
    /// Takes a dense table. An entry for an empty cell is the number of tokens.
    ///
    /// # Shapes
    /// - table: `[token, n_offsets]`
    pub(crate) fn new(table: &[u32], n_offsets: usize) -> Self {
        Self {
            pairs: Arc::new(NeighborPairs::new(table, n_offsets)),
            n_tokens: table.len() / n_offsets.max(1),
        }
    }

    /// The cells of several shapes together. The tokens of the first shape come first.
    pub(crate) fn joined(shapes: &[&Self]) -> Self {
        if let [shape] = shapes {
            return (*shape).clone();
        }
        let pairs: Vec<(&NeighborPairs, usize)> = shapes
            .iter()
            .map(|shape| (shape.pairs.as_ref(), shape.n_tokens))
            .collect();
        let n_tokens = pairs.iter().map(|(_, n)| *n).sum();
        Self {
            pairs: Arc::new(NeighborPairs::joined(&pairs)),
            n_tokens,
        }
    }
}
