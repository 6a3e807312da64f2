//! Clusters rows by k-means, spherical or Euclidean: the best of several seeded restarts.
//!
//! Spherical k-means is that of Dhillon and Modha 2001, "Concept decompositions for large sparse text data using
//! clustering". Each restart begins with greedy k-means++ (`seeding`) and continues with Lloyd's iteration (`lloyd`).

use crate::clusterer::{Clusterer, ClustererFactory};
use crate::clusters::{ClusterError, Clusters};
use crate::distance::unit_rows;
use crate::lloyd::Lloyd;
use crate::points::{CenterRule, Points, center_and_scale};
use crate::seeding::greedy_seeds;
use crate::settings::{ClustererSettings, KMeansSettings};
use partprobe_carrier::{Embeddings, keyed_rng};

/// The entry of the list of clusterers.
pub(crate) const FACTORY: ClustererFactory = ClustererFactory {
    name: SphericalKMeans::NAME,
    make: |settings| {
        Box::new(SphericalKMeans {
            settings: *settings,
        })
    },
};

/// Spherical k-means, the clusterer of the paper's evaluation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalKMeans {
    /// The number of restarts, and the conditions that end each of them.
    pub settings: ClustererSettings,
}

impl SphericalKMeans {
    const NAME: &'static str = "k-means";
}

impl Clusterer for SphericalKMeans {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn cluster(
        &self,
        rows: &Embeddings,
        weights: &[u32],
        k: usize,
        seed: u64,
        key: &str,
    ) -> Result<Clusters, ClusterError> {
        spherical_kmeans(rows, weights, &self.settings.for_k(k), seed, key)
    }
}

/// Spherical k-means: only the directions of the rows count, and a center is the direction of the mean of its points.
///
/// `weights` is the number of points of each row. `key` names the shape, so each shape has its own random numbers. The objective
/// is the sum, over points, of `2 - 2 cos` of the angle to the center.
///
/// # Errors
/// If the number of weights is not the number of rows, a number is not finite, or 0 clusters are requested.
pub fn spherical_kmeans(
    rows: &Embeddings,
    weights: &[u32],
    settings: &KMeansSettings,
    seed: u64,
    key: &str,
) -> Result<Clusters, ClusterError> {
    Clusters::check_input(rows, weights, settings.k)?;
    let values = unit_rows(rows.values(), rows.dim());
    let points = Points::new(values, rows.dim(), weights, CenterRule::Direction);
    Ok(best_restart(&points, settings, seed, key))
}

/// Euclidean k-means: a center is the mean of its points.
///
/// `weights` is the number of points of each row. `key` names the shape, so each shape has its own random numbers. The objective
/// is the sum, over points, of the squared distance to the center.
///
/// # Errors
/// If the number of weights is not the number of rows, a number is not finite, or 0 clusters are requested.
pub fn euclidean_kmeans(
    rows: &Embeddings,
    weights: &[u32],
    settings: &KMeansSettings,
    seed: u64,
    key: &str,
) -> Result<Clusters, ClusterError> {
    Clusters::check_input(rows, weights, settings.k)?;
    let mut values = rows.values().to_vec();
    let scale = center_and_scale(&mut values, rows.dim(), weights);
    let points = Points::new(values, rows.dim(), weights, CenterRule::Mean);
    let clusters = best_restart(&points, settings, seed, key);
    Ok(Clusters {
        objective: clusters.objective * scale * scale,
        ..clusters
    })
}

