//! The clusterers at the size of one evaluated shape: 4 096 tokens of 128 numbers, 20 clusters.

use carrier::{Embeddings, keyed_rng};
use cluster::{KMeansSettings, average_link_cosine, spherical_kmeans};
use criterion::{Criterion, criterion_group, criterion_main};
use rand::Rng as _;
use std::hint::black_box;

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

fn clusterers(criterion: &mut Criterion) {
    let weights = vec![5; N_TOKENS];
    let settings = KMeansSettings::with_k(K);
    let mut group = criterion.benchmark_group("4096 x 128, K = 20");
    group.sample_size(10);
    for (name, spread) in [("tight", 0.3), ("loose", 1.5), ("noise", 30.0)] {
        let rows = tokens(spread);
        group.bench_function(format!("spherical k-means, 10 restarts, {name}"), |bencher| {
            bencher.iter(|| spherical_kmeans(black_box(&rows), &weights, &settings, 0, "bench"));
        });
    }
    let rows = tokens(1.5);
    group.bench_function("average link", |bencher| {
        bencher.iter(|| average_link_cosine(black_box(&rows), &weights, K));
    });
    group.finish();
}

criterion_group!(benches, clusterers);
criterion_main!(benches);
