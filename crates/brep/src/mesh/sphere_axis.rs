//! A sphere may have any axis: the one is chosen that keeps its poles out of a face's way.

use super::boundary::BoundaryPoint;
use crate::geometry::Frame;
use crate::geometry::linear::{scaled, sum, unit};
use carrier::{Point, cross, distance, dot, subtract};

/// The frame in which a small patch lies on the equator, and a larger one has a pole inside its widest loop.
pub(crate) fn sphere_frame(frame: &Frame, loops: &[Vec<BoundaryPoint>], radius: f64) -> Frame {
    let widest = loops.iter().max_by(|a, b| perimeter(a).total_cmp(&perimeter(b)));
    let normal = match (loops, widest) {
        ([_, _, ..], Some(widest)) => area_vector(widest),
        _ => loops.iter().fold([0.0; 3], |total, corners| sum(total, area_vector(corners))),
    };
    // A loop that encloses next to nothing, such as a meridian there and back, has no direction.
    if dot(normal, normal) <= (1e-12 * radius * radius) * (1e-12 * radius * radius) {
        return *frame;
    }
    let Some(toward) = unit(normal) else { return *frame };
    let is_patch = loops
        .iter()
        .flatten()
        .all(|corner| unit(subtract(corner.point, frame.origin)).is_some_and(|arm| dot(arm, toward) > 0.3));
    if is_patch {
        let around = Frame::new(frame.origin, Some(toward), Some(frame.x));
        Frame::new(frame.origin, Some(around.x), Some(toward))
    } else {
        Frame::new(frame.origin, Some(toward), Some(frame.x))
    }
}

fn perimeter(corners: &[BoundaryPoint]) -> f64 {
    sides(corners).map(|(a, b)| distance(a, b)).sum()
}

fn area_vector(corners: &[BoundaryPoint]) -> Point {
    let Some(first) = corners.first().map(|corner| corner.point) else { return [0.0; 3] };
    sides(corners)
        .fold([0.0; 3], |total, (a, b)| sum(total, scaled(cross(subtract(a, first), subtract(b, first)), 0.5)))
}

fn sides(corners: &[BoundaryPoint]) -> impl Iterator<Item = (Point, Point)> + '_ {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| (a.point, b.point))
}
