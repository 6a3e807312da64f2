//! Makes four labeled solids with one label per B-Rep face, and with as few triangles as a CAD program writes.

use partprobe_carrier::Mesh;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// A mesh whose `tri_face` is the label of each triangle.
pub(crate) fn block(size: [f64; 3]) -> Mesh {
    let corner = |idx: usize| [idx >> 2, idx >> 1 & 1, idx & 1].map(|high| high as f64);
    let vertices = (0..8)
        .map(corner)
        .map(|unit| std::array::from_fn(|axis| unit[axis] * size[axis]))
        .collect();
    let sides: [[u32; 4]; 6] = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    let mut solid = Solid::new(vertices);
    for (label, corners) in (0..).zip(sides) {
        solid.quad(corners, label);
    }
    solid.mesh
}

/// A tube of outer radius 1, inner radius 0.5 and height 2. Labels: bottom, outside, inside, top.
pub(crate) fn tube(n_segments: u32) -> Mesh {
    let ring = |radius: f64, height: f64| {
        (0..n_segments).map(move |idx| {
            let angle = TAU * f64::from(idx) / f64::from(n_segments);
            [radius * angle.cos(), radius * angle.sin(), height]
        })
    };
    let rings = [(1.0, 0.0), (1.0, 2.0), (0.5, 0.0), (0.5, 2.0)];
    let vertices = rings
        .into_iter()
        .flat_map(|(radius, height)| ring(radius, height));
    let mut solid = Solid::new(vertices.collect());
    for (label, [from, to]) in [[2, 0], [0, 1], [3, 2], [1, 3]].into_iter().enumerate() {
        for idx in 0..n_segments {
            let [a, b] = [idx, (idx + 1) % n_segments];
            let corners = [
                from * n_segments + a,
                from * n_segments + b,
                to * n_segments + b,
                to * n_segments + a,
            ];
            solid.quad(corners, label as u32);
        }
    }
    solid.mesh
}

/// A flat L of 4 × 3, legs of width 1, thickness 0.5, with a round hole of radius 0.3 in the middle of the longer leg. Labels: bottom, six
/// walls, the hole, top.
pub(crate) fn bracket() -> Mesh {
    const OUTLINE: [[f64; 2]; 6] = [
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 1.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [0.0, 3.0],
    ];
    const N_HOLE: usize = 64;
    let hole = (0..N_HOLE).map(|idx| {
        let angle = TAU * idx as f64 / N_HOLE as f64;
        [2.0 + 0.3 * angle.cos(), 0.5 + 0.3 * angle.sin()]
    });
    let profile: Vec<[f64; 2]> = OUTLINE.into_iter().chain(hole).collect();
    let sides: Vec<[usize; 2]> = (0..6)
        .map(|idx| [idx, (idx + 1) % 6])
        .chain((0..N_HOLE).map(|idx| [6 + (idx + 1) % N_HOLE, 6 + idx]))
        .collect();

    let n = profile.len() as u32;
    let at = |height: f64| profile.iter().map(move |&[x, y]| [x, y, height]);
    let mut solid = Solid::new(at(0.0).chain(at(0.5)).collect());
    let cap = cap(&profile, &sides);
    for &[a, b, c] in &cap {
        solid.triangle([c, b, a], 0);
    }
    for (idx, side) in sides.iter().enumerate() {
        let [a, b] = side.map(|vertex| vertex as u32);
        solid.quad([a, b, b + n, a + n], 1 + idx.min(6) as u32);
    }
    for &corners in &cap {
        solid.triangle(corners.map(|vertex| vertex + n), 8);
    }
    solid.mesh
}

/// The triangles inside a profile, whose sides have the inside on their left.
fn cap(profile: &[[f64; 2]], sides: &[[usize; 2]]) -> Vec<[u32; 3]> {
    let mut plane = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let vertices: Vec<_> = profile
        .iter()
        .map(|&[x, y]| plane.insert(Point2::new(x, y)).unwrap())
        .collect();
    for [from, to] in sides {
        plane.add_constraint(vertices[*from], vertices[*to]);
    }

    let index_of: BTreeMap<usize, u32> = (0..)
        .zip(&vertices)
        .map(|(idx, vertex)| (vertex.index(), idx))
        .collect();
    let is_inside = |[a, b, c]: [u32; 3]| {
        let center: [f64; 2] = std::array::from_fn(|axis| {
            [a, b, c]
                .iter()
                .map(|&vertex| profile[vertex as usize][axis])
                .sum::<f64>()
                / 3.0
        });
        let in_notch = center[0] > 1.0 && center[1] > 1.0;
        let in_hole = [a, b, c].iter().all(|&vertex| vertex >= 6);
        !in_notch && !in_hole
    };
    plane
        .inner_faces()
        .map(|face| face.vertices().map(|vertex| index_of[&vertex.index()]))
        .filter(|&corners| is_inside(corners))
        .collect()
}

struct Solid {
    mesh: Mesh,
}

impl Solid {
    fn new(vertices: Vec<[f64; 3]>) -> Self {
        Self {
            mesh: Mesh {
                vertex_face: vec![0; vertices.len()],
                vertices,
                ..Mesh::default()
            },
        }
    }

    fn triangle(&mut self, corners: [u32; 3], label: u32) {
        self.mesh.triangles.push(corners);
        self.mesh.tri_face.push(label);
    }

    fn quad(&mut self, [a, b, c, d]: [u32; 4], label: u32) {
        self.triangle([a, b, c], label);
        self.triangle([a, c, d], label);
    }
}
