//! Measures the clusterers at the size of one evaluated shape: 4 096 tokens of 128 numbers, 20 clusters; or 20 000 points.

use divan::Bencher;
use partprobe_carrier::{Embeddings, Point, keyed_rng, nearest_points};
use partprobe_cluster::{KMeansSettings, RegionGrowing, average_link_cosine, spherical_kmeans};
use rand::Rng as _;
use std::hint::black_box;

fn main() {
    divan::main();
}

const N_TOKENS: usize = 4096;
const DIM: usize = 128;
const K: usize = 20;

/// Tokens around `K` random directions, in clusters of very different sizes. `spread` is the noise relative to the direction's
/// length.
fn tokens(spread: f32) -> Embeddings {
    let mut rng = keyed_rng(0, &["bench"]);
    let mut uniform = move || (rng.next_u64() >> 40) as f32 / (1u64 << 23) as f32 - 1.0;
    let axes: Vec<f32> = (0..K * DIM).map(|_| uniform()).collect();
    let values = (0..N_TOKENS).flat_map(|token| {
        // The sizes of the clusters differ strongly, like those of the faces of real parts.
        let share = (token as f32 / N_TOKENS as f32).powi(2);
        let axis = (share * K as f32) as usize;
        axes[axis * DIM..][..DIM].to_vec()
    });
    let noisy = values.map(|x| x + spread * uniform()).collect();
    Embeddings::new(DIM, noisy).expect("whole rows")
}

/// Measures ten restarts. The argument is the noise: 0.3 gives tight clusters, 1.5 loose ones, and 30 only noise.
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

/// Measures all steps of the row `growing-20`: the nearest points, the regions, and the assignment of the other points.
#[divan::bench(sample_count = 10)]
fn region_growing(bencher: Bencher<'_, '_>) {
    let mut rng = keyed_rng(0, &["bench"]);
    let mut uniform = move || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    // A cube: each point lies on the side that its number names.
    let mut normals: Vec<Point> = Vec::new();
    let points: Vec<Point> = (0..20_000)
        .map(|idx| {
            let (axis, side) = (idx % 3, f64::from(idx / 3 % 2));
            let mut normal = [0.0; 3];
            normal[axis as usize] = 2.0 * side - 1.0;
            normals.push(normal);
            let mut point = [uniform(), uniform(), uniform()];
            point[axis as usize] = side;
            point
        })
        .collect();
    let growing = RegionGrowing {
        max_angle_deg: 20.0,
    };
    bencher.bench(|| {
        let neighbors = nearest_points(black_box(&points), 10);
        growing.regions(&neighbors, &normals).largest(&points, 6)
    });
}
