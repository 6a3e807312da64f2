//! Divides an edge within a tolerance: parameters and points from its start to its end.
//!
//! Each edge is divided once, and every face that it bounds takes exactly these points. Therefore meshes close.

use crate::geometry::linear::is_finite;
use crate::geometry::{Curve, trim};
use crate::model::{BrepEdge, Vertex};
use partprobe_shape::{Point, cross, distance, dot, norm, subtract};
use std::f64::consts::FRAC_PI_3;

/// The largest number of halvings of one piece of a free-form edge.
const MAX_DEPTH: u32 = 8;
/// The largest number of points of one edge.
const MAX_POINTS: usize = 4000;

/// How closely straight pieces follow a curved shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tolerance {
    /// Largest distance between a curve and its chord.
    pub(crate) chord: f64,
    /// Largest angle between neighboring chords, in radians.
    pub(crate) angle: f64,
}

/// A divided edge.
#[derive(Clone, Debug, Default)]
pub(crate) struct EdgePoints {
    /// Curve parameters, from the edge's start to its end.
    pub(crate) parameters: Vec<f64>,
    /// Points; the first and the last are the vertices themselves.
    pub(crate) points: Vec<Point>,
}

impl Tolerance {
    /// The tolerance of a finer level. Two levels halve the chords. One level halves the area between the chords and the curve.
    pub(crate) fn finer(self, level: u32) -> Self {
        let factor = f64::from(1_u32 << level.min(16));
        Self {
            chord: self.chord / factor,
            angle: self.angle / factor.sqrt(),
        }
    }

    /// The angle that one chord may span on a circle of this radius.
    pub(crate) fn step(self, radius: f64) -> f64 {
        if radius <= 0.0 {
            return FRAC_PI_3;
        }
        let by_chord = 2.0 * libm::acos(1.0 - (self.chord / radius).min(0.9));
        self.angle.min(by_chord).min(FRAC_PI_3)
    }
}

/// Divides an edge. `least` is the smallest number of pieces of a curved edge.
///
/// Returns `None` if the edge has no finite point.
pub(crate) fn edge_points(
    edge: &BrepEdge,
    vertices: &[Vertex],
    tolerance: Tolerance,
    least: usize,
) -> Option<EdgePoints> {
    let start = vertices.get(edge.start as usize)?.point;
    let end = vertices.get(edge.end as usize)?.point;
    let (t0, t1) = trim(edge, vertices);
    let parameters = match &*edge.curve {
        Curve::Line { .. } => vec![t0, t1],
        Curve::Ellipse { rx, ry, .. } => {
            let turn = ((t1 - t0).abs() / tolerance.step(rx.abs().max(ry.abs()))).ceil();
            let least = if edge.start == edge.end {
                least.max(6)
            } else {
                least
            };
            equal_pieces(t0, t1, (turn as usize).clamp(least, MAX_POINTS))
        }
        curve => adaptive(curve, t0, t1, tolerance, least),
    };
    let mut points: Vec<Point> = parameters.iter().map(|&t| edge.curve.point(t)).collect();
    *points.first_mut()? = start;
    *points.last_mut()? = end;
    points
        .iter()
        .all(|&point| is_finite(point))
        .then_some(EdgePoints { parameters, points })
}

fn equal_pieces(t0: f64, t1: f64, n: usize) -> Vec<f64> {
    (0..=n)
        .map(|i| t0 + (t1 - t0) * i as f64 / n as f64)
        .collect()
}

/// Halves the pieces between the knots until each follows its chord.
fn adaptive(curve: &Curve, t0: f64, t1: f64, tolerance: Tolerance, least: usize) -> Vec<f64> {
    let mut ends = vec![t0.min(t1)];
    ends.extend(curve.breaks(t0.min(t1), t0.max(t1)));
    ends.push(t0.max(t1));
    if t1 < t0 {
        ends.reverse();
    }
    let is_polygon = matches!(curve, Curve::Polyline(_));
    let per_piece = if is_polygon {
        1
    } else {
        (least.max(4) / (ends.len() - 1)).max(1)
    };
    let mut parameters = vec![t0];
    for piece in ends.windows(2) {
        let starts = equal_pieces(piece[0], piece[1], per_piece);
        let mut open: Vec<(f64, f64, u32)> = starts
            .windows(2)
            .rev()
            .map(|piece| (piece[0], piece[1], 0))
            .collect();
        while let Some((from, to, depth)) = open.pop() {
            let may_split =
                !is_polygon && depth < MAX_DEPTH && parameters.len() + open.len() < MAX_POINTS;
            if may_split && leaves_chord(curve, from, to, tolerance) {
                let middle = 0.5 * (from + to);
                open.push((middle, to, depth + 1));
                open.push((from, middle, depth + 1));
            } else {
                parameters.push(to);
            }
        }
    }
    parameters
}

/// Whether a piece leaves its chord by more than the tolerance.
fn leaves_chord(curve: &Curve, from: f64, to: f64, tolerance: Tolerance) -> bool {
    let ((p, at_p), (m, at_m), (q, at_q)) = (
        curve.derivative(from),
        curve.derivative(0.5 * (from + to)),
        curve.derivative(to),
    );
    let chord = distance(p, q);
    let sag = if chord > 0.0 {
        norm(cross(subtract(m, p), subtract(q, p))) / chord
    } else {
        distance(p, m)
    };
    let turn = angle_between(at_p, at_m) + angle_between(at_m, at_q);
    // The angle of a piece much shorter than the chord tolerance does not count: at a corner it would never become small.
    sag > tolerance.chord || (turn > tolerance.angle && chord.max(sag) > 0.05 * tolerance.chord)
}

/// The angle between two vectors, or 0 if one of them vanishes.
pub(crate) fn angle_between(a: Point, b: Point) -> f64 {
    libm::atan2(norm(cross(a, b)), dot(a, b))
}
