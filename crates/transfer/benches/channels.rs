//! Measures each channel at the size of the paper's comparison: 10⁵ points, on a surface of 50 000 triangles.

use divan::Bencher;
use partprobe_carrier::{Mesh, NormalKind, PointSample, keyed_rng, sample_by_area};
use partprobe_transfer::{
    Channel, LabeledSurface, Limits, NearestSurface, NearestVertex, Surface, ceiling, for_all,
    queries_of,
};
use std::f64::consts::TAU;

fn main() {
    divan::main();
}

/// A torus of about 50 000 triangles.
fn torus() -> Mesh {
    const N: u32 = 158;
    let angle = |idx: u32| TAU * f64::from(idx) / f64::from(N);
    let at = |u: f64, v: f64| {
        let radius = 2.0 + 0.7 * v.cos();
        [radius * u.cos(), radius * u.sin(), 0.7 * v.sin()]
    };
    let pairs = || (0..N).flat_map(|u| (0..N).map(move |v| (u, v)));
    let index = |u: u32, v: u32| (u % N) * N + v % N;
    let triangles: Vec<[u32; 3]> = pairs()
        .flat_map(|(u, v)| {
            let [a, b, c, d] = [
                index(u, v),
                index(u + 1, v),
                index(u + 1, v + 1),
                index(u, v + 1),
            ];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    Mesh {
        vertices: pairs().map(|(u, v)| at(angle(u), angle(v))).collect(),
        vertex_face: vec![0; (N * N) as usize],
        tri_face: vec![0; triangles.len()],
        triangles,
        vertex_normal: Vec::new(),
    }
}

fn sample(mesh: &Mesh) -> PointSample {
    let mut rng = keyed_rng(0, &["bench"]);
    sample_by_area(mesh, 100_000, NormalKind::Triangle, &mut rng).expect("a torus has an area")
}

/// Measures a channel, including the preparation of the surface.
#[divan::bench(args = ["index", "nn-surface", "nn-surface, normals agree", "nn-vertex", "nn-vertex, normals agree"], sample_count = 10)]
fn channel(bencher: Bencher<'_, '_>, name: &str) {
    let mesh = torus();
    let sample = sample(&mesh);
    let queries = queries_of(&sample);
    let labels: Vec<i32> = (0..mesh.triangles.len() as i32)
        .map(|triangle| triangle / 500)
        .collect();
    let surface = Surface::of_mesh(&mesh).expect("a torus is whole");
    let labeled = LabeledSurface::new(surface, &labels).expect("one label per triangle");
    let limits = match name.contains("normals") {
        true => Limits::NONE.with_normals_within(30.0),
        false => Limits::NONE,
    };
    let channel = match name.split(',').next() {
        Some("nn-surface") => Channel::NnSurface,
        Some("nn-vertex") => Channel::NnVertex,
        _ => Channel::Index,
    };
    bencher.bench(|| ceiling(channel, &labeled, &queries, &sample.triangles, &limits));
}

/// Measures the preparation of a surface alone.
#[divan::bench(args = ["nn-surface", "nn-vertex"], sample_count = 10)]
fn prepare(bencher: Bencher<'_, '_>, name: &str) {
    let mesh = torus();
    let labels = vec![0; mesh.triangles.len()];
    let surface = Surface::of_mesh(&mesh).expect("a torus is whole");
    let labeled = LabeledSurface::new(surface, &labels).expect("one label per triangle");
    match name {
        "nn-surface" => bencher.bench(|| NearestSurface::new(surface)),
        _ => bencher.bench(|| NearestVertex::new(&labeled)),
    }
}

/// Measures sorting the points and restoring their order in the answers.
#[divan::bench(sample_count = 10)]
fn order(bencher: Bencher<'_, '_>) {
    let queries = queries_of(&sample(&torus()));
    bencher.bench(|| for_all(&queries, |_| 0));
}
