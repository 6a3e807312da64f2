//! Computes what PTv3 needs to know about one shape: features, the neighborhoods of the stem, and the levels above.

use super::config::Ptv3Config;
use super::stage::STEM_VOLUME;
use crate::data::hierarchy::{CurveOrders, Hierarchy};
use crate::data::neighbor_table::neighbor_table;
use crate::data::neighbors::Neighbors;
use crate::data::tokens::Tokens;
use crate::model::backbones::backbone::features;

/// One shape as numbers, ready for a device.
pub(crate) struct Ptv3Input {
    /// `[token, 6]`, row by row.
    pub(super) features: Vec<f32>,
    /// The 5³ cells around each token, which the stem sees.
    pub(super) around: Neighbors,
    /// The levels, from the finest up.
    pub(super) hierarchy: Hierarchy,
}

impl Ptv3Input {
    /// `orders` has one entry per level.
    pub(super) fn new(tokens: &Tokens, config: &Ptv3Config, orders: &CurveOrders) -> Self {
        let hierarchy = if config.cell_exchange {
            Hierarchy::with_cells
        } else {
            Hierarchy::new
        };
        Self {
            features: features(tokens),
            around: stem_neighbors(tokens),
            hierarchy: hierarchy(tokens, config.patch, orders),
        }
    }
}

/// The 5³ cells around each token.
pub(crate) fn stem_neighbors(tokens: &Tokens) -> Neighbors {
    Neighbors::new(&neighbor_table(&tokens.cells, &tokens.axes, 2), STEM_VOLUME)
}
