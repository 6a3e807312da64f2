//! Clusters rows by average link: repeatedly merges the two clusters whose points have the largest mean cosine.
//!
//! The mean cosine between two clusters is the scalar product of their mean unit vectors, so no matrix of similarities is needed:
//! memory is that of the rows, and time is O(n² · dim). The order of the merges is that of the nearest-neighbor chain (Murtagh
//! 1983, "A survey of recent advances in hierarchical clustering algorithms").

use crate::clusterer::{Clusterer, ClustererFactory};
use crate::clusters::{ClusterError, Clusters};
use crate::distance::{product, unit_rows};
use crate::vector_unit::{Kernel, vectorized};
use partprobe_carrier::Embeddings;

/// The entry of the list of clusterers.
pub(crate) const FACTORY: ClustererFactory = ClustererFactory {
    name: AverageLink::NAME,
    make: |_settings| Box::new(AverageLink),
};

/// Average link on cosines. Unlike k-means, it isolates a small cluster rather than split a large one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AverageLink;

impl AverageLink {
    const NAME: &'static str = "average-link";
}

impl Clusterer for AverageLink {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn cluster(
        &self,
        rows: &Embeddings,
        weights: &[u32],
        k: usize,
        _seed: u64,
        _key: &str,
    ) -> Result<Clusters, ClusterError> {
        average_link_cosine(rows, weights, k)
    }
}

/// One merge of two clusters, each named by one of its rows.
#[derive(Clone, Copy, Debug)]
struct Merge {
    rows: [usize; 2],
    cosine: f32,
}

/// The average-link tree of rows: every merge, down to one cluster.
#[derive(Clone, Debug)]
pub struct AverageLinkTree {
    n_rows: usize,
    /// The merges. The one with the largest mean cosine comes first.
    merges: Vec<Merge>,
}

impl AverageLinkTree {
    /// Merges the rows by the mean cosine of their points. `weights` is the number of points of each row. No random numbers are
    /// needed.
    ///
    /// # Errors
    /// If the number of weights is not the number of rows, or a number is not finite.
    pub fn new(rows: &Embeddings, weights: &[u32]) -> Result<Self, ClusterError> {
        Clusters::check_input(rows, weights, 1)?;
        let mut merges = Chain::new(rows, weights).merges();
        merges.sort_by(|a, b| b.cosine.total_cmp(&a.cosine));
        Ok(Self {
            n_rows: rows.n_rows(),
            merges,
        })
    }

    /// The number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// The merges in their order, each as a row of one cluster and a row of the other.
    pub fn merges(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.merges
            .iter()
            .map(|merge| merge.rows.map(|row| row as u32))
    }

    /// The clusters of the cut with `k` of them, or as many as there are rows. The objective is the sum of
    /// `1 - mean cosine` over the merges.
    #[must_use]
    pub fn cut(&self, k: usize) -> Clusters {
        let n_merges = self.n_rows.saturating_sub(k.max(1));
        let merges = &self.merges[..n_merges.min(self.merges.len())];
        let groups = groups_after(merges, self.n_rows);
        let objective = merges
            .iter()
            .map(|merge| 1.0 - f64::from(merge.cosine))
            .sum();
        Clusters::numbered(&groups, objective)
    }
}

/// Cuts the average-link tree of the rows' cosines at `k` clusters.
///
/// `weights` is the number of points of each row. The objective is the sum of `1 - mean cosine` over the merges. No random
/// numbers are needed.
///
/// # Errors
/// If the number of weights is not the number of rows, a number is not finite, or 0 clusters are requested.
pub fn average_link_cosine(
    rows: &Embeddings,
    weights: &[u32],
    k: usize,
) -> Result<Clusters, ClusterError> {
    Clusters::check_input(rows, weights, k)?;
    Ok(AverageLinkTree::new(rows, weights)?.cut(k))
}

