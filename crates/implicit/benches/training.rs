//! Measures one update of each trunk, and the surface of a network with and without narrowing.

use divan::Bencher;
use partprobe_carrier::Mesh;
use partprobe_implicit::{
    Mode, Network, PoolSizes, Pools, Reference, Resolution, Settings, Training, Trunk, surface,
};

fn main() {
    divan::main();
}

/// A box with half sides 1, 0.7 and 0.4.
fn block() -> Mesh {
    let half = [1.0, 0.7, 0.4];
    let corner = |i: usize| {
        std::array::from_fn(|axis| {
            if i >> axis & 1 == 1 {
                half[axis]
            } else {
                -half[axis]
            }
        })
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles: Vec<[u32; 3]> = quads
        .into_iter()
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    Mesh {
        vertices: (0..8).map(corner).collect(),
        vertex_face: vec![0; 8],
        tri_face: vec![0; triangles.len()],
        triangles,
        vertex_normal: Vec::new(),
    }
}

fn pools() -> Option<Pools> {
    let sizes = PoolSizes {
        surface: 20_000,
        near: 20_000,
        uniform: 10_000,
    };
    Pools::new(&Reference::new(&block()).ok()?, sizes, "block").ok()
}

#[divan::bench(args = ["siren-256x4", "siren-128x4", "siren-64x4", "softplus100-128x4"], sample_count = 10)]
fn update(bencher: Bencher<'_, '_>, trunk: &str) {
    let (Some(pools), Ok(trunk)) = (pools(), trunk.parse::<Trunk>()) else {
        return;
    };
    let settings = Settings {
        trunk,
        ..Settings::of_mode(Mode::OracleSdf)
    };
    let mut training = Training::new(&pools, None, &settings, 0);
    bencher.bench_local(|| training.update());
}

/// The surface of a network that was trained a little.
fn trained() -> Option<Network> {
    let pools = pools()?;
    let settings = Settings {
        iterations: 200,
        ..Settings::of_mode(Mode::OracleSdf)
    };
    let mut training = Training::new(&pools, None, &settings, 0);
    while training.n_updates() < settings.iterations {
        training.update();
    }
    Some(training.finish())
}

#[divan::bench(sample_count = 3)]
fn surface_128_narrowed(bencher: Bencher<'_, '_>) {
    let (Some(network), Some(resolution)) = (trained(), Resolution::new(128)) else {
        return;
    };
    bencher.bench_local(|| surface(&network, resolution).map(|mesh| mesh.triangles.len()));
}

/// The distance at all points of the grid, which narrowing avoids.
#[divan::bench(sample_count = 3)]
fn distances_of_all_grid_points_128(bencher: Bencher<'_, '_>) {
    let Some(network) = trained() else {
        return;
    };
    let at = |i: usize| 2.2 * i as f32 / 128.0 - 1.1;
    let grid: Vec<[f32; 3]> = (0..129usize.pow(3))
        .map(|i| [at(i % 129), at(i / 129 % 129), at(i / 129 / 129)])
        .collect();
    bencher.bench_local(|| network.distances(&grid).len());
}
