//! Joins the levels of the shapes of a batch into the tables that the operations read. A batch may be a single shape.
//!
//! Neighborhoods and clusters never cross shapes, and each shape keeps its own patches.

use crate::data::hierarchy::{Hierarchy, Level, Pooling};
use crate::data::neighbors::Neighbors;
use crate::data::patches::Patches;
use crate::data::rows::Rows;
use std::sync::Arc;

/// A level, ready for the network.
pub(crate) struct LevelRows {
    /// The 3³ neighborhoods.
    pub(crate) neighbors: Neighbors,
    /// The patches of each shape.
    pub(crate) shapes: Vec<ShapePatches>,
    /// How tokens merge into those of the next level, or `None` on the last level.
    pub(crate) pooling: Option<PoolingRows>,
}

/// The patches of one shape; indices count from its own first token.
pub(crate) struct ShapePatches {
    /// Tokens of the shape.
    pub(crate) n: usize,
    /// One set of patches for each curve, in the order of the level.
    pub(crate) by_curve: Vec<Arc<Patches>>,
}

/// The clusters that a level merges into.
pub(crate) struct PoolingRows {
    /// The tokens of each cluster: `[cluster, 8]`.
    pub(crate) members: Rows,
    /// The cluster of each token: `[token]`.
    pub(crate) cluster: Rows,
}

/// The levels of these shapes, the finest level first. On each level the tokens of the first shape come first.
///
/// # Shapes
/// - output: one entry per level; `token` and `cluster` count over all shapes, except in the patches
pub(crate) fn levels_of(hierarchies: &[&Hierarchy]) -> Vec<LevelRows> {
    let n_levels = hierarchies
        .iter()
        .map(|hierarchy| hierarchy.levels.len())
        .min()
        .unwrap_or(0);
    (0..n_levels)
        .map(|idx| {
            let levels: Vec<&Level> = hierarchies
                .iter()
                .map(|hierarchy| &hierarchy.levels[idx])
                .collect();
            LevelRows {
                neighbors: Neighbors::joined(
                    &levels
                        .iter()
                        .map(|level| &level.neighbors)
                        .collect::<Vec<_>>(),
                ),
                shapes: levels
                    .iter()
                    .map(|level| ShapePatches::new(level))
                    .collect(),
                pooling: joined_pooling(&levels),
            }
        })
        .collect()
}

impl ShapePatches {
    fn new(level: &Level) -> Self {
        Self {
            n: level.n,
            by_curve: level.patches.clone(),
        }
    }
}

fn joined_pooling(levels: &[&Level]) -> Option<PoolingRows> {
    let (mut members, mut cluster) = (Vec::new(), Vec::new());
    let (mut first, mut first_cluster) = (0, 0);
    for level in levels {
        let pooling = level.pooling.as_ref()?;
        members.extend(pooling.members.iter().map(|token| token + first));
        cluster.extend(
            pooling
                .cluster
                .iter()
                .map(|cluster| cluster + first_cluster),
        );
        first += level.n as u32;
        first_cluster += pooling.n_clusters as u32;
    }
    Some(PoolingRows {
        members: Rows::new(&members, Pooling::MAX_MEMBERS),
        cluster: Rows::new(&cluster, 1),
    })
}
