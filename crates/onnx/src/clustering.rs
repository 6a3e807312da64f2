//! Clusters rows of features, with a choice of the number of clusters, the algorithm and the distance.

use partprobe_carrier::Embeddings;
use partprobe_cluster::{
    KMeansSettings, Silhouette, WardTree, WeightedRow, euclidean_kmeans, spherical_kmeans,
};

/// The largest number of rows for the silhouette, which needs all pairs. They are evenly spaced in their order.
const MAX_COMPARED: usize = 1000;

/// The total weight of all rows. It converts areas to multiplicities of k-means.
const WEIGHT_OF_ALL: f64 = 1e9;

/// The clustering algorithm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Algorithm {
    /// Ward linkage over small triangles that share a side.
    Ward,
    /// Ward linkage over B-Rep faces that share an edge.
    WardFaces,
    /// k-means, which does not use neighbors.
    KMeans,
}

impl Algorithm {
    /// The name in configs and reports.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Ward => "ward",
            Self::WardFaces => "ward-faces",
            Self::KMeans => "k-means",
        }
    }
}

/// The form in which rows are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Metric {
    /// Directions: each row is scaled to length 1.
    Cosine,
    /// The numbers without changes.
    Euclidean,
}

/// A rule for the number of clusters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ClusterCount {
    /// This number.
    Fixed(usize),
    /// As many as the shape has STEP parts.
    Match,
    /// The number from 2 to `max_k` with the largest mean silhouette, or 1 if no silhouette is positive.
    Silhouette { max_k: usize },
}

/// The keys `cluster`, `k` and `metric`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Clustering {
    pub(crate) algorithm: Algorithm,
    pub(crate) count: ClusterCount,
    pub(crate) metric: Metric,
}

/// Rows of finite features, and their weights.
pub(crate) struct Rows {
    pub(crate) features: Embeddings,
    pub(crate) weights: Vec<f64>,
}

/// The cluster of each row, and a text for reports about the choice of their number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Clustered {
    pub(crate) of_row: Vec<u32>,
    pub(crate) rule: String,
}

impl Clustering {
    /// Clusters rows. `neighbors` are pairs of rows, and `n_parts` is the number of STEP parts of the shape.
    ///
    /// k-means uses no neighbors, and its random numbers depend only on `seed` and `key`. Ward linkage uses no random numbers.
    pub(crate) fn of_rows(
        &self,
        rows: Rows,
        neighbors: &[[u32; 2]],
        n_parts: usize,
        seed: u64,
        key: &str,
    ) -> Clustered {
        let rows = match self.metric {
            Metric::Cosine => rows.with_unit_length(),
            Metric::Euclidean => rows,
        };
        let k = match self.count {
            ClusterCount::Fixed(k) => Choice::Known(k),
            ClusterCount::Match => Choice::Known(n_parts.max(1)),
            ClusterCount::Silhouette { max_k } => Choice::Silhouette(max_k),
        };
        let (of_row, k) = match self.algorithm {
            Algorithm::Ward | Algorithm::WardFaces => ward(&rows, neighbors, k),
            Algorithm::KMeans => {
                let draws = Draws {
                    metric: self.metric,
                    seed,
                    key,
                };
                k_means(&rows, k, &draws)
            }
        };
        let origin = match self.count {
            ClusterCount::Fixed(_) => "",
            ClusterCount::Match => " as the STEP parts",
            ClusterCount::Silhouette { .. } => " by silhouette",
        };
        Clustered {
            of_row,
            rule: format!("{}, k {k}{origin}", self.algorithm.name()),
        }
    }
}

impl Rows {
    /// The directions of the rows. A row of zeros is not changed.
    fn with_unit_length(self) -> Self {
        let dim = self.features.dim();
        let mut values = self.features.values().to_vec();
        for row in values.chunks_exact_mut(dim) {
            let squares = row.iter().map(|&x| f64::from(x) * f64::from(x));
            let length = squares.sum::<f64>().sqrt();
            if length > 0.0 {
                row.iter_mut()
                    .for_each(|x| *x = (f64::from(*x) / length) as f32);
            }
        }
        Self {
            // The same number of values in rows of the same length.
            features: Embeddings::new(dim, values).unwrap_or(self.features),
            weights: self.weights,
        }
    }

