//! Projects points onto extrusions and surfaces of revolution, by a search along their curve.

use super::gauss_newton::BELIEVED;
use super::linear::along;
use super::nearest::{follow_seed, nearest_parameter, squared};
use super::types::{Curve, Frame};
use partprobe_shape::{Point, dot, norm, subtract};

/// Two points of a revolved curve give one circle if their squared distance is below this fraction of the squared size.
const COVERED_TWICE: f64 = 1e-16;

pub(super) fn on_extrusion(
    curve: &Curve,
    direction: Point,
    p: Point,
    seed: Option<[f64; 2]>,
) -> [f64; 2] {
    let across = |arm: Point| {
        along(
            arm,
            direction,
            -dot(arm, direction) / dot(direction, direction),
        )
    };
    let residual = |t: f64| {
        let (point, slope) = curve.derivative(t);
        (across(subtract(point, p)), across(slope))
    };
    let u = match curve {
        Curve::Line { .. } => follow_seed(0.0, residual).1,
        _ => along_curve(curve, p, seed.map(|uv| uv[0]), residual),
    };
    [
        u,
        dot(subtract(p, curve.point(u)), direction) / dot(direction, direction),
    ]
}

pub(super) fn on_revolution(
    axis: &Frame,
    curve: &Curve,
    p: Point,
    seed: Option<[f64; 2]>,
) -> [f64; 2] {
    let [x, y, z] = axis.local(p);
    let out = libm::hypot(x, y);
    let residual = |t: f64| {
        let (point, slope) = curve.derivative(t);
        let [cx, cy, cz] = axis.local(point);
        let (dx, dy, dz) = (dot(slope, axis.x), dot(slope, axis.y), dot(slope, axis.z));
        let reach = libm::hypot(cx, cy);
        let widening = if reach > 0.0 {
            (cx * dx + cy * dy) / reach
        } else {
            libm::hypot(dx, dy)
        };
        ([reach - out, cz - z, 0.0], [widening, dz, 0.0])
    };
    let v = match (
        near_seed(curve, seed.map(|uv| uv[1]), residual),
        meridian_direction(axis, curve, p),
    ) {
        (Some(v), _) => v,
        (None, None) => nearest_parameter(&curve.samples(p), residual),
        (None, Some(toward)) => {
            // A meridian in one plane with the axis may cross it, and each side has a nearest point of its own.
            let samples = curve.samples(p);
            let sides = [out, -out].map(|out| {
                let residual = |t: f64| {
                    let (point, slope) = curve.derivative(t);
                    let reach = dot(subtract(point, axis.origin), toward);
                    (
                        [reach - out, axis.local(point)[2] - z, 0.0],
                        [dot(slope, toward), dot(slope, axis.z), 0.0],
                    )
                };
                let v = nearest_parameter(&samples, residual);
                (residual(v).0, v)
            });
            let [(gap, v), (gap_beyond, v_beyond)] = sides;
            // A closed curve that the axis cuts into equal halves covers its surface twice, with opposite normals. The
            // meridian is then the half in which the curve's parameter begins; exporters begin it at the equator. That
            // does not depend on how far from the surface the point lies: it may be nearer to either half by an ulp.
            let size = squared(subtract(p, axis.origin)).max(out * out);
            let apart = [gap[0] + gap_beyond[0], gap[1] - gap_beyond[1], 0.0];
            if squared(apart) <= COVERED_TWICE * size {
                let start = curve.range().map_or(0.0, |(low, _)| low);
                let begins_beyond = dot(subtract(curve.point(start), axis.origin), toward) < 0.0;
                if begins_beyond { v_beyond } else { v }
            } else if squared(gap_beyond) < squared(gap) {
                v_beyond
            } else {
                v
            }
        }
    };
    let [cx, cy, _] = axis.local(curve.point(v));
    let is_on_axis = cx.hypot(cy) <= 1e-12 * norm(subtract(p, axis.origin)).max(out);
    [
        if is_on_axis {
            0.0
        } else {
            libm::atan2(y, x) - libm::atan2(cy, cx)
        },
        v,
    ]
}

/// The best parameter of a profile curve: near the seed if that fits, else anywhere on the curve.
pub(super) fn along_curve(
    curve: &Curve,
    p: Point,
    seed: Option<f64>,
    residual: impl Fn(f64) -> (Point, Point),
) -> f64 {
    near_seed(curve, seed, &residual)
        .unwrap_or_else(|| nearest_parameter(&curve.samples(p), residual))
}

/// The parameter to which a seed leads, if the point is believed.
pub(super) fn near_seed(
    curve: &Curve,
    seed: Option<f64>,
    residual: impl Fn(f64) -> (Point, Point),
) -> Option<f64> {
    let (squared_distance, t) = follow_seed(seed?, &residual);
    let extent = curve.range().map_or(1.0, |(low, high)| high - low);
    let size = norm(curve.derivative(t).1) * extent;
    let inside = curve.period().is_some()
        || curve
            .range()
            .is_none_or(|(low, high)| t >= low && t <= high);
    (inside && squared_distance.sqrt() <= BELIEVED * size).then_some(t)
}

/// The direction in which a meridian leaves the axis, where it lies in one plane with it.
pub(super) fn meridian_direction(axis: &Frame, curve: &Curve, p: Point) -> Option<Point> {
    let arms: Vec<[f64; 2]> = curve
        .samples(p)
        .iter()
        .map(|&t| axis.local(curve.point(t)))
        .map(|[x, y, _]| [x, y])
        .collect();
    let farthest = arms
        .iter()
        .copied()
        .max_by(|a, b| libm::hypot(a[0], a[1]).total_cmp(&libm::hypot(b[0], b[1])))?;
    let reach = libm::hypot(farthest[0], farthest[1]);
    let is_planar = arms
        .iter()
        .all(|arm| (arm[0] * farthest[1] - arm[1] * farthest[0]).abs() <= 1e-7 * reach * reach);
    (is_planar && reach > 0.0).then(|| axis.vector(farthest[0] / reach, farthest[1] / reach, 0.0))
}
