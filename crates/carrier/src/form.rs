//! Describes a whole surface by eight numbers that do not change if it is moved, rotated, mirrored or scaled.
//!
//! Triangles go in, and the numbers come out: second moments of the surface and of its normals. They do not depend on the
//! triangulation, except for the volume that the triangles cut off.

use crate::eigen::eigenvalues;
use partprobe_shape::{Mesh, Point, cross, dot, norm, subtract};

/// Forms that differ by no more than this in each number are equal. Triangles at the default tolerances change a number by a
/// third of it.
const TOLERANCE: f64 = 0.01;

/// The largest change of a number if a mesh of single precision is moved and scaled.
const ROUNDING: f64 = 1e-5;

/// The spread of a surface around its center and the spread of its normals, in units of the square root of its area.
pub(crate) type Form = [f64; 8];

/// The form of a mesh or a cloud. All numbers are zero if it has no extent.
pub(crate) fn form(mesh: &Mesh) -> Form {
    let triangles: Vec<WeightedTriangle> = if mesh.is_cloud() {
        weighted_points(mesh)
    } else {
        (0..mesh.triangles.len())
            .filter_map(|idx| WeightedTriangle::new(mesh.corners(idx)))
            .collect()
    };
    let area: f64 = triangles.iter().map(|triangle| triangle.area).sum();
    if !(area > 0.0 && area.is_finite()) {
        return [0.0; 8];
    }
    let center = triangles.iter().fold([0.0; 3], |sum, triangle| {
        let middle = triangle.sum_of_corners().map(|x| x / 3.0);
        add_scaled(sum, middle, triangle.area / area)
    });
    let mut spread = [[0.0; 3]; 3];
    let mut normals = [[0.0; 3]; 3];
    let mut mean_normal = [0.0; 3];
    let mut mean_height = 0.0;
    for triangle in &triangles {
        let moved = triangle.relative_to(center);
        let weight = triangle.area / area;
        for corner in moved.corners.into_iter().chain([moved.sum_of_corners()]) {
            add_square(&mut spread, corner, weight / 12.0);
        }
        add_square(&mut normals, moved.normal, weight);
        mean_normal = add_scaled(mean_normal, moved.normal, weight);
        mean_height += weight * dot(moved.corners[0], moved.normal).abs();
    }
    let extents = eigenvalues(spread).map(|moment| (moment.max(0.0) / area).sqrt());
    let [a, b, c] = eigenvalues(normals);
    [
        extents[0],
        extents[1],
        extents[2],
        a,
        b,
        c,
        norm(mean_normal),
        mean_height / area.sqrt(),
    ]
}

/// Whether two forms belong to the same shape, for any triangulation of it.
pub(crate) fn are_equal(a: &Form, b: &Form) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= TOLERANCE)
}

/// Whether two forms belong to the same triangles or points, which may be moved and scaled.
pub(crate) fn are_same_mesh(a: &Form, b: &Form) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= ROUNDING)
}

/// A triangle with its area and its unit normal.
struct WeightedTriangle {
    corners: [Point; 3],
    normal: Point,
    area: f64,
}