/// The group of each row after the merges, named by its lowest row.
fn groups_after(merges: &[Merge], n_rows: usize) -> Vec<u32> {
    let mut roots: Vec<usize> = (0..n_rows).collect();
    for merge in merges {
        let [a, b] = merge.rows.map(|row| root(&roots, row));
        roots[a.max(b)] = a.min(b);
    }
    (0..n_rows).map(|row| root(&roots, row) as u32).collect()
}

fn root(roots: &[usize], mut row: usize) -> usize {
    while roots[row] != row {
        row = roots[row];
    }
    row
}

/// The nearest-neighbor chain: each link is the nearest cluster of the previous link. Two clusters that are each other's nearest
/// merge at once. Average link is reducible (a merged cluster is not nearer to a third one than the nearer of its halves was), so
/// the tree is the same as that of merging in global order.
struct Chain {
    dim: usize,
    /// Mean unit vector of each living cluster, at the index of the row that names it.
    means: Vec<f32>,
    weights: Vec<f64>,
    living: Vec<usize>,
    links: Vec<usize>,
    is_link: Vec<bool>,
}

impl Chain {
    fn new(rows: &Embeddings, weights: &[u32]) -> Self {
        Self {
            dim: rows.dim(),
            means: unit_rows(rows.values(), rows.dim()),
            weights: weights.iter().map(|&weight| f64::from(weight)).collect(),
            living: (0..rows.n_rows()).collect(),
            links: Vec::new(),
            is_link: vec![false; rows.n_rows()],
        }
    }

    /// Merges until one cluster is left.
    fn merges(self) -> Vec<Merge> {
        vectorized(Merging(self))
    }

    #[inline(always)]
    fn merged(mut self) -> Vec<Merge> {
        let mut merges = Vec::new();
        while self.living.len() > 1 {
            let Some(&last) = self.links.last() else {
                self.push(self.living[0]);
                continue;
            };
            let before = self.links.len().checked_sub(2).map(|at| self.links[at]);
            let (nearest, cosine) = self.nearest(last, before);
            if Some(nearest) == before {
                merges.push(Merge {
                    rows: [last, nearest],
                    cosine,
                });
                self.merge(last, nearest);
            } else {
                self.push(nearest);
            }
        }
        merges
    }

    #[inline(always)]
    fn push(&mut self, cluster: usize) {
        self.links.push(cluster);
        self.is_link[cluster] = true;
    }

    #[inline(always)]
    fn mean(&self, cluster: usize) -> &[f32] {
        &self.means[cluster * self.dim..][..self.dim]
    }

    /// The living cluster nearest to `last` and their cosine. If several are equal, the previous link is preferred, then the
    /// lowest one.
    #[inline(always)]
    fn nearest(&self, last: usize, before: Option<usize>) -> (usize, f32) {
        let cosine_to = |other: usize| product(self.mean(last), self.mean(other));
        let mut nearest = before.unwrap_or(last);
        let mut largest = before.map_or(f32::NEG_INFINITY, cosine_to);
        for &other in &self.living {
            // Older links are not candidates. Only rounding could make one of them the nearest, and then the chain
            // would be a ring.
            if other == last || self.is_link[other] {
                continue;
            }
            let cosine = cosine_to(other);
            if largest < cosine {
                nearest = other;
                largest = cosine;
            }
        }
        (nearest, largest)
    }

    /// Joins the last two links. The lower of their rows names the result.
    fn merge(&mut self, a: usize, b: usize) {
        let into = a.min(b);
        let from = a.max(b);
        self.links.truncate(self.links.len() - 2);
        self.is_link[a] = false;
        self.is_link[b] = false;
        let total = self.weights[into] + self.weights[from];
        let fraction = if total > 0.0 {
            self.weights[from] / total
        } else {
            0.5
        };
        for at in 0..self.dim {
            let x = f64::from(self.means[into * self.dim + at]);
            let y = f64::from(self.means[from * self.dim + at]);
            self.means[into * self.dim + at] = (x + fraction * (y - x)) as f32;
        }

        self.weights[into] = total;
        if let Ok(at) = self.living.binary_search(&from) {
            self.living.remove(at);
        }
    }
}