    /// Rows at even distances in their order, at most [`MAX_COMPARED`].
    fn compared(&self) -> Vec<usize> {
        let n_rows = self.features.n_rows();
        let n_compared = n_rows.min(MAX_COMPARED);
        (0..n_compared)
            .map(|number| number * n_rows / n_compared)
            .collect()
    }

    /// Whole numbers in proportion to the weights, or 1 for each row if the sum of the weights is 0 or not finite.
    fn multiplicities(&self) -> Vec<u32> {
        let total: f64 = self.weights.iter().sum();
        let scaled = |weight: &f64| (weight / total * WEIGHT_OF_ALL).round() as u32;
        if total > 0.0 && total.is_finite() {
            self.weights.iter().map(scaled).collect()
        } else {
            vec![1; self.weights.len()]
        }
    }

    fn subset(&self, indices: &[usize]) -> Self {
        Self {
            features: self.features.rows_at(indices.iter().copied()),
            weights: indices.iter().map(|&row| self.weights[row]).collect(),
        }
    }
}

/// The number of clusters, or the largest one that is tried.
#[derive(Clone, Copy)]
enum Choice {
    Known(usize),
    Silhouette(usize),
}

/// The settings of k-means, and the seed and key of its random numbers.
struct Draws<'a> {
    metric: Metric,
    seed: u64,
    key: &'a str,
}

/// The clusters of Ward linkage, and their number.
fn ward(rows: &Rows, neighbors: &[[u32; 2]], k: Choice) -> (Vec<u32>, usize) {
    let row = |(features, &weight): (&[f32], &f64)| WeightedRow {
        numbers: features
            .iter()
            .copied()
            .map(f64::from)
            .collect::<Vec<f64>>(),
        weight,
    };
    let weighted: Vec<WeightedRow<Vec<f64>>> =
        rows.features.rows().zip(&rows.weights).map(row).collect();
    let n_min = match k {
        Choice::Known(k) => k,
        Choice::Silhouette(_) => 1,
    };
    let tree = WardTree::grow(&weighted, neighbors, n_min);
    let k = match k {
        Choice::Known(k) => k,
        Choice::Silhouette(max_k) => {
            let compared = rows.compared();
            best_by_silhouette(&rows.subset(&compared), max_k, |k| {
                let of_row = tree.cut(k);
                compared.iter().map(|&row| of_row.parts()[row]).collect()
            })
        }
    };
    let clusters = tree.cut(k);
    (clusters.parts().to_vec(), clusters.n_parts() as usize)
}

/// The clusters of k-means, and their number. By silhouette, it is chosen on the compared rows.
fn k_means(rows: &Rows, k: Choice, draws: &Draws<'_>) -> (Vec<u32>, usize) {
    let k = match k {
        Choice::Known(k) => k,
        Choice::Silhouette(max_k) => {
            let compared = rows.subset(&rows.compared());
            best_by_silhouette(&compared, max_k, |k| k_clusters(&compared, k, draws))
        }
    };
    let of_row = k_clusters(rows, k, draws);
    let n_found = of_row.iter().max().map_or(0, |&last| last as usize + 1);
    (of_row, n_found)
}

fn k_clusters(rows: &Rows, k: usize, draws: &Draws<'_>) -> Vec<u32> {
    let settings = KMeansSettings {
        k,
        restarts: 4,
        max_iterations: 100,
        tolerance: 1e-4,
    };
    let algorithm = match draws.metric {
        Metric::Cosine => spherical_kmeans,
        Metric::Euclidean => euclidean_kmeans,
    };
    let weights = rows.multiplicities();
    // The rows are finite, each has a weight, and k is at least 1, so k-means does not refuse them.
    algorithm(&rows.features, &weights, &settings, draws.seed, draws.key)
        .map_or_else(|_| vec![0; weights.len()], |clusters| clusters.assignment)
}