/// The restart with the lowest objective. If several are equal, it is the first one.
fn best_restart(points: &Points<'_>, settings: &KMeansSettings, seed: u64, key: &str) -> Clusters {
    let mut best = Clusters::numbered(&vec![0; points.n_rows()], f64::INFINITY);
    for restart in 0..settings.restarts.max(1) {
        let mut rng = keyed_rng(seed, &["k-means", key, &restart.to_string()]);
        let seeds = greedy_seeds(points, settings.k, &mut rng);
        if seeds.rows.is_empty() {
            // No row has a point, so there are no seeds, and all rows are in one cluster.
            return Clusters {
                objective: 0.0,
                ..best
            };
        }
        let mut lloyd = Lloyd::from_seeds(points, &seeds);
        lloyd.run(settings);
        let objective = lloyd.objective();
        if objective < best.objective {
            best = Clusters::numbered(&lloyd.assignment, objective);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rows(dim: usize, values: &[f32]) -> Embeddings {
        Embeddings::new(dim, values.to_vec()).unwrap()
    }

    #[track_caller]
    fn check(dim: usize, values: &[f32], weights: &[u32], k: usize, expected: &[u32]) {
        let clusters = euclidean_kmeans(
            &rows(dim, values),
            weights,
            &KMeansSettings::with_k(k),
            0,
            "test",
        )
        .unwrap();
        assert_eq!(clusters.assignment, expected);
        assert_eq!(
            clusters.k_found,
            expected.iter().max().map_or(0, |&max| max as usize + 1)
        );
    }

    #[test]
    fn planted_answers() {
        check(1, &[], &[], 3, &[]);
        check(1, &[1.0, 9.0, 1.5, 8.5], &[1; 4], 2, &[0, 1, 0, 1]);
        check(1, &[1.0, 1.0, 2.0], &[1; 3], 5, &[0, 0, 1]);
        check(1, &[4.0, 4.0, 4.0], &[1; 3], 2, &[0, 0, 0]);
        check(1, &[0.0, 3.0, 4.0], &[0; 3], 2, &[0, 0, 0]);
        // A hundred points at 3 keep their center there, so 2 joins them and the point at 0 is alone.
        check(1, &[0.0, 2.0, 3.0], &[1, 1, 100], 2, &[0, 1, 1]);
        check(1, &[0.0, 1.1, 3.0], &[100, 1, 1], 2, &[0, 0, 1]);
        check(
            2,
            &[1e30, 0.0, 0.0, 1e30, 1e30, 1e20],
            &[1; 3],
            2,
            &[0, 1, 0],
        );
    }

    #[test]
    fn only_directions_count_on_the_sphere() {
        let values = [1.0, 0.0, 100.0, 1.0, 0.0, 0.01, 0.0, 50.0, 0.0, 0.0];
        let clusters = spherical_kmeans(
            &rows(2, &values),
            &[1; 5],
            &KMeansSettings::with_k(2),
            3,
            "x",
        )
        .unwrap();
        assert_eq!(clusters.assignment[..4], [0, 0, 1, 1]);
    }

    /// `k` tight bundles of unit vectors around random directions, and the bundle of each.
    fn bundles(k: usize, n: usize, dim: usize, spread: f32, seed: u64) -> (Vec<f32>, Vec<usize>) {
        let mut rng = keyed_rng(seed, &["bundles"]);
        let mut uniform =
            move || (rand::Rng::next_u64(&mut rng) >> 40) as f32 / (1u64 << 23) as f32 - 1.0;
        let axes: Vec<f32> = (0..k * dim).map(|_| uniform()).collect();
        let of_row: Vec<usize> = (0..n).map(|row| row % k).collect();
        let values = of_row
            .iter()
            .flat_map(|&axis| axes[axis * dim..][..dim].to_vec());
        (values.map(|x| x + spread * uniform()).collect(), of_row)
    }

    #[test]
    fn bundles_are_found_again() {
        let (values, expected) = bundles(7, 300, 32, 0.1, 5);
        let clusters = spherical_kmeans(
            &rows(32, &values),
            &[2; 300],
            &KMeansSettings::with_k(7),
            1,
            "x",
        )
        .unwrap();
        // The rows alternate between the bundles, so the numbering by first rows is the planted numbering.
        assert!(
            clusters
                .assignment
                .iter()
                .zip(expected)
                .all(|(&found, planted)| found as usize == planted)
        );
    }

    #[test]
    fn more_restarts_never_increase_the_cost() {
        let (values, _) = bundles(12, 400, 8, 0.9, 2);
        let objective = |restarts| {
            let settings = KMeansSettings {
                restarts,
                ..KMeansSettings::with_k(12)
            };
            spherical_kmeans(&rows(8, &values), &[1; 400], &settings, 1, "x")
                .unwrap()
                .objective
        };
        assert!(objective(10) <= objective(3) && objective(3) <= objective(1));
        assert_eq!(objective(0), objective(1));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn the_end_is_a_fixed_point_of_plain_lloyd(seed in 0u64..1000, k in 1usize..9, spherical: bool) {
            let (values, _) = bundles(k, 120, 5, 1.0, seed);
            let (rows, weights) = (rows(5, &values), (0..120).map(|row| row % 4).collect::<Vec<u32>>());
            let settings = KMeansSettings::with_k(k);
            let cluster = if spherical { spherical_kmeans } else { euclidean_kmeans };
            let clusters = cluster(&rows, &weights, &settings, seed, "x").unwrap();
            prop_assert_eq!(clusters.k_found, k);
            let centers = plain_centers(&rows, &weights, &clusters.assignment, k, spherical);
            for (row, &own) in rows.rows().zip(&clusters.assignment) {
                let distances: Vec<f64> = centers.iter().map(|center| plain_distance(row, center, spherical)).collect();
                let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
                prop_assert!(distances[own as usize] <= nearest + 1e-5);
            }
        }

        #[test]
        fn a_multiplicity_counts_as_that_number_of_rows(weights in proptest::collection::vec(1u32..4, 6)) {
            let positions = [0.0f32, 0.1, 5.0, 5.1, 9.0, 9.1];
            let repeated: Vec<f32> = positions.iter().zip(&weights).flat_map(|(&x, &n)| vec![x; n as usize]).collect();
            let settings = KMeansSettings::with_k(3);
            let once = euclidean_kmeans(&rows(1, &positions), &weights, &settings, 0, "x").unwrap();
            let many = euclidean_kmeans(&rows(1, &repeated), &vec![1; repeated.len()], &settings, 0, "x").unwrap();
            prop_assert!((once.objective - many.objective).abs() < 1e-6);
            prop_assert_eq!(once.assignment, vec![0, 0, 1, 1, 2, 2]);
        }
    }

    fn plain_centers(
        rows: &Embeddings,
        weights: &[u32],
        own: &[u32],
        k: usize,
        spherical: bool,
    ) -> Vec<Vec<f64>> {
        let mut sums = vec![vec![0.0; rows.dim()]; k];
        let mut totals = vec![0.0; k];
        for ((row, &weight), &own) in rows.rows().zip(weights).zip(own) {
            let length = if spherical {
                crate::distance::norm(row)
            } else {
                1.0
            };
            totals[own as usize] += f64::from(weight);
            for (sum, &x) in sums[own as usize].iter_mut().zip(row) {
                *sum += f64::from(weight) * f64::from(x) / length;
            }
        }
        for (sum, total) in sums.iter_mut().zip(totals) {
            let length = if spherical {
                sum.iter().map(|x| x * x).sum::<f64>().sqrt()
            } else {
                total
            };
            sum.iter_mut().for_each(|x| *x /= length);
        }
        sums
    }

    fn plain_distance(row: &[f32], center: &[f64], spherical: bool) -> f64 {
        let length = if spherical {
            crate::distance::norm(row)
        } else {
            1.0
        };
        row.iter()
            .zip(center)
            .map(|(&x, c)| (f64::from(x) / length - c).powi(2))
            .sum::<f64>()
            .sqrt()
    }
}
