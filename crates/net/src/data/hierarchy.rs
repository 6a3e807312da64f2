//! Computes the integer tables that a point transformer needs on each level of tokens.
//!
//! Each level halves the grid by dropping the last three bits of the Morton code; tokens of different dominant normal
//! axes stay apart on all levels, so that the sides of a thin plate never merge.

use crate::data::curve::{Cell, Curve, MAX_DEPTH, depth_of};
use crate::data::neighbor_table::neighbor_table;
use crate::data::neighbors::Neighbors;
use crate::data::patches::Patches;
use crate::data::tokens::Tokens;
use partprobe_carrier::Rng;
use rand::Rng as _;
use std::sync::Arc;

/// Cells in the neighborhood of xCPE.
pub(crate) const XCPE_VOLUME: usize = 27;

/// The levels of one shape, from its tokens up.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hierarchy {
    pub(crate) levels: Vec<Level>,
}

/// Tokens of one grid size.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Level {
    /// How many tokens there are.
    pub(crate) n: usize,
    /// The 3³ neighborhood of each token.
    pub(crate) neighbors: Neighbors,
    /// The serialized patches, one way for each curve, in the order of the level.
    pub(crate) patches: Vec<Arc<Patches>>,
    /// How the tokens merge into those of the next level, or `None` on the last level.
    pub(crate) pooling: Option<Pooling>,
}

/// The clusters that a level merges into.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pooling {
    /// How many clusters there are.
    pub(crate) n_clusters: usize,
    /// The cluster of each token: `[token]`.
    pub(crate) cluster: Vec<u32>,
    /// `[cluster, 8]` tokens. A cluster with fewer tokens repeats its first one.
    pub(crate) members: Vec<u32>,
}

impl Pooling {
    /// A cell has eight cells of half the size, and each holds at most one token of an axis.
    pub(crate) const MAX_MEMBERS: usize = 8;
}

/// The order of the curves on each level; block i of a stage follows `orders[level][i % n]`, as in PTv3.
pub(crate) type CurveOrders = Vec<Vec<Curve>>;

/// The fixed order of the curves at test time: level l starts with the l-th of `curves`.
///
/// PTv3 shuffles the curves in each pooling, at test time too, so that its inference is random. This is one draw of that
/// shuffle, kept: were each level to start with the first curve, stages of one block would know no other.
pub(crate) fn fixed_orders(n_levels: usize, curves: &[Curve]) -> CurveOrders {
    let rotated = |level: usize| {
        let mut order = curves.to_vec();
        order.rotate_left(level % curves.len().max(1));
        order
    };
    (0..n_levels).map(rotated).collect()
}

/// A random order of the curves on each level, for training. It draws as many numbers from the generator for any `curves`.
pub(crate) fn shuffled_orders(n_levels: usize, curves: &[Curve], rng: &mut Rng) -> CurveOrders {
    let mut shuffled = || {
        let mut order = Curve::ALL.to_vec();
        for last in (1..order.len()).rev() {
            order.swap(last, (rng.next_u64() % (last as u64 + 1)) as usize);
        }
        order.retain(|curve| curves.contains(curve));
        order
    };
    (0..n_levels).map(|_| shuffled()).collect()
}

impl Hierarchy {
    /// Builds one level for each entry of `orders`, with patches of at most `patch` tokens.
    pub(crate) fn new(tokens: &Tokens, patch: usize, orders: &CurveOrders) -> Self {
        let (mut cells, mut axes) = (tokens.cells.clone(), tokens.axes.clone());
        let mut levels = Vec::with_capacity(orders.len());
        for (idx, order) in orders.iter().enumerate() {
            let mut level = Level::new(&cells, &axes, patch, order);
            if idx + 1 < orders.len() {
                let pooling = pool(&cells, &axes);
                let first =
                    |cluster: usize| pooling.members[cluster * Pooling::MAX_MEMBERS] as usize;
                (cells, axes) = (0..pooling.n_clusters)
                    .map(|cluster| (cells[first(cluster)].map(|x| x >> 1), axes[first(cluster)]))
                    .unzip();
                level.pooling = Some(pooling);
            }
            levels.push(level);
        }
        Self { levels }
    }
}

impl Level {
    fn new(cells: &[Cell], axes: &[u8], patch: usize, order: &[Curve]) -> Self {
        let depth = depth_of(cells);
        Self {
            n: cells.len(),
            neighbors: Neighbors::new(&neighbor_table(cells, axes, 1), XCPE_VOLUME),
            patches: order
                .iter()
                .map(|&curve| Arc::new(Patches::new(&serialize(cells, axes, curve, depth), patch)))
                .collect(),
            pooling: None,
        }
    }
}