/// The loop over all merges.
struct Merging(Chain);

impl Kernel for Merging {
    type Output = Vec<Merge>;

    #[inline(always)]
    fn run(self) -> Vec<Merge> {
        self.0.merged()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(angles_deg: &[f64], weights: &[u32], k: usize, expected: &[u32]) {
        let values = angles_deg
            .iter()
            .map(|angle| angle.to_radians())
            .flat_map(|a| [a.cos() as f32, a.sin() as f32]);
        let rows = Embeddings::new(2, values.collect()).unwrap();
        assert_eq!(
            average_link_cosine(&rows, weights, k).unwrap().assignment,
            expected
        );
    }

    #[test]
    fn planted_answers() {
        check(&[], &[], 2, &[]);
        check(&[10.0], &[1], 2, &[0]);
        check(&[0.0, 90.0, 1.0, 91.0], &[1; 4], 2, &[0, 1, 0, 1]);
        check(&[0.0, 0.0, 0.0], &[1; 3], 1, &[0, 0, 0]);
        check(&[0.0, 1.0, 40.0, 100.0], &[1; 4], 3, &[0, 0, 1, 2]);
        // 20° lies between 0° and 42°; a heavy neighbor at -9° pulls the mean of the left cluster away from it.
        check(&[0.0, 20.0, 42.0], &[1; 3], 2, &[0, 0, 1]);
        check(&[-9.0, 0.0, 20.0, 42.0], &[100, 1, 1, 1], 2, &[0, 0, 1, 1]);
    }

    proptest! {
        #[test]
        fn merging_in_global_order_gives_the_same_tree(
            angles in proptest::collection::vec((0.0f64..360.0, 1u32..4), 2..14),
            k in 1usize..6,
        ) {
            let values = angles.iter().flat_map(|(angle, _)| [angle.to_radians().cos() as f32, angle.to_radians().sin() as f32]);
            let rows = Embeddings::new(2, values.collect()).unwrap();
            let weights: Vec<u32> = angles.iter().map(|&(_, weight)| weight).collect();
            let found = average_link_cosine(&rows, &weights, k).unwrap();
            prop_assert_eq!(found.k_found, k.min(angles.len()));
            prop_assert_eq!(found.assignment, by_definition(&rows, &weights, k));
        }
    }

    /// Average link by its definition, over all pairs of points.
    fn by_definition(rows: &Embeddings, weights: &[u32], k: usize) -> Vec<u32> {
        let mut groups: Vec<Vec<usize>> = (0..rows.n_rows()).map(|row| vec![row]).collect();
        let total = |group: &[usize]| {
            group
                .iter()
                .map(|&row| f64::from(weights[row]))
                .sum::<f64>()
        };
        let cosine = |a: &[usize], b: &[usize]| {
            let pairs = a.iter().flat_map(|&i| b.iter().map(move |&j| (i, j)));
            let sum: f64 = pairs
                .map(|(i, j)| {
                    f64::from(weights[i] * weights[j])
                        * f64::from(product(rows.row(i), rows.row(j)))
                })
                .sum();
            sum / (total(a) * total(b))
        };
        while groups.len() > k {
            let pairs = (0..groups.len()).flat_map(|a| (a + 1..groups.len()).map(move |b| (a, b)));
            let best = pairs
                .map(|(a, b)| (cosine(&groups[a], &groups[b]), a, b))
                .max_by(|x, y| x.0.total_cmp(&y.0));
            let (_, a, b) = best.unwrap();
            let merged = groups.remove(b);
            groups[a].extend(merged);
        }
        let mut of_row = vec![0; rows.n_rows()];
        for (group, members) in (0u32..).zip(&groups) {
            members.iter().for_each(|&row| of_row[row] = group);
        }
        Clusters::numbered(&of_row, 0.0).assignment
    }
}
