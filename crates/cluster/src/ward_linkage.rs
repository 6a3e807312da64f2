//! Clusters rows over a graph by Ward's rule: repeatedly merges the two neighbors whose union increases the sum of squares least.
//!
//! Weighted rows and pairs of neighbors go in, and a tree comes out. It gives the cluster of each row for any number of clusters
//! (Ward 1963, with the connectivity constraint of structured clustering). The order of merges does not depend on the number of
//! clusters, so the clusters for a smaller number are unions of those for a larger one.

use partprobe_carrier::Partition;
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

/// A row of numbers and its weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightedRow<R> {
    /// The numbers, which must be finite. All rows of a tree have the same length.
    pub numbers: R,
    /// The weight, for example an area. It must be finite and not negative.
    pub weight: f64,
}

/// The merges of Ward linkage, in their order.
///
/// ```
/// use partprobe_cluster::{WardTree, WeightedRow};
///
/// // A chain of four rows. Neighbors with close numbers merge first.
/// let row = |number: f64| WeightedRow { numbers: [number], weight: 1.0 };
/// let tree = WardTree::grow(&[0.0, 0.1, 5.0, 5.2].map(row), &[[0, 1], [1, 2], [2, 3]], 1);
/// assert_eq!(tree.cut(2).parts(), [0, 0, 1, 1]);
/// assert_eq!(tree.cut(3).parts(), [0, 0, 1, 2]);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WardTree {
    n_rows: usize,
    merges: Vec<[u32; 2]>,
}

impl WardTree {
    /// Merges until at most `n_min` clusters are left. A value of 0 counts as 1. A neighbor that is not a row is ignored.
    ///
    /// As soon as no two clusters are neighbors, the lightest cluster joins the one with the nearest mean.
    #[must_use]
    pub fn grow<R>(rows: &[WeightedRow<R>], neighbors: &[[u32; 2]], n_min: usize) -> Self
    where
        R: AsRef<[f64]> + AsMut<[f64]> + Clone,
    {
        let mut merging = Merging::new(rows, neighbors);
        merging.merge_neighbors(n_min.max(1));
        merging.merge_unconnected(n_min.max(1));
        Self {
            n_rows: rows.len(),
            merges: merging.merges,
        }
    }

    /// The cluster of each row if there are at most `n_max` clusters. There are never fewer than the tree was grown to.
    #[must_use]
    pub fn cut(&self, n_max: usize) -> Partition {
        let n_merges = self.n_rows.saturating_sub(n_max.max(1));
        let merges = self.merges.iter().take(n_merges).copied();
        Partition::from_joined_pairs(self.n_rows, merges)
    }
}

#[derive(Clone, Debug)]
struct Cluster<R> {
    weight: f64,
    mean: R,
    neighbors: BTreeSet<u32>,
    /// The number of times that it has grown. A candidate of an earlier state is outdated.
    version: u32,
}

impl<R: AsRef<[f64]>> Cluster<R> {
    /// The increase of the weighted sum of squares if the two clusters are merged.
    fn cost(&self, other: &Self) -> f64 {
        let total = self.weight + other.weight;
        let share = if total > 0.0 {
            self.weight * other.weight / total
        } else {
            0.0
        };
        share * squared_distance(self.mean.as_ref(), other.mean.as_ref())
    }
}

fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Two neighbors in a certain state. Costs are not negative, so their bits have the same order as the costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    cost: u64,
    clusters: [u32; 2],
    versions: [u32; 2],
}

struct Merging<R> {
    clusters: Vec<Cluster<R>>,
    candidates: BinaryHeap<Reverse<Candidate>>,
    living: BTreeSet<u32>,
    merges: Vec<[u32; 2]>,
}

impl<R: AsRef<[f64]> + AsMut<[f64]> + Clone> Merging<R> {
    fn new(rows: &[WeightedRow<R>], neighbors: &[[u32; 2]]) -> Self {
        let alone = |row: &WeightedRow<R>| Cluster {
            weight: row.weight,
            mean: row.numbers.clone(),
            neighbors: BTreeSet::new(),
            version: 0,
        };
        let mut clusters: Vec<Cluster<R>> = rows.iter().map(alone).collect();
        let is_pair = |pair: &&[u32; 2]| {
            pair[0] != pair[1] && pair.iter().all(|&row| (row as usize) < rows.len())
        };
        for &[a, b] in neighbors.iter().filter(is_pair) {
            clusters[a as usize].neighbors.insert(b);
            clusters[b as usize].neighbors.insert(a);
        }

        let living = (0..).take(clusters.len()).collect();
        let mut merging = Self {
            clusters,
            candidates: BinaryHeap::new(),
            living,
            merges: Vec::new(),
        };
        for a in 0..merging.clusters.len() as u32 {
            for b in merging.clusters[a as usize]
                .neighbors
                .clone()
                .range(a + 1..)
            {
                merging.propose(a, *b);
            }
        }
        merging
    }

    fn propose(&mut self, a: u32, b: u32) {
        let clusters = [a.min(b), a.max(b)];
        let [first, second] = clusters.map(|cluster| &self.clusters[cluster as usize]);
        let cost = first.cost(second).to_bits();
        self.candidates.push(Reverse(Candidate {
            cost,
            clusters,
            versions: [first.version, second.version],
        }));
    }

