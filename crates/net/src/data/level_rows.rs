//! Joins the levels of the shapes of a batch into the tables that the operations read. A batch may be a single shape.
//!
//! Neighborhoods and clusters never cross shapes, and each shape keeps its own patches.

use crate::data::hierarchy::{Clusters, Hierarchy, Level};
use crate::data::neighbors::Neighbors;
use crate::data::patches::Patches;
use crate::data::rows::Rows;
use std::sync::Arc;

/// A level, ready for the network.
pub(crate) struct LevelRows {
    /// The cell of each token, which is its position in units of a cell's edge: `[token, 3]`, row by row.
    pub(crate) cells: Vec<f32>,
    /// The 3³ neighborhoods.
    pub(crate) neighbors: Neighbors,
    /// The patches of each shape.
    pub(crate) shapes: Vec<ShapePatches>,
    /// The tokens that share a cell, or `None` if they are not needed.
    pub(crate) by_cell: Option<ClusterRows>,
    /// How tokens merge into those of the next level, or `None` on the last level.
    pub(crate) pooling: Option<ClusterRows>,
}

/// The patches of one shape. Indices count from its own first token.
pub(crate) struct ShapePatches {
    /// Number of tokens of the shape.
    pub(crate) n: usize,
    /// One set of patches per curve, in the order of the level.
    pub(crate) by_curve: Vec<Arc<Patches>>,
}

/// Groups of the tokens of a level.
pub(crate) struct ClusterRows {
    /// The tokens of each cluster: `[cluster, max_members]`.
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
                cells: levels.iter().flat_map(|level| cell_rows(level)).collect(),
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
                by_cell: joined(&levels, |level| level.by_cell.as_ref()),
                pooling: joined(&levels, |level| level.pooling.as_ref()),
            }
        })
        .collect()
}

fn cell_rows(level: &Level) -> impl Iterator<Item = f32> {
    // The numbers are below 2¹⁶, so f32 represents them exactly.
    level.cells.iter().flatten().map(|&x| x as f32)
}

impl ShapePatches {
    fn new(level: &Level) -> Self {
        Self {
            n: level.n,
            by_curve: level.patches.clone(),
        }
    }
}

/// The clusters of these levels, or `None` if one of them has none.
fn joined<'a>(
    levels: &[&'a Level],
    clusters: impl Fn(&'a Level) -> Option<&'a Clusters>,
) -> Option<ClusterRows> {
    let each = levels.iter().map(|&level| clusters(level));
    let each: Option<Vec<&Clusters>> = each.collect();
    Some(ClusterRows::joined(each?.into_iter()))
}

impl ClusterRows {
    /// The clusters of several shapes, with tokens and clusters counted over all of them.
    fn joined<'a>(each: impl Iterator<Item = &'a Clusters>) -> Self {
        let (mut members, mut cluster) = (Vec::new(), Vec::new());
        let (mut first_token, mut first_cluster) = (0, 0);
        let mut max_members = 1;
        for clusters in each {
            members.extend(clusters.members.iter().map(|token| token + first_token));
            cluster.extend(clusters.cluster.iter().map(|own| own + first_cluster));
            first_token += clusters.cluster.len() as u32;
            first_cluster += clusters.n_clusters as u32;
            max_members = clusters.max_members;
        }
        Self {
            members: Rows::new(&members, max_members),
            cluster: Rows::new(&cluster, 1),
        }
    }
}
