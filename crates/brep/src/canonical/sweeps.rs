//! Recognizes the sweeps of lines and circles that are primitives by their definition.

use crate::geometry::{Curve, Frame, Surface};
use partprobe_shape::{FaceType, Point, cross, dot, norm, subtract};

/// The type of a swept line or circle. Returns `Some(None)` if the sweep is not a primitive, and `None` if a fit must decide.
pub(super) fn swept_type(surface: &Surface, tolerance: f64) -> Option<Option<FaceType>> {
    match surface {
        Surface::Extrusion { curve, .. } if matches!(**curve, Curve::Line { .. }) => {
            Some(Some(FaceType::Plane))
        }
        Surface::Revolution { axis, curve } => match &**curve {
            Curve::Line { origin, direction } => {
                Some(revolved_line(axis, *origin, *direction, tolerance))
            }
            Curve::Ellipse { frame, rx, ry } if rx == ry => {
                Some(revolved_circle(axis, frame, rx.abs(), tolerance))
            }
            _ => None,
        },
        _ => None,
    }
}

/// Sines below this count as zero. Over the whole diagonal, such an angle causes a deviation equal to the tolerance of a point.
const PARALLEL: f64 = 1e-6;

fn revolved_line(
    axis: &Frame,
    origin: Point,
    direction: Point,
    tolerance: f64,
) -> Option<FaceType> {
    let length = norm(direction);
    let (across, along) = (cross(direction, axis.z), dot(direction, axis.z));
    let from_axis = subtract(origin, axis.origin);
    if norm(across) <= PARALLEL * length {
        return Some(FaceType::Cylinder);
    }
    if along.abs() <= PARALLEL * length {
        return Some(FaceType::Plane);
    }
    // A line that passes the axis at a distance makes a hyperboloid.
    (dot(from_axis, across).abs() <= tolerance * norm(across)).then_some(FaceType::Cone)
}

fn revolved_circle(axis: &Frame, circle: &Frame, radius: f64, tolerance: f64) -> Option<FaceType> {
    let center = subtract(circle.origin, axis.origin);
    let from_axis = norm(cross(center, axis.z));
    let in_its_plane =
        dot(axis.z, circle.z).abs() <= PARALLEL && dot(center, circle.z).abs() <= tolerance;
    match in_its_plane && radius > 0.0 {
        true if from_axis <= tolerance => Some(FaceType::Sphere),
        true => Some(FaceType::Torus),
        false => None,
    }
}