    fn merge_neighbors(&mut self, n_max: usize) {
        while self.living.len() > n_max {
            let Some(Reverse(best)) = self.candidates.pop() else {
                break;
            };
            let is_alive = best
                .clusters
                .iter()
                .all(|cluster| self.living.contains(cluster));
            let versions = best
                .clusters
                .map(|cluster| self.clusters[cluster as usize].version);
            if is_alive && versions == best.versions {
                self.merge(best.clusters);
            }
        }
    }

    fn merge_unconnected(&mut self, n_max: usize) {
        while self.living.len() > n_max {
            let weight = |cluster: &u32| self.clusters[*cluster as usize].weight;
            let Some(lightest) = self
                .living
                .iter()
                .copied()
                .min_by(|a, b| weight(a).total_cmp(&weight(b)))
            else {
                break;
            };
            let distance = |other: &u32| {
                squared_distance(
                    self.clusters[*other as usize].mean.as_ref(),
                    self.clusters[lightest as usize].mean.as_ref(),
                )
            };
            let others = self
                .living
                .iter()
                .copied()
                .filter(|&other| other != lightest);
            let Some(nearest) = others.min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
                break;
            };
            self.merge([lightest.min(nearest), lightest.max(nearest)]);
        }
    }

    /// Merges the second cluster into the first.
    fn merge(&mut self, [into, from]: [u32; 2]) {
        self.merges.push([into, from]);
        self.living.remove(&from);
        let gone_neighbors = std::mem::take(&mut self.clusters[from as usize].neighbors);
        let gone_weight = self.clusters[from as usize].weight;
        let gone_mean = self.clusters[from as usize].mean.clone();

        for &other in &gone_neighbors {
            self.clusters[other as usize].neighbors.remove(&from);
            if other != into {
                self.clusters[other as usize].neighbors.insert(into);
            }
        }
        let grown = &mut self.clusters[into as usize];
        let total = grown.weight + gone_weight;
        let share = if total > 0.0 {
            gone_weight / total
        } else {
            0.5
        };
        for (mean, gone) in grown.mean.as_mut().iter_mut().zip(gone_mean.as_ref()) {
            *mean += share * (gone - *mean);
        }
        grown.weight = total;
        grown.version += 1;
        grown.neighbors.extend(gone_neighbors);
        grown.neighbors.remove(&into);
        grown.neighbors.remove(&from);

        for other in grown.neighbors.clone() {
            self.propose(into, other);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn row((number, weight): (f64, f64)) -> WeightedRow<[f64; 2]> {
        WeightedRow {
            numbers: [number, 0.0],
            weight,
        }
    }

    #[track_caller]
    fn check(
        values: &[f64],
        weights: &[f64],
        neighbors: &[[u32; 2]],
        n_max: usize,
        expected: &[u32],
    ) {
        let pairs = values.iter().copied().zip(weights.iter().copied());
        let rows: Vec<WeightedRow<[f64; 2]>> = pairs.map(row).collect();
        let tree = WardTree::grow(&rows, neighbors, n_max);
        assert_eq!(tree.cut(n_max).parts(), expected);
    }

    #[test]
    fn the_cheapest_neighbors_merge_first() {
        let chain = [[0, 1], [1, 2], [2, 3]];
        check(&[], &[], &[], 2, &[]);
        check(&[0.0, 0.1, 5.0, 5.1], &[1.0; 4], &chain, 2, &[0, 0, 1, 1]);
        check(&[0.0, 0.1, 5.0, 5.1], &[1.0; 4], &chain, 4, &[0, 1, 2, 3]);
        // Equal values that are not neighbors are not merged.
        check(&[0.0, 5.0, 0.0, 5.0], &[1.0; 4], &chain, 3, &[0, 0, 1, 2]);
        // The gap of 1 between heavy rows costs 50, the gap of 3 next to a light one costs about 9.
        check(
            &[0.0, 1.0, 4.0],
            &[100.0, 100.0, 1.0],
            &chain[..2],
            2,
            &[0, 1, 1],
        );
        // No rows are connected, so the lightest row joins the nearest one.
        check(&[0.0, 5.0, 4.0], &[2.0, 3.0, 1.0], &[], 2, &[0, 1, 1]);
        check(&[0.0, 5.0, 4.0], &[0.0; 3], &[], 0, &[0, 0, 0]);
        // A neighbor that does not exist is ignored.
        check(&[0.0, 5.0], &[1.0; 2], &[[0, 2], [7, 1]], 2, &[0, 1]);
    }

    proptest! {
        #[test]
        fn the_bound_holds_and_levels_are_nested(
            values in proptest::collection::vec((0.0f64..9.0, 0.0f64..3.0), 1..30),
            pairs in proptest::collection::vec((0u32..30, 0u32..30), 0..60),
            n_max in 1usize..30,
        ) {
            let n = values.len() as u32;
            let rows: Vec<WeightedRow<[f64; 2]>> = values.iter().copied().map(row).collect();
            let pairs: Vec<[u32; 2]> = pairs.into_iter().map(|(a, b)| [a % n, b % n]).collect();
            let whole = WardTree::grow(&rows, &pairs, 1);
            let fine = whole.cut(n_max + 1);
            let coarse = whole.cut(n_max);
            prop_assert_eq!(coarse.n_parts() as usize, n_max.min(values.len()));
            prop_assert_eq!(&coarse, &WardTree::grow(&rows, &pairs, n_max).cut(n_max));
            let both: BTreeSet<(u32, u32)> = fine.parts().iter().copied().zip(coarse.parts().iter().copied()).collect();
            prop_assert_eq!(both.len(), fine.n_parts() as usize);
        }
    }
}
