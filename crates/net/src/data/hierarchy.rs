//! Computes the integer tables that a point transformer needs on each level of tokens.
//!
//! Each level halves the grid by dropping the last three bits of the Morton code. Tokens with different dominant normal axes
//! remain separate on all levels, so the sides of a thin plate never merge.

use crate::data::curve::{Cell, Curve, MAX_DEPTH, depth_of};
use crate::data::neighbor_table::neighbor_table;
use crate::data::neighbors::Neighbors;
use crate::data::patches::Patches;
use crate::data::tokens::Tokens;
use partprobe_carrier::Rng;
use rand::Rng as _;
use std::sync::Arc;

/// Number of cells in the neighborhood of xCPE.
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
    /// The cell of each token: `[token]`.
    pub(crate) cells: Vec<Cell>,
    /// The 3³ neighborhood of each token.
    pub(crate) neighbors: Neighbors,
    /// The serialized patches, one set per curve, in the order of the level.
    pub(crate) patches: Vec<Arc<Patches>>,
    /// The tokens that share a cell, one per dominant axis of the normals in it, or `None` if they are not needed.
    pub(crate) by_cell: Option<Clusters>,
    /// How the tokens merge into those of the next level, or `None` on the last level.
    pub(crate) pooling: Option<Clusters>,
}

/// Groups of the tokens of a level. Each token is in one of them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Clusters {
    /// How many clusters there are.
    pub(crate) n_clusters: usize,
    /// The cluster of each token: `[token]`.
    pub(crate) cluster: Vec<u32>,
    /// `[cluster, max_members]` tokens. A cluster with fewer tokens repeats its first one.
    pub(crate) members: Vec<u32>,
    /// The largest number of tokens that a cluster can have.
    pub(crate) max_members: usize,
}

/// A cell has eight cells of half the size. Each of them has at most one token per axis.
const CHILDREN: usize = 8;

/// There are six signed axes, and a cell has at most one token per axis.
const AXES: usize = 6;

impl Clusters {
    /// Groups tokens with equal keys, in the order of the keys. A group has at most `max_members` tokens.
    fn by_key<K: Ord + Copy>(keys: impl Iterator<Item = K>, max_members: usize) -> Self {
        let mut keyed: Vec<(K, u32)> = keys.zip(0..).collect();
        keyed.sort_unstable();

        let mut clusters = Self {
            n_clusters: 0,
            cluster: vec![0; keyed.len()],
            members: Vec::new(),
            max_members,
        };
        for group in keyed.chunk_by(|a, b| a.0 == b.0) {
            for &(_, token) in group {
                clusters.cluster[token as usize] = clusters.n_clusters as u32;
            }
            let padded = group.iter().chain(std::iter::repeat(&group[0]));
            let members = padded.map(|&(_, token)| token).take(max_members);
            clusters.members.extend(members);
            clusters.n_clusters += 1;
        }
        clusters
    }
}

/// The order of the curves on each level. Block i of a stage uses the curve `orders[level][i % n]`, as in PTv3.
pub(crate) type CurveOrders = Vec<Vec<Curve>>;

/// The fixed order of the curves at test time: level l starts with the l-th of `curves`.
///
/// PTv3 shuffles the curves in each pooling, also at test time, so its inference is random. This is one fixed draw of that
/// shuffle. If each level started with the first curve, stages with one block would use only this curve.
pub(crate) fn fixed_orders(n_levels: usize, curves: &[Curve]) -> CurveOrders {
    let rotated = |level: usize| {
        let mut order = curves.to_vec();
        order.rotate_left(level % curves.len().max(1));
        order
    };
    (0..n_levels).map(rotated).collect()
}

/// A random order of the curves on each level, for training. It draws the same number of random numbers for any `curves`.
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
    /// Builds one level per entry of `orders`, with patches of at most `patch` tokens.
    pub(crate) fn new(tokens: &Tokens, patch: usize, orders: &CurveOrders) -> Self {
        Self::build(tokens, patch, orders, false)
    }

    /// The same with the tokens of each cell.
    pub(crate) fn with_cells(tokens: &Tokens, patch: usize, orders: &CurveOrders) -> Self {
        Self::build(tokens, patch, orders, true)
    }

    fn build(tokens: &Tokens, patch: usize, orders: &CurveOrders, has_cells: bool) -> Self {
        let (mut cells, mut axes) = (tokens.cells.clone(), tokens.axes.clone());
        let mut levels = Vec::with_capacity(orders.len());
        for (idx, order) in orders.iter().enumerate() {
            let mut level = Level::new(&cells, &axes, patch, order);
            level.by_cell = has_cells.then(|| tokens_by_cell(&cells));
            if idx + 1 < orders.len() {
                let pooling = pool(&cells, &axes);
                let first =
                    |cluster: usize| pooling.members[cluster * pooling.max_members] as usize;
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
            cells: cells.to_vec(),
            neighbors: Neighbors::new(&neighbor_table(cells, axes, 1), XCPE_VOLUME),
            patches: order
                .iter()
                .map(|&curve| Arc::new(Patches::new(&serialize(cells, axes, curve, depth), patch)))
                .collect(),
            by_cell: None,
            pooling: None,
        }
    }
}

/// The tokens along a curve. Tokens of the same cell are in the order of their axes.
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
fn pool(cells: &[Cell], axes: &[u8]) -> Clusters {
    let parent = |cell: &Cell| Curve::Z.code(*cell, MAX_DEPTH) >> 3;
    let keys = cells.iter().map(parent).zip(axes.iter().copied());
    Clusters::by_key(keys, CHILDREN)
}

/// Groups the tokens of each cell.
fn tokens_by_cell(cells: &[Cell]) -> Clusters {
    let codes = cells.iter().map(|&cell| Curve::Z.code(cell, MAX_DEPTH));
    Clusters::by_key(codes, AXES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::keyed_rng;

    /// The surface of a cube of `side` cells. Each cell occurs once for each side of the cube on which it lies.
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
    fn the_corner_cells_of_a_cube_have_three_tokens() {
        let cells = tokens_by_cell(&cube(4).cells);
        let n_tokens = |members: &[u32]| {
            let distinct: std::collections::BTreeSet<&u32> = members.iter().collect();
            distinct.len()
        };
        let sizes: Vec<usize> = cells.members.chunks_exact(AXES).map(n_tokens).collect();

        let with_size = |size: usize| sizes.iter().filter(|&&n| n == size).count();
        assert_eq!([1, 2, 3].map(with_size), [6 * 4, 12 * 2, 8]);
        assert_eq!(cells.n_clusters, 4 * 4 * 4 - 2 * 2 * 2);
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
