//! Describes how a surface fills space, so that shapes with other faces and triangles can be compared.
//!
//! A mesh or a cloud goes in, and a [`Descriptor`] comes out: quantiles of three distances. They do not change if the shape is
//! moved, rotated, mirrored or scaled, and hardly change if another program wrote or triangulated it. The descriptor knows
//! nothing about faces, edges and types; [`Signature`](crate::Signature) compares those.

use crate::random::{Rng, keyed_rng, unit_interval};
use partprobe_shape::{Mesh, Point, cross, dot, norm, subtract};

/// The number of points that are spread over the surface, uniformly by area.
const N_POINTS: usize = 2048;

/// The number of other points whose distance from each point counts.
const N_PARTNERS: usize = 16;

/// The number of quantiles of each distance.
const N_QUANTILES: usize = 16;

/// The number of distances: from the center, from the center to the tangent plane, and from one point to another.
const N_DISTANCES: usize = 3;

/// How a surface fills space: quantiles of distances, in units of the root mean square distance from its center.
///
/// The distances are those of its points from its center, of the center from their tangent planes, and of its points from each
/// other (Osada et al. 2002, "Shape distributions").
#[derive(Clone, Debug, PartialEq)]
pub struct Descriptor {
    quantiles: [[f64; N_QUANTILES]; N_DISTANCES],
}

impl Descriptor {
    /// The descriptor of a mesh or a cloud. Returns `None` if it has no extent.
    #[must_use]
    pub fn of(mesh: &Mesh) -> Option<Self> {
        // The draws are the same for every shape, so that equal meshes have equal descriptors.
        let mut rng = keyed_rng(0, &["descriptor"]);
        let points = if mesh.is_cloud() {
            points_of_cloud(mesh)
        } else {
            points_of_triangles(mesh, &mut rng)
        };
        let centered = centered(points)?;

        let from_center = centered.iter().map(|point| norm(point.position)).collect();
        let to_plane = centered
            .iter()
            .map(|point| dot(point.position, point.normal).abs())
            .collect();
        let from_each_other = distances_to_partners(&centered, &mut rng);
        Some(Self {
            quantiles: [from_center, to_plane, from_each_other].map(quantiles),
        })
    }

    /// The difference between two shapes: the mean difference of the quantiles, for the kind of distance that differs most.
    ///
    /// It is approximately the Wasserstein distance of the distributions, in units of the root mean square distance from the
    /// center. The same part from two exporters differs by about 0.01. Shapes that have nothing in common differ by 0.05 or more.
    #[must_use]
    pub fn difference(&self, other: &Self) -> f64 {
        let mean = |(a, b): (&[f64; N_QUANTILES], &[f64; N_QUANTILES])| {
            a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / N_QUANTILES as f64
        };
        self.quantiles
            .iter()
            .zip(&other.quantiles)
            .map(mean)
            .fold(0.0, f64::max)
    }
}

/// A point of a surface with its unit normal.
#[derive(Clone, Copy)]
struct SurfacePoint {
    position: Point,
    normal: Point,
}

/// Points at equal steps of the area, in the order of the triangles.
fn points_of_triangles(mesh: &Mesh, rng: &mut Rng) -> Vec<SurfacePoint> {
    let mut areas_up_to = Vec::with_capacity(mesh.triangles.len());
    let mut total = 0.0;
    for idx in 0..mesh.triangles.len() {
        let double_area = norm(normal_of(mesh.corners(idx)));
        total += if double_area.is_finite() {
            0.5 * double_area
        } else {
            0.0
        };
        areas_up_to.push(total);
    }
    if total <= 0.0 {
        return Vec::new();
    }
    let mut point = |nth: usize| {
        let area = (nth as f64 + 0.5) / N_POINTS as f64 * total;
        let triangle = areas_up_to.partition_point(|&up_to| up_to < area);
        let corners = mesh.corners(triangle.min(areas_up_to.len() - 1));
        let across = normal_of(corners);
        SurfacePoint {
            position: point_in(corners, rng),
            normal: across.map(|x| x / norm(across).max(f64::MIN_POSITIVE)),
        }
    };
    (0..N_POINTS).map(&mut point).collect()
}

/// The cross product of two sides. It is normal to the triangle, and its length is twice the area.
fn normal_of([a, b, c]: [Point; 3]) -> Point {
    cross(subtract(b, a), subtract(c, a))
}

/// A random point of a triangle, uniformly by area.
fn point_in([a, b, c]: [Point; 3], rng: &mut Rng) -> Point {
    let (mut u, mut v) = (unit_interval(rng), unit_interval(rng));
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    let (to_b, to_c) = (subtract(b, a), subtract(c, a));
    [0, 1, 2].map(|axis| a[axis] + u * to_b[axis] + v * to_c[axis])
}

/// Points of a cloud at equal steps of their index.
fn points_of_cloud(cloud: &Mesh) -> Vec<SurfacePoint> {
    let n = cloud.vertices.len().min(cloud.vertex_normal.len());
    let n_kept = n.min(N_POINTS);
    let point = |nth: usize| {
        let idx = nth * n / n_kept;
        SurfacePoint {
            position: cloud.vertices[idx],
            normal: cloud.vertex_normal[idx].map(f64::from),
        }
    };
    (0..n_kept).map(point).collect()
}

