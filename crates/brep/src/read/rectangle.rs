//! Makes a loop of the four sides of a rectangle of parameters.

use super::edges::{EdgeTable, reversed};
use super::error::{EntityError, Problem};
use super::space::Reader;
use crate::geometry::linear::sum;
use crate::geometry::{BsplineCurve, BsplineSurface, Curve, SurfaceCurve, SurfacePatch};
use crate::model::{EdgeUse, Loop};
use partprobe_shape::{Point, bounding_diagonal, cross, distance, dot, norm, subtract};
use std::sync::Arc;

/// Number of pieces into which the sides of a rectangle are divided to compare them.
const SIDE_PIECES: usize = 8;

/// Two sides meet if their distance is below this fraction of the rectangle's size.
const SIDES_MEET: f64 = 1e-9;

/// The boundary, reversed if the representation is mirrored.
pub(super) fn reversed_if_mirrored(reader: &Reader<'_, '_>, boundary: Loop) -> Loop {
    if reader.is_mirrored() {
        reversed(boundary)
    } else {
        boundary
    }
}

/// Whether the larger part of a sphere lies on the left of a closed walk. In many files the senses of such boundaries are not
/// reliable, and the smaller part is meant.
pub(super) fn encloses_more_than_half(walk: &[Point], center: Point) -> bool {
    let points: Vec<Point> = walk.iter().map(|&point| subtract(point, center)).collect();
    let next = points.iter().cycle().skip(1);
    let area = points
        .iter()
        .zip(next)
        .fold([0.0; 3], |area, (&a, &b)| sum(area, cross(a, b)));
    let middle = points
        .iter()
        .fold([0.0; 3], |middle, &point| sum(middle, point));
    dot(area, middle) < -1e-6 * norm(area) * norm(middle)
}

/// Makes one loop of four sides, given in the order lowest v, highest u, highest v, lowest u. The loop is counter-clockwise in
/// the parameters. Sides that meet become one edge, and sides without length are left out.
pub(super) fn rectangle(edges: &mut EdgeTable, sides: [Curve; 4]) -> Loop {
    let shape = RectangleShape::of(&sides);
    let corners = shape.corners(edges);
    let [bottom, right, top, left] = sides;
    let mut edge = |side: usize, curve: Curve, ends: [u32; 2]| {
        shape.has_length[side].then(|| edges.push_edge(0, ends, Arc::new(curve), true))
    };
    let bottom = edge(0, bottom, [corners.at_00, corners.at_10]);
    let right = edge(1, right, [corners.at_10, corners.at_11]);
    let top = if shape.closed_v {
        bottom
    } else {
        edge(2, top, [corners.at_01, corners.at_11])
    };
    let left = if shape.closed_u {
        right
    } else {
        edge(3, left, [corners.at_00, corners.at_01])
    };
    let walk = [(bottom, true), (right, true), (top, false), (left, false)];
    Loop::Edges(
        walk.iter()
            .filter_map(|&(edge, forward)| {
                Some(EdgeUse {
                    edge: edge?,
                    forward,
                })
            })
            .collect(),
    )
}

/// Properties of the four sides of a rectangle in space.
struct RectangleShape {
    /// Points along each side.
    points: [Vec<Point>; 4],
    /// Whether the sides at the lowest and the highest u coincide.
    closed_u: bool,
    /// Whether the sides at the lowest and the highest v coincide.
    closed_v: bool,
    has_length: [bool; 4],
}

/// The vertices at the lowest (0) and highest (1) u and v.
struct RectangleCorners {
    at_00: u32,
    at_10: u32,
    at_01: u32,
    at_11: u32,
}

impl RectangleShape {
    fn of(sides: &[Curve; 4]) -> Self {
        let points = sides.each_ref().map(points_along);
        let size = bounding_diagonal(&points.concat());
        Self {
            closed_u: sides_meet(&points[1], &points[3], size),
            closed_v: sides_meet(&points[0], &points[2], size),
            has_length: points
                .each_ref()
                .map(|points| bounding_diagonal(points) > SIDES_MEET * size),
            points,
        }
    }

