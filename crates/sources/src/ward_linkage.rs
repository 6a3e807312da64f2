//! Links clusters over a graph by Ward's rule: the two neighbors whose union adds least to the sum of squares merge,
//! again and again.
//!
//! In go weighted rows and the pairs that are neighbors, out comes the cluster of each row (Ward 1963, with the
//! connectivity constraint of structured clustering). The order of merges does not depend on the number of clusters,
//! so the clusters for a smaller number are unions of those for a larger one.

use partprobe_carrier::Partition;
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

/// The numbers that describe one row.
pub(crate) type Row = [f64; 6];

#[derive(Clone, Debug)]
struct Cluster {
    weight: f64,
    mean: Row,
    neighbors: BTreeSet<u32>,
    /// How often it has grown; a candidate of an earlier state is out of date.
    version: u32,
}

impl Cluster {
    /// How much the weighted sum of squares grows if the two become one.
    fn cost(&self, other: &Self) -> f64 {
        let total = self.weight + other.weight;
        let share = if total > 0.0 {
            self.weight * other.weight / total
        } else {
            0.0
        };
        share * squared_distance(&self.mean, &other.mean)
    }
}

fn squared_distance(a: &Row, b: &Row) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Two neighbors in a certain state. Costs are not negative, so their bits sort as they do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    cost: u64,
    clusters: [u32; 2],
    versions: [u32; 2],
}

/// Merges until at most `n_max` clusters are left. `rows` and `weights` must be finite, weights not negative.
///
/// Once nothing is connected any more, the lightest cluster joins the one with the nearest mean.
pub(crate) fn ward(
    rows: &[Row],
    weights: &[f64],
    neighbors: &[[u32; 2]],
    n_max: usize,
) -> Partition {
    let mut tree = Ward::new(rows, weights, neighbors);
    tree.merge_neighbors(n_max.max(1));
    tree.merge_unconnected(n_max.max(1));
    Partition::from_joined_pairs(rows.len(), tree.merges)
}

struct Ward {
    clusters: Vec<Cluster>,
    candidates: BinaryHeap<Reverse<Candidate>>,
    living: BTreeSet<u32>,
    merges: Vec<[u32; 2]>,
}

impl Ward {
    fn new(rows: &[Row], weights: &[f64], neighbors: &[[u32; 2]]) -> Self {
        let alone = |(&mean, &weight): (&Row, &f64)| Cluster {
            weight,
            mean,
            neighbors: BTreeSet::new(),
            version: 0,
        };
        let mut clusters: Vec<Cluster> = rows.iter().zip(weights).map(alone).collect();
        for &[a, b] in neighbors.iter().filter(|[a, b]| a != b) {
            clusters[a as usize].neighbors.insert(b);
            clusters[b as usize].neighbors.insert(a);
        }

        let living = (0..).take(clusters.len()).collect();
        let mut ward = Self {
            clusters,
            candidates: BinaryHeap::new(),
            living,
            merges: Vec::new(),
        };
        for a in 0..ward.clusters.len() as u32 {
            for b in ward.clusters[a as usize].neighbors.clone().range(a + 1..) {
                ward.propose(a, *b);
            }
        }
        ward
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
                    &self.clusters[*other as usize].mean,
                    &self.clusters[lightest as usize].mean,
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

    /// The second cluster becomes a piece of the first.
    fn merge(&mut self, [into, from]: [u32; 2]) {
        self.merges.push([into, from]);
        self.living.remove(&from);
        let gone_neighbors = std::mem::take(&mut self.clusters[from as usize].neighbors);
        let (gone_weight, gone_mean) = (
            self.clusters[from as usize].weight,
            self.clusters[from as usize].mean,
        );

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
        for (mean, gone) in grown.mean.iter_mut().zip(gone_mean) {
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

    fn row(x: f64) -> Row {
        [x, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    #[track_caller]
    fn check(
        values: &[f64],
        weights: &[f64],
        neighbors: &[[u32; 2]],
        n_max: usize,
        expected: &[u32],
    ) {
        let rows: Vec<Row> = values.iter().copied().map(row).collect();
        assert_eq!(ward(&rows, weights, neighbors, n_max).parts(), expected);
    }

    #[test]
    fn the_cheapest_neighbors_merge_first() {
        let chain = [[0, 1], [1, 2], [2, 3]];
        check(&[], &[], &[], 2, &[]);
        check(&[0.0, 0.1, 5.0, 5.1], &[1.0; 4], &chain, 2, &[0, 0, 1, 1]);
        check(&[0.0, 0.1, 5.0, 5.1], &[1.0; 4], &chain, 4, &[0, 1, 2, 3]);
        // Equal values that are not neighbors stay apart.
        check(&[0.0, 5.0, 0.0, 5.0], &[1.0; 4], &chain, 3, &[0, 0, 1, 2]);
        // The gap of 1 between heavy rows costs 50, the gap of 3 beside a light one costs about 9.
        check(
            &[0.0, 1.0, 4.0],
            &[100.0, 100.0, 1.0],
            &chain[..2],
            2,
            &[0, 1, 1],
        );
        // Nothing is connected: the lightest joins the nearest.
        check(&[0.0, 5.0, 4.0], &[2.0, 3.0, 1.0], &[], 2, &[0, 1, 1]);
        check(&[0.0, 5.0, 4.0], &[0.0; 3], &[], 0, &[0, 0, 0]);
    }

    proptest! {
        #[test]
        fn the_bound_holds_and_levels_are_nested(
            values in proptest::collection::vec((0.0f64..9.0, 0.0f64..3.0), 1..30),
            pairs in proptest::collection::vec((0u32..30, 0u32..30), 0..60),
            n_max in 1usize..30,
        ) {
            let n = values.len() as u32;
            let rows: Vec<Row> = values.iter().map(|&(x, _)| row(x)).collect();
            let weights: Vec<f64> = values.iter().map(|&(_, weight)| weight).collect();
            let pairs: Vec<[u32; 2]> = pairs.into_iter().map(|(a, b)| [a % n, b % n]).collect();
            let fine = ward(&rows, &weights, &pairs, n_max + 1);
            let coarse = ward(&rows, &weights, &pairs, n_max);
            prop_assert_eq!(coarse.n_parts() as usize, n_max.min(values.len()));
            let both: BTreeSet<(u32, u32)> = fine.parts().iter().copied().zip(coarse.parts().iter().copied()).collect();
            prop_assert_eq!(both.len(), fine.n_parts() as usize);
        }
    }
}