/// The number from 2 to `max_k` whose clusters have the largest mean silhouette, or 1 if none is positive. If several are equal,
/// it is the lowest one.
fn best_by_silhouette(rows: &Rows, max_k: usize, clusters: impl Fn(usize) -> Vec<u32>) -> usize {
    let features: Vec<&[f32]> = rows.features.rows().collect();
    let silhouette = Silhouette::of_rows(&features, &rows.weights);
    let mut best = (0.0, 1);
    for k in 2..=max_k.min(features.len()) {
        let mean = silhouette.mean(&clusters(k)).unwrap_or(0.0);
        if mean > best.0 {
            best = (mean, k);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows at two angles and of several lengths, as a chain of neighbors.
    fn rows() -> Rows {
        let angles = [0.0f32, 0.01, 1.5, 1.51, 0.02, 1.49];
        let features = angles
            .iter()
            .zip(1..)
            .map(|(angle, number)| [angle.cos() * number as f32, angle.sin() * number as f32]);
        Rows {
            features: Embeddings::from_rows(features),
            weights: vec![1.0; angles.len()],
        }
    }

    const CHAIN: [[u32; 2]; 5] = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5]];

    #[track_caller]
    fn check(
        algorithm: Algorithm,
        neighbors: &[[u32; 2]],
        count: ClusterCount,
        expected: &[u32],
        rule: &str,
    ) {
        let clustering = Clustering {
            algorithm,
            count,
            metric: Metric::Cosine,
        };
        let clustered = clustering.of_rows(rows(), neighbors, 2, 0, "shape");
        let found = (&clustered.of_row[..], &clustered.rule[..]);
        assert_eq!(found, (expected, rule));
    }

    #[test]
    fn the_number_of_clusters_follows_its_rule() {
        use Algorithm::{KMeans, Ward};
        use ClusterCount::{Fixed, Match, Silhouette};
        let best = Silhouette { max_k: 5 };
        let two = [0, 0, 1, 1, 0, 1];
        check(KMeans, &[], Fixed(2), &two, "k-means, k 2");
        check(KMeans, &[], best, &two, "k-means, k 2 by silhouette");
        check(KMeans, &[], Match, &two, "k-means, k 2 as the STEP parts");
        // Both directions are connected.
        let connected = [[0, 1], [1, 4], [2, 3], [3, 5], [1, 2]];
        check(Ward, &connected, best, &two, "ward, k 2 by silhouette");
        check(Ward, &connected, Fixed(1), &[0; 6], "ward, k 1");
        // Rows of one direction that are not neighbors are not joined.
        check(Ward, &CHAIN, Fixed(4), &[0, 0, 1, 1, 2, 3], "ward, k 4");
    }

    #[test]
    fn rows_that_are_all_equal_are_one_cluster() {
        for algorithm in [Algorithm::Ward, Algorithm::WardFaces, Algorithm::KMeans] {
            for metric in [Metric::Cosine, Metric::Euclidean] {
                let clustering = Clustering {
                    algorithm,
                    count: ClusterCount::Silhouette { max_k: 9 },
                    metric,
                };
                for row in [[0.0, 0.0], [3.0, 4.0]] {
                    let rows = Rows {
                        features: Embeddings::from_rows([row; 5]),
                        weights: vec![0.0; 5],
                    };
                    let clustered = clustering.of_rows(rows, &CHAIN[..4], 3, 0, "shape");
                    assert_eq!(clustered.of_row, [0; 5]);
                }
            }
        }
    }

    #[test]
    fn lengths_count_only_without_cosine() {
        let clusters = |metric| {
            let clustering = Clustering {
                algorithm: Algorithm::KMeans,
                count: ClusterCount::Fixed(2),
                metric,
            };
            let rows = Rows {
                features: Embeddings::from_rows([[1.0, 0.0], [9.0, 1.0], [1.0, 1.0], [9.0, 9.0]]),
                weights: vec![1.0; 4],
            };
            clustering.of_rows(rows, &[], 1, 0, "shape").of_row
        };
        assert_eq!(clusters(Metric::Cosine), [0, 0, 1, 1]);
        assert_ne!(clusters(Metric::Euclidean), [0, 0, 1, 1]);
    }
}
