//! Clusters the rows of a file by Euclidean and by spherical k-means on one core, and prints processor times and objectives as
//! JSON.
//!
//! The file holds little-endian 32-bit floating-point numbers, row after row. `tools/kmeans/compare.py` writes it and compares the
//! numbers with those of scikit-learn.
//!
//! ```sh
//! cargo run --release -p partprobe-cluster --example time_kmeans -- ROWS.f32 128 20 10
//! ```

use partprobe_carrier::Embeddings;
use partprobe_cluster::{
    ClusterError, Clusters, KMeansSettings, euclidean_kmeans, spherical_kmeans,
};
use std::error::Error;

/// Times are the shortest of this number of calls.
const N_CALLS: usize = 5;

type KMeans = fn(&Embeddings, &[u32], &KMeansSettings, u64, &str) -> Result<Clusters, ClusterError>;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, numbers @ ..] = arguments.as_slice() else {
        return Err("usage: time_kmeans FILE DIM K RESTARTS".into());
    };
    let numbers: Vec<usize> = numbers
        .iter()
        .map(|text| text.parse())
        .collect::<Result<_, _>>()?;
    let &[dim, k, restarts] = numbers.as_slice() else {
        return Err("usage: time_kmeans FILE DIM K RESTARTS".into());
    };
    let bytes = std::fs::read(path)?;
    let values = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|&bytes| f32::from_le_bytes(bytes));
    let rows = Embeddings::new(dim, values.collect())?;
    let settings = KMeansSettings {
        restarts,
        ..KMeansSettings::with_k(k)
    };

    let kinds: [(&str, KMeans); 2] = [
        ("euclidean", euclidean_kmeans),
        ("spherical", spherical_kmeans),
    ];
    let mut fields = Vec::new();
    for (name, kmeans) in kinds {
        let (seconds, objective) = shortest(kmeans, &rows, &settings)?;
        fields.push(format!(
            "\"{name}_s\": {seconds}, \"{name}_objective\": {objective}"
        ));
    }
    println!("{{{}}}", fields.join(", "));
    Ok(())
}

/// The shortest time of a call, and the objective.
fn shortest(
    kmeans: KMeans,
    rows: &Embeddings,
    settings: &KMeansSettings,
) -> Result<(f64, f64), ClusterError> {
    let weights = vec![1; rows.n_rows()];
    let mut best = f64::INFINITY;
    let mut objective = 0.0;
    for _ in 0..N_CALLS {
        let begun = processor_seconds();
        objective = kmeans(rows, &weights, settings, 0, "time")?.objective;
        best = best.min(processor_seconds() - begun);
    }
    Ok((best, objective))
}

/// Processor time of this thread in seconds, as Linux counts it. It is 0 on other systems.
fn processor_seconds() -> f64 {
    let nanoseconds = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let first = nanoseconds.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    first.unwrap_or(0.0) / 1e9
}
