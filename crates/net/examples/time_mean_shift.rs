//! Measures the mean shift of the shipped configs on the rows of a file, on one core, and prints processor times as JSON.
//!
//! `joined_s` is the time for these rows. `apart_s` is that for as many random rows, which never meet, so that no step becomes
//! shorter. The file holds little-endian 32-bit floating-point numbers, row after row; `tools/mean_shift/measure.py` writes it.
//!
//! ```sh
//! cargo run --release -p partprobe-net --example time_mean_shift -- ROWS.f32 128
//! ```

use partprobe_carrier::{Embeddings, keyed_rng, unit_interval};
use partprobe_net::RefineConfig;
use std::error::Error;

/// Times are the shortest of this number of calls.
const N_CALLS: usize = 3;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, dim] = arguments.as_slice() else {
        return Err("usage: time_mean_shift FILE DIM".into());
    };
    let dim: usize = dim.parse()?;
    let bytes = std::fs::read(path)?;
    let numbers = bytes.as_chunks::<4>().0.iter();
    let values: Vec<f32> = numbers.map(|&bytes| f32::from_le_bytes(bytes)).collect();

    let mut rng = keyed_rng(0, &["time"]);
    let random = values.iter().map(|_| unit_interval(&mut rng) as f32 - 0.5);
    let apart_s = shortest(&Embeddings::new(dim, random.collect())?)?;
    let joined_s = shortest(&Embeddings::new(dim, values)?)?;
    println!("{{\"joined_s\": {joined_s}, \"apart_s\": {apart_s}}}");
    Ok(())
}

/// The shortest time of a call.
fn shortest(rows: &Embeddings) -> Result<f64, Box<dyn Error>> {
    let layer = RefineConfig::default();
    let multiplicity = vec![1; rows.n_rows()];
    let mut best = f64::INFINITY;
    for _ in 0..N_CALLS {
        let begun = processor_seconds()?;
        layer.refined(rows, &multiplicity)?;
        best = best.min(processor_seconds()? - begun);
    }
    Ok(best)
}

/// Processor time of all threads in seconds, as Linux counts it.
fn processor_seconds() -> Result<f64, Box<dyn Error>> {
    let mut nanoseconds = 0.0;
    for thread in std::fs::read_dir("/proc/self/task")? {
        let text = std::fs::read_to_string(thread?.path().join("schedstat"))?;
        let first = text.split(' ').next().unwrap_or_default();
        nanoseconds += first.parse::<f64>()?;
    }
    Ok(nanoseconds / 1e9)
}