/// The tokens along a curve; those of one cell in the order of their axes.
fn serialize(cells: &[Cell], axes: &[u8], curve: Curve, depth: u32) -> Vec<u32> {
    let mut order: Vec<u32> = (0..cells.len() as u32).collect();
    order.sort_by_cached_key(|&token| {
        (
            curve.code(cells[token as usize], depth),
            axes[token as usize],
        )
    });
    order
}

/// Merges the tokens whose cells share a parent and whose normals share an axis.
fn pool(cells: &[Cell], axes: &[u8]) -> Pooling {
    let mut keyed: Vec<(u64, u8, u32)> = (0..)
        .zip(cells.iter().zip(axes))
        .map(|(token, (&cell, &axis))| (Curve::Z.code(cell, MAX_DEPTH) >> 3, axis, token))
        .collect();
    keyed.sort_unstable();
    let mut pooling = Pooling {
        n_clusters: 0,
        cluster: vec![0; cells.len()],
        members: Vec::new(),
    };
    for group in keyed.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        for &(_, _, token) in group {
            pooling.cluster[token as usize] = pooling.n_clusters as u32;
        }
        let members = group
            .iter()
            .chain(std::iter::repeat(&group[0]))
            .map(|entry| entry.2);
        pooling.members.extend(members.take(Pooling::MAX_MEMBERS));
        pooling.n_clusters += 1;
    }
    pooling
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::keyed_rng;

    /// The surface of a cube of `side` cells, each cell once for each side of the cube that it lies on.
    fn cube(side: u32) -> Tokens {
        let mut voxels = Vec::new();
        for (axis, fixed) in [
            (0, side - 1),
            (0, 0),
            (1, side - 1),
            (1, 0),
            (2, side - 1),
            (2, 0),
        ] {
            for (u, v) in (0..side).flat_map(|u| (0..side).map(move |v| (u, v))) {
                let mut cell = [u; 3];
                (cell[axis], cell[(axis + 1) % 3], cell[(axis + 2) % 3]) = (fixed, u, v);
                voxels.push((
                    Curve::Z.code(cell, MAX_DEPTH),
                    2 * axis as u8 + u8::from(fixed == 0),
                    cell,
                ));
            }
        }
        voxels.sort_unstable();
        let n = voxels.len();
        Tokens {
            positions: vec![[0.0; 3]; n],
            normals: vec![[0.0; 3]; n],
            cells: voxels.iter().map(|voxel| voxel.2).collect(),
            axes: voxels.iter().map(|voxel| voxel.1).collect(),
            token_of_point: (0..n as u32).collect(),
            multiplicity: vec![1; n],
        }
    }

    #[test]
    fn each_level_of_a_cube_has_a_quarter_of_the_tokens() {
        let hierarchy = Hierarchy::new(&cube(16), 128, &fixed_orders(4, &Curve::ALL));
        let sizes: Vec<usize> = hierarchy.levels.iter().map(|level| level.n).collect();
        assert_eq!(sizes, [6 * 256, 6 * 64, 6 * 16, 6 * 4]);
        for pair in hierarchy.levels.windows(2) {
            let pooling = pair[0].pooling.as_ref().unwrap();
            assert_eq!(
                (pooling.n_clusters, pooling.cluster.len()),
                (pair[1].n, pair[0].n)
            );
            for (token, &cluster) in (0..).zip(&pooling.cluster) {
                assert!(pooling.members[cluster as usize * 8..][..8].contains(&token));
            }
        }
        assert_eq!(hierarchy.levels[3].pooling, None);
    }

    #[test]
    fn shuffled_orders_are_permutations_and_differ_between_keys() {
        let draw =
            |key: &str, orders: &[Curve]| shuffled_orders(3, orders, &mut keyed_rng(0, &[key]));
        for order in draw("a", &Curve::ALL) {
            assert!(order.len() == 4 && Curve::ALL.iter().all(|curve| order.contains(curve)));
        }
        assert_eq!(draw("a", &Curve::ALL), draw("a", &Curve::ALL));
        assert!((0..8).any(|key| draw(&key.to_string(), &Curve::ALL) != draw("a", &Curve::ALL)));
        assert_eq!(draw("a", &[Curve::Hilbert]), vec![vec![Curve::Hilbert]; 3]);
    }

    #[test]
    fn fixed_orders_start_with_another_curve_on_each_level() {
        let [z, z_trans, hilbert, hilbert_trans] = Curve::ALL;
        let orders = fixed_orders(5, &Curve::ALL);
        assert_eq!(orders[1], [z_trans, hilbert, hilbert_trans, z]);
        assert_eq!(
            orders.iter().map(|order| order[0]).collect::<Vec<_>>(),
            [z, z_trans, hilbert, hilbert_trans, z]
        );
        assert_eq!(fixed_orders(2, &[hilbert]), vec![vec![hilbert]; 2]);
    }
}
