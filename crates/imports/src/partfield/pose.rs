//! Moves a mesh that was moved, scaled and perhaps rotated back to the position of its carrier.
//!
//! The translation and the scale are computed from the bounding boxes. They are verified: the vertices must lie on the surface of
//! the carrier. If they do not, the 24 rotations of the coordinate axes are tried. A rotation is used only if it is the only one
//! that fits, because a symmetric shape fits in several ways that give different labels.

use crate::import::JoinProblem;
use partprobe_carrier::{Carrier, Mesh, Point, bounding_box};
use partprobe_transfer::{Limits, NearestSurface, Query, Surface};

/// The largest distance of a vertex from the surface, as a fraction of the diagonal.
const MAX_DISTANCE: f64 = 0.005;
/// The number of vertices that are verified. They are spread over all vertices.
const N_VERIFIED: usize = 500;

/// The mesh in millimeters, in the position of the carrier, and a note if it had to be rotated.
///
/// # Errors
/// If no pose fits, or several rotations do.
pub(super) fn in_carrier_position(
    carrier: &Carrier,
    mesh: Mesh,
) -> Result<(Mesh, &'static str), JoinProblem> {
    let refused = |reason: &str| JoinProblem::Refused(reason.to_owned());
    let own = carrier.mesh();
    let surface = Surface::of_mesh(own).map_err(|error| JoinProblem::Refused(error.to_string()))?;
    let nearest = NearestSurface::new(surface);
    let max_distance = MAX_DISTANCE * carrier.meta().diagonal_mm;
    let fitted = |rotation: &[(usize, f64); 3]| {
        let vertices = fitted_vertices(&own.vertices, &mesh.vertices, rotation)?;
        lie_on(&nearest, &vertices, max_distance).then_some(vertices)
    };

    let rotations = axis_rotations();
    let in_pose = |vertices: Vec<Point>| Mesh {
        vertices,
        ..mesh.clone()
    };
    if let Some(vertices) = fitted(&rotations[0]) {
        return Ok((in_pose(vertices), ""));
    }
    let mut others: Vec<Vec<Point>> = rotations[1..].iter().filter_map(fitted).collect();
    match (others.pop(), others.is_empty()) {
        (Some(vertices), true) => Ok((in_pose(vertices), ", rotated")),
        (None, _) => Err(refused(
            "the mesh of the labels is not the surface of this shape, in any rotation by right angles",
        )),
        (Some(_), false) => Err(refused(
            "the mesh of the labels was rotated, and the shape is symmetric, so that several rotations fit; export the mesh again \
             without a rotation",
        )),
    }
}

/// The 24 rotations of the coordinate axes, the identity first: for each new axis, the old one and its sign.
fn axis_rotations() -> Vec<[(usize, f64); 3]> {
    let orders = [
        [0, 1, 2],
        [1, 2, 0],
        [2, 0, 1],
        [0, 2, 1],
        [2, 1, 0],
        [1, 0, 2],
    ];
    let mut rotations = Vec::new();
    for (number, order) in orders.iter().enumerate() {
        for signs in 0..8u32 {
            let sign = |axis: u32| if signs >> axis & 1 == 0 { 1.0 } else { -1.0 };
            // The last three orders of the axes are reflections, and so is each odd number of negative signs.
            let is_odd = (number >= 3) ^ (signs.count_ones() % 2 == 1);
            if !is_odd {
                rotations.push([
                    (order[0], sign(0)),
                    (order[1], sign(1)),
                    (order[2], sign(2)),
                ]);
            }
        }
    }
    rotations
}

/// The vertices rotated, and their box fitted to that of the carrier. Returns `None` if the boxes have different proportions.
fn fitted_vertices(
    own: &[Point],
    other: &[Point],
    rotation: &[(usize, f64); 3],
) -> Option<Vec<Point>> {
    let rotated = |vertex: &Point| rotation.map(|(axis, sign)| sign * vertex[axis]);
    let rotated: Vec<Point> = other.iter().map(rotated).collect();
    let [low, high] = bounding_box(own)?;
    let [other_low, other_high] = bounding_box(&rotated)?;
    let widest = |low: Point, high: Point| {
        (0..3)
            .map(|axis| high[axis] - low[axis])
            .fold(0.0, f64::max)
    };
    let width = widest(low, high);
    let scale = width / widest(other_low, other_high);
    if !scale.is_finite() {
        return None;
    }

    let extent = |axis: usize| {
        (
            high[axis] - low[axis],
            scale * (other_high[axis] - other_low[axis]),
        )
    };
    let is_similar = (0..3)
        .map(extent)
        .all(|(own, other)| (own - other).abs() <= MAX_DISTANCE * width);
    let center = |low: f64, high: f64| 0.5 * (low + high);
    let placed = |vertex: Point| {
        std::array::from_fn(|axis| {
            let offset = vertex[axis] - center(other_low[axis], other_high[axis]);
            center(low[axis], high[axis]) + scale * offset
        })
    };
    is_similar.then(|| rotated.into_iter().map(placed).collect())
}

fn lie_on(nearest: &NearestSurface, vertices: &[Point], max_distance: f64) -> bool {
    let limits = Limits {
        max_distance,
        ..Limits::NONE
    };
    let step = (vertices.len() / N_VERIFIED).max(1);
    vertices.iter().step_by(step).all(|&position| {
        let query = Query {
            position,
            normal: None,
        };
        nearest.nearest(&query, &limits).is_some()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_24_rotations_of_the_axes() {
        let mut images: Vec<[i32; 3]> = axis_rotations()
            .iter()
            .map(|rotation| {
                let vertex = [1.0, 2.0, 4.0];
                rotation.map(|(axis, sign)| (sign * vertex[axis]) as i32)
            })
            .collect();
        assert_eq!(images[0], [1, 2, 4]);
        images.sort_unstable();
        images.dedup();
        assert_eq!(images.len(), 24);
        // A rotation keeps the handedness: the determinant of the matrix is 1.
        for rotation in axis_rotations() {
            let column = |axis: usize| {
                let mut unit = [0.0; 3];
                unit[axis] = 1.0;
                rotation.map(|(from, sign): (usize, f64)| sign * unit[from])
            };
            let [a, b, c] = [column(0), column(1), column(2)];
            assert_eq!(
                partprobe_carrier::dot(a, partprobe_carrier::cross(b, c)),
                1.0
            );
        }
    }

    #[test]
    fn a_moved_and_scaled_box_is_put_back() {
        let own = [[1.0, 2.0, 3.0], [5.0, 4.0, 4.0], [1.0, 4.0, 3.0]];
        let normalized = own.map(|vertex| {
            let center = [3.0, 3.0, 3.5];
            std::array::from_fn(|axis| (vertex[axis] - center[axis]) * 0.45)
        });
        let identity = &axis_rotations()[0];
        let fitted = fitted_vertices(&own, &normalized, identity).unwrap();
        for (fitted, own) in fitted.iter().zip(&own) {
            assert!(fitted.iter().zip(own).all(|(a, b)| (a - b).abs() < 1e-12));
        }
        let flat = [[0.0; 3], [1.0, 1.0, 1.0]];
        assert!(fitted_vertices(&own, &flat, identity).is_none());
    }
}
