//! Measures the clusterers at the size of one evaluated shape: 4 096 tokens of 128 numbers, 20 clusters.

use divan::Bencher;
use partprobe_carrier::{Embeddings, keyed_rng};
use partprobe_cluster::{KMeansSettings, average_link_cosine, spherical_kmeans};
use rand::Rng as _;
use std::hint::black_box;

fn main() {
    divan::main();
}

const N_TOKENS: usize = 4096;
const DIM: usize = 128;
const K: usize = 20;

/// Tokens around `K` random directions of very different sizes; `spread` is the noise against the direction's length.
fn tokens(spread: f32) -> Embeddings {
    let mut rng = keyed_rng(0, &["bench"]);
    let mut uniform = move || (rng.next_u64() >> 40) as f32 / (1u64 << 23) as f32 - 1.0;
    let axes: Vec<f32> = (0..K * DIM).map(|_| uniform()).collect();
    let values = (0..N_TOKENS).flat_map(|token| {
        // Cluster j holds a share that falls with j², as the faces of real parts do.
        let share = (token as f32 / N_TOKENS as f32).powi(2);
        let axis = (share * K as f32) as usize;
        axes[axis * DIM..][..DIM].to_vec()
    });
    let noisy = values.map(|x| x + spread * uniform()).collect();
    Embeddings::new(DIM, noisy).expect("whole rows")
}

/// Ten restarts; the argument is the noise: 0.3 is tight, 1.5 loose, 30 noise alone.
#[divan::bench(args = [0.3, 1.5, 30.0], sample_count = 10)]
fn spherical_k_means(bencher: Bencher<'_, '_>, spread: f32) {
    let (rows, weights, settings) = (tokens(spread), vec![5; N_TOKENS], KMeansSettings::with_k(K));
    bencher.bench(|| spherical_kmeans(black_box(&rows), &weights, &settings, 0, "bench"));
}

#[divan::bench(sample_count = 10)]
fn average_link(bencher: Bencher<'_, '_>) {
    let (rows, weights) = (tokens(1.5), vec![5; N_TOKENS]);
    bencher.bench(|| average_link_cosine(black_box(&rows), &weights, K));
}
