//! Tests our Euclidean k-means against that of linfa, a machine-learning library that shares no code with it.
//!
//! `cargo test --release -p partprobe-tests --features linfa --test linfa` runs it.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot make its own rows has failed"
)]

use linfa::DatasetBase;
use linfa::traits::Fit;
use linfa_clustering::KMeans;
use ndarray::Array2;
use partprobe_carrier::{Embeddings, Rng, keyed_rng};
use partprobe_cluster::{KMeansSettings, euclidean_kmeans};
use proptest::prelude::*;
use rand::Rng as _;

const DIM: usize = 4;
const N_ROWS: usize = 240;

/// A number between -1 and 1.
fn uniform(rng: &mut Rng) -> f32 {
    (rng.next_u64() >> 40) as f32 / (1u64 << 23) as f32 - 1.0
}

/// Rows around `k` random centers between -1 and 1; `spread` is the largest distance per axis.
fn blobs(k: usize, spread: f32, seed: u64) -> Embeddings {
    let mut rng = keyed_rng(seed, &["blobs"]);
    let centers: Vec<f32> = (0..k * DIM).map(|_| uniform(&mut rng)).collect();
    let mut values = Vec::with_capacity(N_ROWS * DIM);
    for row in 0..N_ROWS {
        let center = &centers[row % k * DIM..][..DIM];
        values.extend(center.iter().map(|x| x + spread * uniform(&mut rng)));
    }
    Embeddings::new(DIM, values).unwrap()
}

/// The sum of the squared distances to the centers that linfa finds with the same number of restarts and iterations.
fn objective_of_linfa(rows: &Embeddings, settings: &KMeansSettings) -> f64 {
    let values = rows.values().iter().map(|&x| f64::from(x)).collect();
    let records = Array2::from_shape_vec((rows.n_rows(), DIM), values).unwrap();
    let model = KMeans::params(settings.k)
        .n_runs(settings.restarts)
        .max_n_iterations(settings.max_iterations as u64)
        .tolerance(settings.tolerance)
        .fit(&DatasetBase::from(records))
        .unwrap();
    model.inertia() * rows.n_rows() as f64
}

fn our_objective(rows: &Embeddings, settings: &KMeansSettings) -> f64 {
    let weights = vec![1; rows.n_rows()];
    euclidean_kmeans(rows, &weights, settings, 0, "blobs")
        .unwrap()
        .objective
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn compact_blobs_have_the_same_objective(seed in 0u64..1_000_000, k in 2usize..7) {
        let rows = blobs(k, 0.05, seed);
        let settings = KMeansSettings::with_k(k);
        let ours = our_objective(&rows, &settings);
        let theirs = objective_of_linfa(&rows, &settings);
        prop_assert!((ours / theirs - 1.0).abs() < 1e-6, "{ours} against {theirs}");
    }

    // Both end in local minima here, and not always in the same one.
    #[test]
    fn overlapping_blobs_have_nearly_the_same_objective(seed in 0u64..1_000_000, k in 2usize..13) {
        let rows = blobs(k, 1.0, seed);
        let settings = KMeansSettings::with_k(k);
        let ours = our_objective(&rows, &settings);
        let theirs = objective_of_linfa(&rows, &settings);
        prop_assert!((ours / theirs - 1.0).abs() < 0.05, "{ours} against {theirs}");
    }
}
