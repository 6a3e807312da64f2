//! Makes closed meshes for tests.

use partprobe_carrier::{Mesh, Point};
use std::f64::consts::PI;

fn mesh(vertices: Vec<Point>, triangles: Vec<[u32; 3]>) -> Mesh {
    Mesh {
        vertex_face: vec![0; vertices.len()],
        tri_face: vec![0; triangles.len()],
        vertices,
        triangles,
        vertex_normal: Vec::new(),
    }
}

/// A box around the origin with these half sides.
pub(crate) fn cuboid(half: Point) -> Mesh {
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
    let halves = quads
        .into_iter()
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    mesh((0..8).map(corner).collect(), halves.collect())
}

/// A grid of points that closes in both directions, as triangles with their normals outward.
fn closed_grid([n, m]: [usize; 2], point: impl Fn(f64, f64) -> Point) -> Mesh {
    let vertices = (0..n * m).map(|i| point((i / m) as f64 / n as f64, (i % m) as f64 / m as f64));
    let at = |i: usize, j: usize| (i % n * m + j % m) as u32;
    let quads = (0..n * m).map(|i| (i / m, i % m));
    let triangles = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    mesh(vertices.collect(), triangles.collect())
}

/// A torus around the z axis.
pub(crate) fn torus([major, minor]: [f64; 2], steps: [usize; 2]) -> Mesh {
    closed_grid(steps, |u, v| {
        let (u, v) = (2.0 * PI * u, 2.0 * PI * v);
        let radius = major + minor * v.cos();
        [radius * u.cos(), radius * u.sin(), minor * v.sin()]
    })
}

/// A sphere around the origin, from the south pole to the north pole. Triangles at the poles have no area.
pub(crate) fn sphere(radius: f64, [n, m]: [usize; 2]) -> Mesh {
    let vertices = (0..(m + 1) * n).map(|i| {
        let (u, v) = (
            2.0 * PI * (i % n) as f64 / n as f64,
            PI * (i / n) as f64 / m as f64,
        );
        [
            radius * v.sin() * u.cos(),
            radius * v.sin() * u.sin(),
            -radius * v.cos(),
        ]
    });
    let at = |i: usize, j: usize| (j * n + i % n) as u32;
    let quads = (0..n * m).map(|i| (i % n, i / n));
    let triangles = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    mesh(vertices.collect(), triangles.collect())
}