impl WeightedTriangle {
    /// Returns `None` for a triangle without an area.
    fn new(corners: [Point; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let across = cross(subtract(b, a), subtract(c, a));
        let double_area = norm(across);
        let has_area = double_area > 0.0 && double_area.is_finite();
        has_area.then(|| Self {
            corners,
            normal: across.map(|x| x / double_area),
            area: 0.5 * double_area,
        })
    }

    fn relative_to(&self, center: Point) -> Self {
        Self {
            corners: self.corners.map(|corner| subtract(corner, center)),
            ..*self
        }
    }

    fn sum_of_corners(&self) -> Point {
        self.corners
            .into_iter()
            .fold([0.0; 3], |sum, corner| add_scaled(sum, corner, 1.0))
    }
}

/// The points of a cloud. Together they weigh the square of their mean distance from their center, so that the form does
/// not depend on the scale.
fn weighted_points(cloud: &Mesh) -> Vec<WeightedTriangle> {
    let n = cloud.vertices.len() as f64;
    let sum = cloud
        .vertices
        .iter()
        .fold([0.0; 3], |sum, &point| add_scaled(sum, point, 1.0));
    let center = sum.map(|x| x / n);
    let squared = |point: &Point| {
        let offset = subtract(*point, center);
        dot(offset, offset)
    };
    let area = cloud.vertices.iter().map(squared).sum::<f64>() / (n * n);
    let weighted = |(&point, normal): (&Point, &[f32; 3])| WeightedTriangle {
        corners: [point; 3],
        normal: normal.map(f64::from),
        area,
    };
    cloud
        .vertices
        .iter()
        .zip(&cloud.vertex_normal)
        .map(weighted)
        .collect()
}

fn add_scaled(sum: Point, point: Point, factor: f64) -> Point {
    [0, 1, 2].map(|axis| sum[axis] + factor * point[axis])
}

/// Adds the product of a vector with itself.
fn add_square(sum: &mut [Point; 3], point: Point, factor: f64) {
    for (row, &x) in sum.iter_mut().zip(&point) {
        *row = add_scaled(*row, point, factor * x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A square sheet with this height over it.
    fn sheet(height: impl Fn(f64, f64) -> f64) -> Mesh {
        let n = 24;
        let at = |i: usize| i as f64 / n as f64;
        let vertices: Vec<Point> = (0..=n)
            .flat_map(|i| (0..=n).map(move |j| (at(i), at(j))))
            .map(|(x, y)| [x, y, height(x, y)])
            .collect();
        let corner = |i: usize, j: usize| (i * (n + 1) + j) as u32;
        let cell = |(i, j)| {
            let [a, b, c, d] = [
                corner(i, j),
                corner(i + 1, j),
                corner(i + 1, j + 1),
                corner(i, j + 1),
            ];
            [[a, b, c], [a, c, d]]
        };
        let triangles: Vec<[u32; 3]> = (0..n)
            .flat_map(|i| (0..n).map(move |j| (i, j)))
            .flat_map(cell)
            .collect();
        let (vertex_face, tri_face) = (vec![0; vertices.len()], vec![0; triangles.len()]);
        Mesh {
            vertices,
            vertex_face,
            triangles,
            tri_face,
            vertex_normal: Vec::new(),
        }
    }

    fn moved(mesh: &Mesh, scale: f64, angle: f64) -> Mesh {
        let (sin, cos) = angle.sin_cos();
        let place = |&[x, y, z]: &Point| {
            let [x, y, z] = [cos * x - sin * z, y, sin * x + cos * z];
            [
                scale * (cos * x - sin * y) + 7.0,
                scale * (sin * x + cos * y) - 3.0,
                scale * z,
            ]
        };
        Mesh {
            vertices: mesh.vertices.iter().map(place).collect(),
            ..mesh.clone()
        }
    }

    proptest! {
        #[test]
        fn moving_and_scaling_change_nothing(scale in 0.01f64..100.0, angle in 0.0f64..6.0, bump in 0.0f64..1.0) {
            let mesh = sheet(|x, y| bump * x * x + 0.3 * (3.0 * y).sin());
            for (a, b) in form(&mesh).iter().zip(form(&moved(&mesh, scale, angle))) {
                prop_assert!((a - b).abs() < 1e-6, "{a} {b}");
            }
        }
    }

    #[test]
    fn sheets_of_other_forms_are_distinguished() {
        let forms = [
            form(&sheet(|_, _| 0.0)),
            form(&sheet(|x, _| 0.1 * (6.3 * x).sin())),
            form(&sheet(|x, _| 0.1 * (12.6 * x).sin())),
            form(&sheet(|x, y| 0.1 * (6.3 * x).sin() * (6.3 * y).sin())),
            form(&sheet(|x, y| 0.2 * (x * x + y * y))),
        ];
        for (i, a) in forms.iter().enumerate() {
            for (j, b) in forms.iter().enumerate() {
                assert_eq!(are_equal(a, b), i == j, "{i} {j}: {a:?} {b:?}");
            }
        }
        assert_eq!(form(&Mesh::default()), [0.0; 8]);
    }
}
