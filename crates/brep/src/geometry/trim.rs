//! Finds the parameters at which an edge starts and ends on its curve, and the length of the edge.
//!
//! Lengths are integrals of the speed by Gauss–Legendre quadrature with five points per piece.

use super::types::Curve;
use crate::model::{BrepEdge, Vertex};
use partprobe_shape::{Point, distance, norm};

/// Nodes and weights of Gauss's quadrature with five points on −1..1.
pub(crate) const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// The parameters of an edge's start and end on its curve.
///
/// The end is below the start if the edge runs against its curve. A closed edge covers a full period.
pub(crate) fn trim(edge: &BrepEdge, vertices: &[Vertex]) -> (f64, f64) {
    let (start, end) = (position(vertices, edge.start), position(vertices, edge.end));
    let curve = &*edge.curve;
    let size = reach(curve, start);
    let is_closed = edge.start == edge.end || distance(start, end) <= 1e-9 * size;
    match (curve.period(), curve.range()) {
        (Some(period), range) => {
            let low = range.map_or(0.0, |(low, _)| low);
            let t0 = shifted_into(end_or_nearest(curve, start, size), low, period);
            if is_closed {
                return (
                    t0,
                    if edge.same_sense {
                        t0 + period
                    } else {
                        t0 - period
                    },
                );
            }
            let t1 = shifted_into(end_or_nearest(curve, end, size), low, period);
            (t0, after(t0, t1, period, edge.same_sense))
        }
        (None, Some((low, high))) if is_closed => {
            if edge.same_sense {
                (low, high)
            } else {
                (high, low)
            }
        }
        _ => (
            end_or_nearest(curve, start, size),
            end_or_nearest(curve, end, size),
        ),
    }
}

/// The length of an edge in millimeters, with a relative error of a millionth.
pub(crate) fn edge_length(edge: &BrepEdge, vertices: &[Vertex]) -> f64 {
    let (t0, t1) = trim(edge, vertices);
    match &*edge.curve {
        Curve::Line { direction, .. } => (t1 - t0).abs() * norm(*direction),
        Curve::Ellipse { rx, ry, .. } if rx == ry => (t1 - t0).abs() * rx.abs(),
        curve => arc_length(curve, t0.min(t1), t0.max(t1)),
    }
}

fn position(vertices: &[Vertex], index: u32) -> Point {
    vertices
        .get(index as usize)
        .map_or([f64::NAN; 3], |vertex| vertex.point)
}

/// The size of the curve, to which gaps are compared.
fn reach(curve: &Curve, start: Point) -> f64 {
    match (curve, curve.range()) {
        (Curve::Ellipse { rx, ry, .. }, _) => rx.abs().max(ry.abs()),
        (_, Some((low, high))) => {
            let ends = [
                curve.point(low),
                curve.point(0.5 * (low + high)),
                curve.point(high),
            ];
            distance(ends[0], ends[1]).max(distance(ends[1], ends[2]))
        }
        _ => norm(start),
    }
}

/// The parameter of a point on the curve. Most edges end where their curves end. Only the others need a search.
fn end_or_nearest(curve: &Curve, p: Point, size: f64) -> f64 {
    let ends = curve
        .range()
        .filter(|_| !matches!(curve, Curve::Ellipse { .. }));
    for end in ends.into_iter().flat_map(|(low, high)| [low, high]) {
        if distance(curve.point(end), p) <= 1e-9 * size {
            return end;
        }
    }
    curve.project(p)
}

/// `t`, moved by whole periods into `low..low + period`. The end counts as the beginning.
fn shifted_into(t: f64, low: f64, period: f64) -> f64 {
    let shifted = low + (t - low).rem_euclid(period);
    if low + period - shifted <= 1e-12 * period {
        low
    } else {
        shifted
    }
}

/// The parameter of the end, which is at most one period after the start in the direction of the edge.
fn after(t0: f64, t1: f64, period: f64, same_sense: bool) -> f64 {
    let margin = 1e-10 * period;
    if same_sense {
        if t1 > t0 + margin { t1 } else { t1 + period }
    } else if t1 < t0 - margin {
        t1
    } else {
        t1 - period
    }
}

/// Adaptive quadrature between the knots.
fn arc_length(curve: &Curve, low: f64, high: f64) -> f64 {
    let mut ends = vec![low];
    ends.extend(curve.breaks(low, high));
    ends.push(high);
    let mut length = 0.0;
    let mut open: Vec<(f64, f64, u32)> = ends
        .windows(2)
        .rev()
        .map(|pair| (pair[0], pair[1], 0))
        .collect();
    while let Some((a, b, depth)) = open.pop() {
        let middle = 0.5 * (a + b);
        let halves = gauss_length(curve, a, middle) + gauss_length(curve, middle, b);
        if depth >= 8 || (halves - gauss_length(curve, a, b)).abs() <= 1e-8 * halves {
            length += halves;
        } else {
            open.push((middle, b, depth + 1));
            open.push((a, middle, depth + 1));
        }
    }
    length
}

fn gauss_length(curve: &Curve, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    half * GAUSS
        .iter()
        .map(|(node, weight)| weight * norm(curve.derivative(middle + half * node).1))
        .sum::<f64>()
}
