//! Measures how well clusters are separated: the silhouette of Rousseeuw 1987, "Silhouettes: a graphical aid to the
//! interpretation and validation of cluster analysis".
//!
//! Weighted rows go in once, then any number of clusterings of them. All distances are stored, so memory and time are O(n²). A
//! caller with many rows should pass a sample of them.

/// The distances between all rows, by which clusterings are measured.
///
/// ```
/// use partprobe_cluster::Silhouette;
///
/// let rows = [[0.0f32], [0.1], [5.0], [5.1]];
/// let silhouette = Silhouette::of_rows(&rows, &[1.0; 4]);
/// let good = silhouette.mean(&[0, 0, 1, 1]);
/// let bad = silhouette.mean(&[0, 1, 0, 1]);
/// assert!(good > Some(0.9) && bad < Some(0.0));
/// assert_eq!(silhouette.mean(&[0, 0, 0, 0]), None);
/// ```
#[derive(Clone, Debug)]
pub struct Silhouette {
    /// The distance of each pair, row by row.
    distances: Vec<f32>,
    weights: Vec<f64>,
}

impl Silhouette {
    /// Measures the Euclidean distance of each pair. A row without a weight counts 1.
    #[must_use]
    pub fn of_rows<R: AsRef<[f32]>>(rows: &[R], weights: &[f64]) -> Self {
        let distance = |a: &R, b: &R| -> f32 {
            let pairs = a.as_ref().iter().zip(b.as_ref());
            pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt()
        };
        let distances = rows
            .iter()
            .flat_map(|a| rows.iter().map(move |b| distance(a, b)))
            .collect();
        let weights = (0..rows.len()).map(|row| weights.get(row).copied().unwrap_or(1.0));
        Self {
            distances,
            weights: weights.collect(),
        }
    }

    /// The weighted mean silhouette of the rows, from -1 to 1, or `None` if there are fewer than two clusters.
    ///
    /// The silhouette of a row compares its mean distance `a` to its own cluster with that to the nearest other
    /// cluster, `b`: it is `(b - a) / max(a, b)`, and 0 for the only row of a cluster. Rows that `cluster_of_row` does
    /// not name are left out.
    #[must_use]
    pub fn mean(&self, cluster_of_row: &[u32]) -> Option<f64> {
        let n_clusters = cluster_of_row
            .iter()
            .max()
            .map_or(0, |&last| last as usize + 1);
        let mut weight_of_cluster = vec![0.0; n_clusters];
        for (&cluster, weight) in cluster_of_row.iter().zip(&self.weights) {
            weight_of_cluster[cluster as usize] += weight;
        }
        let is_used = |weight: &&f64| **weight > 0.0;
        if weight_of_cluster.iter().filter(is_used).count() < 2 {
            return None;
        }

        let mut sum = 0.0;
        let mut total = 0.0;
        for (row, (&own, &weight)) in cluster_of_row.iter().zip(&self.weights).enumerate() {
            let to_clusters = self.distances_to_clusters(row, cluster_of_row, n_clusters);
            let of_row = Distances {
                to_clusters: &to_clusters,
                weight_of_cluster: &weight_of_cluster,
            };
            sum += weight * of_row.silhouette(own as usize, weight);
            total += weight;
        }
        Some(sum / total)
    }

    /// The weighted sum of the distances of a row to the rows of each cluster.
    fn distances_to_clusters(
        &self,
        row: usize,
        cluster_of_row: &[u32],
        n_clusters: usize,
    ) -> Vec<f64> {
        let n_rows = self.weights.len();
        let distances = &self.distances[row * n_rows..][..n_rows];
        let mut sums = vec![0.0; n_clusters];
        for ((&cluster, weight), &distance) in
            cluster_of_row.iter().zip(&self.weights).zip(distances)
        {
            sums[cluster as usize] += weight * f64::from(distance);
        }
        sums
    }
}

/// The distances of one row to all clusters.
struct Distances<'a> {
    to_clusters: &'a [f64],
    weight_of_cluster: &'a [f64],
}

impl Distances<'_> {
    fn silhouette(&self, own: usize, weight: f64) -> f64 {
        let weight_of_others = self.weight_of_cluster[own] - weight;
        if weight_of_others <= 0.0 {
            return 0.0;
        }
        let within = self.to_clusters[own] / weight_of_others;
        let to_nearest = (0..self.to_clusters.len())
            .filter(|&cluster| cluster != own && self.weight_of_cluster[cluster] > 0.0)
            .map(|cluster| self.to_clusters[cluster] / self.weight_of_cluster[cluster])
            .fold(f64::INFINITY, f64::min);
        let larger = within.max(to_nearest);
        if larger > 0.0 {
            (to_nearest - within) / larger
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(values: &[f32], weights: &[f64], clusters: &[u32], expected: Option<f64>) {
        let rows: Vec<[f32; 1]> = values.iter().map(|&value| [value]).collect();
        let found = Silhouette::of_rows(&rows, weights).mean(clusters);
        let is_equal = match (found, expected) {
            (Some(found), Some(expected)) => (found - expected).abs() < 1e-6,
            (found, expected) => found == expected,
        };
        assert!(is_equal, "{found:?} {expected:?}");
    }

    #[test]
    fn silhouettes_of_few_rows_are_those_of_the_definition() {
        check(&[], &[], &[], None);
        check(&[1.0, 2.0], &[1.0; 2], &[0, 0], None);
        // Each row is alone in its cluster.
        check(&[1.0, 2.0], &[1.0; 2], &[0, 1], Some(0.0));
        // a = 1 and b = 4.5 or 3.5 at the left, the same at the right.
        check(
            &[0.0, 1.0, 4.0, 5.0],
            &[1.0; 4],
            &[0, 0, 1, 1],
            Some((3.5 / 4.5 + 2.5 / 3.5) / 2.0),
        );
        // Equal rows in two clusters are neither well nor badly placed.
        check(&[3.0; 4], &[1.0; 4], &[0, 0, 1, 1], Some(0.0));
        // A cluster without weight does not count.
        check(&[0.0, 1.0, 4.0], &[1.0, 1.0, 0.0], &[0, 0, 1], None);
        // A cluster number that no row has changes nothing.
        check(&[1.0, 2.0], &[1.0; 2], &[0, 7], Some(0.0));
    }

    proptest! {
        #[test]
        fn the_mean_is_between_its_bounds_and_does_not_depend_on_numbering(
            rows in proptest::collection::vec((-9.0f32..9.0, -9.0f32..9.0, 0.1f64..3.0, 0u32..4), 2..40),
        ) {
            let points: Vec<[f32; 2]> = rows.iter().map(|&(x, y, ..)| [x, y]).collect();
            let weights: Vec<f64> = rows.iter().map(|row| row.2).collect();
            let clusters: Vec<u32> = rows.iter().map(|row| row.3).collect();
            let renumbered: Vec<u32> = clusters.iter().map(|cluster| 3 - cluster).collect();
            let silhouette = Silhouette::of_rows(&points, &weights);
            let mean = silhouette.mean(&clusters);
            prop_assert!(mean.is_none_or(|mean| (-1.0..=1.0).contains(&mean)));
            let other = silhouette.mean(&renumbered);
            prop_assert_eq!(mean.is_some(), other.is_some());
            prop_assert!((mean.unwrap_or(0.0) - other.unwrap_or(0.0)).abs() < 1e-9);
        }
    }
}
