//! Chooses an axis of a sphere whose poles are away from a face's boundary. Any axis gives the same sphere.

use super::boundary::BoundaryPoint;
use crate::geometry::Frame;
use crate::geometry::linear::{scaled, sum, unit};
use partprobe_shape::{Point, cross, distance, dot, subtract};

/// A loop whose area is below this fraction of its squared perimeter is a sliver: about 24 times as long as wide.
const SLIVER: f64 = 0.01;
/// If the sine of a face's largest latitude is below this value, the face is far enough from the poles.
const NEAR_EQUATOR: f64 = 0.3;

/// The rotated frame of a sphere. A small patch or a long sliver lies on its equator. A larger face has a pole inside its widest
/// loop.
pub(crate) fn sphere_frame(frame: &Frame, loops: &[Vec<BoundaryPoint>], radius: f64) -> Frame {
    let widest = loops
        .iter()
        .max_by(|a, b| perimeter(a).total_cmp(&perimeter(b)));
    let normal = match (loops, widest) {
        ([_, _, ..], Some(widest)) => area_vector(widest),
        _ => loops
            .iter()
            .fold([0.0; 3], |total, corners| sum(total, area_vector(corners))),
    };
    // A loop that encloses almost nothing, such as a meridian walked in both directions, has no direction.
    if dot(normal, normal) <= (1e-12 * radius * radius) * (1e-12 * radius * radius) {
        return *frame;
    }
    let Some(toward) = unit(normal) else {
        return *frame;
    };
    if let [corners] = loops
        && dot(normal, normal).sqrt() < SLIVER * perimeter(corners) * perimeter(corners)
        && let Some(along) = frame_along(frame, corners)
    {
        return along;
    }
    let is_patch = loops.iter().flatten().all(|corner| {
        unit(subtract(corner.point, frame.origin)).is_some_and(|arm| dot(arm, toward) > 0.3)
    });
    if is_patch {
        let around = Frame::new(frame.origin, Some(toward), Some(frame.x));
        Frame::new(frame.origin, Some(around.x), Some(toward))
    } else {
        Frame::new(frame.origin, Some(toward), Some(frame.x))
    }
}

/// The frame whose equator a sliver follows, for example a lune from pole to pole. Returns `None` if the sliver follows no great
/// circle. A pole inside such a thin face would be much nearer to its long sides than the corners of these sides are to each
/// other.
fn frame_along(frame: &Frame, corners: &[BoundaryPoint]) -> Option<Frame> {
    let arms: Vec<Point> = corners
        .iter()
        .map(|corner| unit(subtract(corner.point, frame.origin)))
        .collect::<Option<_>>()?;
    let first = *arms.first()?;
    let normals = arms.iter().map(|&arm| cross(first, arm));
    let normal = normals
        .max_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)))
        .and_then(unit)?;

    let is_beside = arms
        .iter()
        .all(|&arm| dot(arm, normal).abs() < NEAR_EQUATOR);
    is_beside.then(|| Frame::new(frame.origin, Some(normal), Some(first)))
}

fn perimeter(corners: &[BoundaryPoint]) -> f64 {
    sides(corners).map(|(a, b)| distance(a, b)).sum()
}

fn area_vector(corners: &[BoundaryPoint]) -> Point {
    let Some(first) = corners.first().map(|corner| corner.point) else {
        return [0.0; 3];
    };
    sides(corners).fold([0.0; 3], |total, (a, b)| {
        sum(
            total,
            scaled(cross(subtract(a, first), subtract(b, first)), 0.5),
        )
    })
}

fn sides(corners: &[BoundaryPoint]) -> impl Iterator<Item = (Point, Point)> + '_ {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| (a.point, b.point))
}