/// The points relative to their center, in units of their root mean square distance from it.
fn centered(mut points: Vec<SurfacePoint>) -> Option<Vec<SurfacePoint>> {
    let n = points.len() as f64;
    let mut center = [0.0; 3];
    for point in &points {
        (0..3).for_each(|axis| center[axis] += point.position[axis] / n);
    }
    let mut mean_square = 0.0;
    for point in &mut points {
        point.position = subtract(point.position, center);
        mean_square += dot(point.position, point.position) / n;
    }
    let size = mean_square.sqrt();
    if !(size > 0.0 && size.is_finite()) {
        return None;
    }
    for point in &mut points {
        point.position = point.position.map(|x| x / size);
    }
    Some(points)
}

/// The distances of each point from randomly drawn other points.
fn distances_to_partners(points: &[SurfacePoint], rng: &mut Rng) -> Vec<f64> {
    let mut distances = Vec::with_capacity(points.len() * N_PARTNERS);
    for point in points {
        for _ in 0..N_PARTNERS {
            let partner = (unit_interval(rng) * points.len() as f64) as usize;
            let partner = points[partner.min(points.len() - 1)];
            distances.push(norm(subtract(point.position, partner.position)));
        }
    }
    distances
}

/// Values at equal steps of their rank.
fn quantiles(mut values: Vec<f64>) -> [f64; N_QUANTILES] {
    values.sort_by(f64::total_cmp);
    std::array::from_fn(|idx| {
        let rank = (idx as f64 + 0.5) / N_QUANTILES as f64 * values.len() as f64;
        values[(rank as usize).min(values.len() - 1)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A box with these dimensions. Each of its six sides is divided into n × n pairs of triangles.
    fn block(sides: Point, n: usize) -> Mesh {
        let mut mesh = Mesh::default();
        for axis in 0..3 {
            for end in [0.0, 1.0] {
                add_side(&mut mesh, sides, (axis, end), n);
            }
        }
        mesh
    }

    fn add_side(mesh: &mut Mesh, sides: Point, (axis, end): (usize, f64), n: usize) {
        let corner = |i: usize, j: usize| {
            let mut corner = [0.0; 3];
            corner[axis] = end * sides[axis];
            corner[(axis + 1) % 3] = i as f64 / n as f64 * sides[(axis + 1) % 3];
            corner[(axis + 2) % 3] = j as f64 / n as f64 * sides[(axis + 2) % 3];
            corner
        };
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend([
                corner(i, j),
                corner(i + 1, j),
                corner(i + 1, j + 1),
                corner(i, j + 1),
            ]);
            mesh.vertex_face.extend([0; 4]);
            mesh.triangles
                .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            mesh.tri_face.extend([0; 2]);
        }
    }

    fn moved(mesh: &Mesh, scale: f64, angle: f64) -> Mesh {
        let (sin, cos) = angle.sin_cos();
        let place = |&[x, y, z]: &Point| {
            [
                scale * (cos * x - sin * y) + 7.0,
                scale * (sin * x + cos * y) - 3.0,
                -scale * z,
            ]
        };
        Mesh {
            vertices: mesh.vertices.iter().map(place).collect(),
            ..mesh.clone()
        }
    }

    proptest! {
        #[test]
        fn moving_mirroring_and_scaling_change_nothing(
            scale in 0.01f64..100.0, angle in 0.0f64..6.0, side in 0.1f64..3.0,
        ) {
            let mesh = block([side, 1.0, 2.0], 3);
            let found = Descriptor::of(&mesh).unwrap();
            let other = Descriptor::of(&moved(&mesh, scale, angle)).unwrap();
            prop_assert!(found.difference(&other) < 1e-9);
        }

        #[test]
        fn another_triangulation_changes_little(n in 1usize..12, side in 0.1f64..3.0) {
            let [coarse, fine] = [1, n].map(|n| Descriptor::of(&block([side, 1.0, 2.0], n)).unwrap());
            // Shapes that differ by 0.03 or less count as near (`split.near_difference`).
            prop_assert!(coarse.difference(&fine) < 0.02, "{}", coarse.difference(&fine));
        }
    }

    #[test]
    fn other_proportions_are_distinguished() {
        let of = |sides| Descriptor::of(&block(sides, 2)).unwrap();
        let cube = of([1.0; 3]);
        for (sides, least) in [
            ([1.0, 1.0, 1.2], 0.02),
            ([1.0, 1.0, 2.0], 0.1),
            ([1.0, 1.0, 0.1], 0.1),
        ] {
            let difference = cube.difference(&of(sides));
            assert!(difference > least, "{sides:?}: {difference}");
            assert_eq!(difference, of(sides).difference(&cube));
        }
    }

    #[test]
    fn a_shape_without_extent_has_no_descriptor() {
        assert_eq!(Descriptor::of(&Mesh::default()), None);
        let point = Mesh {
            vertices: vec![[1.0; 3]; 3],
            vertex_face: vec![0; 3],
            triangles: vec![[0, 1, 2]],
            tri_face: vec![0],
            vertex_normal: Vec::new(),
        };
        assert_eq!(Descriptor::of(&point), None);
    }
}