    /// Makes the vertices. Two corners get the same vertex if the side between them has no length.
    fn corners(&self, edges: &mut EdgeTable) -> RectangleCorners {
        let Self {
            points,
            closed_u,
            closed_v,
            has_length,
        } = self;
        let at_00 = edges.push_vertex(points[0][0]);
        let at_10 = if *closed_u || !has_length[0] {
            at_00
        } else {
            edges.push_vertex(points[1][0])
        };
        let at_01 = if *closed_v || !has_length[3] {
            at_00
        } else {
            edges.push_vertex(points[2][0])
        };
        let at_11 = if *closed_u || !has_length[2] {
            at_01
        } else if *closed_v || !has_length[1] {
            at_10
        } else {
            edges.push_vertex(points[2][SIDE_PIECES])
        };
        RectangleCorners {
            at_00,
            at_10,
            at_01,
            at_11,
        }
    }
}

fn points_along(side: &Curve) -> Vec<Point> {
    let (low, high) = side.range().unwrap_or_default();
    (0..=SIDE_PIECES)
        .map(|i| side.point(low + (high - low) * i as f64 / SIDE_PIECES as f64))
        .collect()
}

/// Whether two sides of a rectangle with this size run through the same points.
fn sides_meet(a: &[Point], b: &[Point], size: f64) -> bool {
    a.iter()
        .zip(b)
        .all(|(&a, &b)| distance(a, b) <= SIDES_MEET * size)
}

/// The sides of a patch, as straight lines in its surface's parameter plane.
pub(super) fn sides_of_patch(patch: &SurfacePatch) -> [Curve; 4] {
    let surface = Arc::new(patch.surface.clone());
    let ([u0, v0], [u1, v1]) = (patch.start, patch.end);
    [
        [[u0, v0], [u1, v0]],
        [[u1, v0], [u1, v1]],
        [[u0, v1], [u1, v1]],
        [[u0, v0], [u0, v1]],
    ]
    .map(|ends| {
        let curve = Curve::Polyline(ends.map(|[u, v]| [u, v, 0.0]).to_vec());
        Curve::OnSurface(Box::new(SurfaceCurve {
            surface: Arc::clone(&surface),
            curve,
            scale: [1.0; 2],
        }))
    })
}

/// The curves at the ends of a clamped B-spline's parameters: lowest v, highest u, highest v, lowest u.
pub(super) fn sides(surface: &BsplineSurface) -> Result<[Curve; 4], EntityError> {
    let BsplineSurface {
        degree_u,
        degree_v,
        knots_u,
        knots_v,
        n_u,
        n_v,
        poles,
        ..
    } = surface;
    if !is_clamped(knots_u, *degree_u) || !is_clamped(knots_v, *degree_v) {
        return Err(Problem::Geometry("a surface without bounds has to be clamped").into());
    }
    let along_u = |j: usize| {
        let poles = (0..*n_u).map(|i| poles[i * n_v + j]).collect();
        BsplineCurve::new(*degree_u, knots_u.clone(), poles).map(Curve::Bspline)
    };
    let along_v = |i: usize| {
        BsplineCurve::new(
            *degree_v,
            knots_v.clone(),
            poles[i * n_v..][..*n_v].to_vec(),
        )
        .map(Curve::Bspline)
    };
    Ok([
        along_u(0)?,
        along_v(n_u - 1)?,
        along_u(n_v - 1)?,
        along_v(0)?,
    ])
}

/// Whether a spline begins at its first pole and ends at its last one.
fn is_clamped(knots: &[f64], degree: usize) -> bool {
    let n = knots.len();
    knots[0] == knots[degree] && knots[n - 1] == knots[n - 1 - degree]
}
