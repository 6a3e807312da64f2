//! Measures the bounding box of a B-Rep from points on its edges and faces, without a mesh.

use crate::geometry::{Surface, trim};
use crate::model::{Brep, BrepFace, Loop};
use partprobe_shape::{Point, bounding_diagonal};
use std::f64::consts::TAU;

/// Number of points along a curved edge, and along each parameter of a face without a boundary.
const SAMPLES: usize = 16;

/// The largest distance that a point may have from the origin, in millimeters: about seven times as far as the sun. A point that
/// is farther away is damage, and its squares could leave the range of floating-point numbers.
pub(crate) const REACH_MM: f64 = 1e15;

/// The diagonal of the bounding box of a shape's edges and of its faces that have no other face next to them.
pub(crate) fn diagonal(brep: &Brep) -> f64 {
    let mut points: Vec<Point> = brep.vertices.iter().map(|vertex| vertex.point).collect();
    for edge in &brep.edges {
        if !matches!(*edge.curve, crate::geometry::Curve::Line { .. }) {
            let (start, end) = trim(edge, &brep.vertices);
            points.extend((1..SAMPLES).map(|i| {
                edge.curve
                    .point(start + (end - start) * i as f64 / SAMPLES as f64)
            }));
        }
    }
    for face in &brep.faces {
        match &*face.surface {
            Surface::Facets(facets) => points.extend(&facets.points),
            surface if closes_in_itself(face) => points.extend(surface_samples(surface)),
            _ => {}
        }
    }
    points.retain(|point| point.iter().all(|x| x.abs() <= REACH_MM));
    bounding_diagonal(&points)
}

/// Whether every edge of the face has the face itself on its other side.
fn closes_in_itself(face: &BrepFace) -> bool {
    let edge_loops = face.loops.iter().filter_map(|boundary| match boundary {
        Loop::Edges(uses) => Some(uses),
        Loop::Vertex(_) => None,
    });
    let mut edges: Vec<u32> = edge_loops.flatten().map(|edge_use| edge_use.edge).collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).all(|uses| uses.len() > 1)
}

/// A grid of points on a surface whose parameters are both finite or periodic. The list is empty for any other surface.
fn surface_samples(surface: &Surface) -> Vec<Point> {
    let [range_u, range_v] = surface.range();
    let [period_u, period_v] = surface.period();
    let span = |range: Option<(f64, f64)>, period: Option<f64>| {
        range.or(period.map(|period| (0.0, period)))
    };
    let spans = match surface {
        Surface::Sphere { .. } => Some(((0.0, TAU), (-0.25 * TAU, 0.25 * TAU))),
        _ => span(range_u, period_u).zip(span(range_v, period_v)),
    };
    let Some(((u0, u1), (v0, v1))) = spans else {
        return Vec::new();
    };
    let fraction = |i: usize| i as f64 / SAMPLES as f64;
    let grid = (0..=SAMPLES).flat_map(|i| (0..=SAMPLES).map(move |j| (fraction(i), fraction(j))));
    grid.map(|(s, t)| surface.point(u0 + s * (u1 - u0), v0 + t * (v1 - v0)))
        .collect()
}
