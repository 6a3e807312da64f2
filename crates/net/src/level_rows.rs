//! The levels of one shape, or of the shapes of a batch one behind the other, as index tensors on a device.
//!
//! Neighbourhoods and clusters never cross shapes, and each shape keeps its own patches.

use crate::hierarchy::{Hierarchy, Level, Pooling};
use crate::ops::{PatchRows, Rows};
use burn::tensor::Device;

/// Cells in the neighbourhood of xCPE.
pub(crate) const XCPE_VOLUME: usize = 27;

/// A level, ready for the network.
pub(crate) struct LevelRows {
    /// The 3³ neighbourhoods.
    pub(crate) neighbours: Rows,
    /// The patches of each shape.
    pub(crate) shapes: Vec<ShapePatches>,
    /// How tokens merge into those of the next level; none on the last one.
    pub(crate) pooling: Option<PoolingRows>,
}

/// The patches of one shape; indices count from its own first token.
pub(crate) struct ShapePatches {
    /// Tokens of the shape.
    pub(crate) n: usize,
    /// One set of patches for each curve of the level's turn.
    pub(crate) by_turn: Vec<PatchRows>,
}

/// The clusters that a level merges into.
pub(crate) struct PoolingRows {
    /// The tokens of each cluster.
    pub(crate) members: Rows,
    /// The cluster of each token.
    pub(crate) cluster: Rows,
}

/// Puts the levels of these shapes on the device, the finest first.
pub(crate) fn levels_on(hierarchies: &[&Hierarchy], device: &Device) -> Vec<LevelRows> {
    let n_levels = hierarchies.iter().map(|hierarchy| hierarchy.levels.len()).min().unwrap_or(0);
    (0..n_levels)
        .map(|idx| {
            let levels: Vec<&Level> = hierarchies.iter().map(|hierarchy| &hierarchy.levels[idx]).collect();
            LevelRows {
                neighbours: Rows::new(&joined_neighbours(&levels), XCPE_VOLUME, device),
                shapes: levels.iter().map(|level| ShapePatches::new(level, device)).collect(),
                pooling: joined_pooling(&levels, device),
            }
        })
        .collect()
}

impl ShapePatches {
    fn new(level: &Level, device: &Device) -> Self {
        let by_turn = level.patches.iter().map(|patches| PatchRows::new(patches, device)).collect();
        Self { n: level.n, by_turn }
    }
}

/// The neighbourhoods of all shapes, where the number of all tokens stands for an empty cell.
fn joined_neighbours(levels: &[&Level]) -> Vec<u32> {
    let n_all: usize = levels.iter().map(|level| level.n).sum();
    let mut joined = Vec::with_capacity(n_all * XCPE_VOLUME);
    let mut first = 0;
    for level in levels {
        let n = level.n as u32;
        joined.extend(level.neighbours.iter().map(|&token| if token < n { token + first } else { n_all as u32 }));
        first += n;
    }
    joined
}

fn joined_pooling(levels: &[&Level], device: &Device) -> Option<PoolingRows> {
    let (mut members, mut cluster) = (Vec::new(), Vec::new());
    let (mut first, mut first_cluster) = (0, 0);
    for level in levels {
        let pooling = level.pooling.as_ref()?;
        members.extend(pooling.members.iter().map(|token| token + first));
        cluster.extend(pooling.cluster.iter().map(|cluster| cluster + first_cluster));
        first += level.n as u32;
        first_cluster += pooling.n_clusters as u32;
    }
    Some(PoolingRows {
        members: Rows::new(&members, Pooling::MAX_MEMBERS, device),
        cluster: Rows::new(&cluster, 1, device),
    })
}
