//! The area between a side of a boundary and the curve that it stands for: no point is projected for it. The curve's
//! directions at both ends say how it runs through the parameter plane; of a curve that may bend anywhere between them
//! the middle is looked at as well.

use super::triangulation::{Node, Side, Triangulated};
use super::unwrap::near;
use crate::geometry::{Curve, Frame, Surface};
use crate::model::TopoEdge;
use carrier::{Point, cross, distance, dot, norm, subtract};

/// How far inside a piece of curve its directions are taken, as a part of it: at its ends it may have corners.
const INSIDE: f64 = 1e-7;

/// The signed area, in square millimetres; positive where the curve lies on the right of the side, as the
/// parameter plane is turned.
pub(super) fn sliver(surface: &Surface, mesh: &Triangulated, side: &Side, edges: &[TopoEdge]) -> f64 {
    let Some(edge) = edges.get(side.segment.edge as usize) else { return 0.0 };
    match (surface, &*edge.curve) {
        (surface, Curve::Line { .. }) if is_ruled(surface) => 0.0,
        (Surface::Plane(plane), Curve::Ellipse { frame, rx, ry }) if dot(frame.z, plane.z).abs() > 0.999 => {
            ellipse_segment(plane, frame, rx * ry, side.segment.to - side.segment.from)
        }
        (_, curve) => {
            let (from, to) = (&mesh.nodes[side.from], &mesh.nodes[side.to]);
            let period = surface.period();
            let chord = [0, 1].map(|axis| near(to.uv[axis] - from.uv[axis], 0.0, period[axis]));
            let [leaving, arriving] = directions(curve, side, chord, [from.tangents, to.tangents]);
            let cubic = cubic_segment(chord, leaving, arriving);
            let middle = [0, 1].map(|axis| from.uv[axis] + 0.5 * chord[axis] + (leaving[axis] - arriving[axis]) / 8.0);
            let area = match offset_of_middle(surface, curve, side, middle) {
                Some(offset) => cubic - 2.0 / 3.0 * turn(chord, offset),
                None => cubic,
            };
            let area = area * 0.5 * (density(from) + density(to));
            let length = distance(from.point, to.point);
            // A sliver as large as the square over its side is a wrong turn, no piece of the face.
            if area.abs() <= length * length { area } else { 0.0 }
        }
    }
}

/// Straight edges are straight in the parameter plane of these.
fn is_ruled(surface: &Surface) -> bool {
    matches!(surface, Surface::Plane(_) | Surface::Cylinder { .. } | Surface::Cone { .. } | Surface::Extrusion { .. })
}

/// Between an arc of an ellipse and its chord.
fn ellipse_segment(plane: &Frame, frame: &Frame, product_of_radii: f64, turn: f64) -> f64 {
    let hand = dot(frame.z, plane.z).signum();
    0.5 * hand * product_of_radii * (turn - libm::sin(turn))
}

fn density(node: &Node) -> f64 {
    norm(cross(node.tangents[0], node.tangents[1]))
}

/// The curve's directions at both ends of a side in the parameter plane, for a parameter from 0 to 1; `tangents` are
/// the surface's there.
fn directions(curve: &Curve, side: &Side, chord: [f64; 2], tangents: [[Point; 2]; 2]) -> [[f64; 2]; 2] {
    let (start, length) = (side.segment.from, side.segment.to - side.segment.from);
    let direction = |part: f64| curve.derivative(start + part * length).1.map(|x| x * length);
    let leaving = in_parameters(tangents[0], direction(INSIDE));
    let arriving = in_parameters(tangents[1], direction(1.0 - INSIDE));
    // At a pole no direction is known: a parabola needs only one.
    let opposite = |known: [f64; 2]| [2.0 * chord[0] - known[0], 2.0 * chord[1] - known[1]];
    match (leaving, arriving) {
        (Some(leaving), Some(arriving)) => [leaving, arriving],
        (Some(leaving), None) => [leaving, opposite(leaving)],
        (None, Some(arriving)) => [opposite(arriving), arriving],
        (None, None) => [chord; 2],
    }
}

/// Between the chord and the cubic that has these directions at its ends: ½∮(x dy − y dx) over it.
fn cubic_segment(chord: [f64; 2], leaving: [f64; 2], arriving: [f64; 2]) -> f64 {
    0.5 * ((turn(chord, arriving) - turn(chord, leaving)) / 5.0 - turn(leaving, arriving) / 30.0)
}

/// How far from the cubic's middle that of the curve lies, in the parameter plane. Two thirds of it, times the chord,
/// is what Simpson's rule adds. None for a conic, which bends evenly, and where the parameters degenerate.
fn offset_of_middle(surface: &Surface, curve: &Curve, side: &Side, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
    if matches!(curve, Curve::Line { .. } | Curve::Ellipse { .. } | Curve::Parabola { .. } | Curve::Hyperbola { .. }) {
        return None;
    }
    let (foot, du, dv) = surface.derivatives(u, v);
    let middle = curve.point(0.5 * (side.segment.from + side.segment.to));
    in_parameters([du, dv], subtract(middle, foot))
}

/// A direction of space as a direction of the parameter plane; nothing where the parameters degenerate.
fn in_parameters([du, dv]: [Point; 2], direction: Point) -> Option<[f64; 2]> {
    let (a, b, c) = (dot(du, du), dot(du, dv), dot(dv, dv));
    let determinant = a * c - b * b;
    if determinant <= 1e-10 * a * c || determinant.is_nan() {
        return None;
    }
    let (g, h) = (dot(du, direction), dot(dv, direction));
    Some([(c * g - b * h) / determinant, (a * h - b * g) / determinant])
}

fn turn(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
