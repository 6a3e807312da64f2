//! Measures updates of a network on a torus: `update_time TRUNK MODE UPDATES THREADS SURFACE NEAR UNIFORM LABELS`. Prints one
//! line of JSON with the median and the lowest time in milliseconds. `tools/torch/bench_implicit.py` compares it with PyTorch.

use partprobe_carrier::Mesh;
use partprobe_implicit::{
    Mode, PointLabels, PoolSizes, Pools, Reference, Settings, Training, Trunk,
};
use std::f64::consts::TAU;
use std::time::Instant;

/// A torus around the z axis.
fn torus(n: usize, m: usize) -> Mesh {
    let vertices: Vec<[f64; 3]> = (0..n * m)
        .map(|i| {
            let (u, v) = (
                TAU * (i / m) as f64 / n as f64,
                TAU * (i % m) as f64 / m as f64,
            );
            let radius = 1.0 + 0.4 * v.cos();
            [radius * u.cos(), radius * u.sin(), 0.4 * v.sin()]
        })
        .collect();
    let at = |i: usize, j: usize| (i % n * m + j % m) as u32;
    let triangles: Vec<[u32; 3]> = (0..n * m)
        .flat_map(|i| {
            let (i, j) = (i / m, i % m);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    Mesh {
        vertex_face: vec![0; vertices.len()],
        tri_face: vec![0; triangles.len()],
        vertices,
        triangles,
        vertex_normal: Vec::new(),
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize| -> Result<usize, std::num::ParseIntError> { arguments[at].parse() };
    let trunk: Trunk = arguments[0].parse()?;
    let mode = match arguments[1].as_str() {
        "oracle-sdf" => Mode::OracleSdf,
        _ => Mode::FlatCad,
    };
    let (n_updates, threads) = (number(2)?, number(3)?);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()?;

    let sizes = PoolSizes {
        surface: 20_000,
        near: 20_000,
        uniform: 10_000,
    };
    let pools = Pools::new(&Reference::new(&torus(60, 30))?, sizes, "torus")?;
    let n_labels = number(7)? as i32;
    let of_point = (0..20_000).map(|i| i % n_labels.max(1)).collect();
    let labels = PointLabels::new(of_point, &pools)?;
    let settings = Settings {
        trunk,
        iterations: n_updates,
        points: [number(4)?, number(5)?, number(6)?],
        ..Settings::of_mode(mode)
    };
    let mut training = Training::new(&pools, (n_labels > 0).then_some(&labels), &settings, 0);
    let mut milliseconds = Vec::new();
    for _ in 0..n_updates {
        let begun = Instant::now();
        training.update();
        milliseconds.push(1e3 * begun.elapsed().as_secs_f64());
    }
    milliseconds.sort_by(f64::total_cmp);
    let (median, lowest) = (milliseconds[n_updates / 2], milliseconds[0]);
    println!("{{\"median_ms\": {median:.3}, \"lowest_ms\": {lowest:.3}}}");
    Ok(())
}
