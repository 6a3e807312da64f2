//! Projects points onto extrusions and surfaces of revolution, by a search along their curve.

use super::gauss_newton::ON_SURFACE;
use super::linear::along;
use super::nearest::{follow_seed, nearest_parameter, squared};
use super::types::{Curve, Frame};
use partprobe_shape::{Point, dot, norm, subtract};

/// Two points of a revolved curve give the same circle if their squared distance is below this fraction of the squared size.
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
    let revolved = RevolvedPoint::of(axis, curve, p);
    let v = revolved.along_meridian(seed.map(|uv| uv[1]));
    [revolved.around_axis(v), v]
}

/// A point that is projected onto a surface of revolution.
struct RevolvedPoint<'a> {
    axis: &'a Frame,
    curve: &'a Curve,
    p: Point,
    /// The point's coordinates in the frame of the axis.
    local: Point,
    /// Its distance from the axis.
    out: f64,
}

/// The result of the search on one side of the axis.
#[derive(Clone, Copy)]
struct MeridianFoot {
    /// The vector from the foot to the point: outward, and along the axis.
    gap: Point,
    v: f64,
}

impl<'a> RevolvedPoint<'a> {
    fn of(axis: &'a Frame, curve: &'a Curve, p: Point) -> Self {
        let local = axis.local(p);
        Self {
            axis,
            curve,
            p,
            local,
            out: libm::hypot(local[0], local[1]),
        }
    }

    /// The parameter of the curve whose circle is nearest to the point.
    fn along_meridian(&self, seed: Option<f64>) -> f64 {
        let residual = |t: f64| self.to_circle(t);
        if let Some(v) = near_seed(self.curve, seed, residual) {
            return v;
        }
        match meridian_direction(self.axis, self.curve, self.p) {
            None => nearest_parameter(&self.curve.samples(self.p), residual),
            Some(toward) => self.on_plane_meridian(toward),
        }
    }

    /// The difference between the point and the circle of a curve point, outward and along the axis, and its derivative.
    fn to_circle(&self, t: f64) -> (Point, Point) {
        let axis = self.axis;
        let (point, slope) = self.curve.derivative(t);
        let [cx, cy, cz] = axis.local(point);
        let (dx, dy, dz) = (dot(slope, axis.x), dot(slope, axis.y), dot(slope, axis.z));
        let reach = libm::hypot(cx, cy);
        let widening = if reach > 0.0 {
            (cx * dx + cy * dy) / reach
        } else {
            libm::hypot(dx, dy)
        };
        (
            [reach - self.out, cz - self.local[2], 0.0],
            [widening, dz, 0.0],
        )
    }

    /// The nearest parameter of a meridian that lies in one plane with the axis. The plane leaves the axis in the direction
    /// `toward`.
    ///
    /// Such a meridian may cross the axis. Then each side has its own nearest point.
    fn on_plane_meridian(&self, toward: Point) -> f64 {
        let samples = self.curve.samples(self.p);
        let [here, beyond] =
            [self.out, -self.out].map(|out| self.foot_in_plane(&samples, toward, out));
        if self.is_covered_twice(here.gap, beyond.gap) {
            if self.starts_on_far_side(toward) {
                beyond.v
            } else {
                here.v
            }
        } else if squared(beyond.gap) < squared(here.gap) {
            beyond.v
        } else {
            here.v
        }
    }

    /// The parameter nearest to the point at the distance `out` from the axis. A negative distance is beyond the axis.
    fn foot_in_plane(&self, samples: &[f64], toward: Point, out: f64) -> MeridianFoot {
        let axis = self.axis;
        let residual = |t: f64| {
            let (point, slope) = self.curve.derivative(t);
            let reach = dot(subtract(point, axis.origin), toward);
            (
                [reach - out, axis.local(point)[2] - self.local[2], 0.0],
                [dot(slope, toward), dot(slope, axis.z), 0.0],
            )
        };
        let v = nearest_parameter(samples, residual);
        MeridianFoot {
            gap: residual(v).0,
            v,
        }
    }

    /// Whether both sides of the curve give the same circle.
    ///
    /// A closed curve that the axis cuts into equal halves covers its surface twice, with opposite normals. The meridian is then
    /// the half in which the curve's parameter begins. Exporters begin it at the equator. The distance of the point does not
    /// decide, because rounding may make it nearer to either half.
    fn is_covered_twice(&self, gap: Point, gap_beyond: Point) -> bool {
        let size = squared(subtract(self.p, self.axis.origin)).max(self.out * self.out);
        let gap_vector = [gap[0] + gap_beyond[0], gap[1] - gap_beyond[1], 0.0];
        squared(gap_vector) <= COVERED_TWICE * size
    }

    /// Whether the curve begins on the side of the axis that is away from the point.
    fn starts_on_far_side(&self, toward: Point) -> bool {
        let start = self.curve.range().map_or(0.0, |(low, _)| low);
        dot(subtract(self.curve.point(start), self.axis.origin), toward) < 0.0
    }

    /// The angle by which the curve must be rotated to reach the point.
    fn around_axis(&self, v: f64) -> f64 {
        let [x, y, _] = self.local;
        let [cx, cy, _] = self.axis.local(self.curve.point(v));
        let is_on_axis =
            cx.hypot(cy) <= 1e-12 * norm(subtract(self.p, self.axis.origin)).max(self.out);
        if is_on_axis {
            0.0
        } else {
            libm::atan2(y, x) - libm::atan2(cy, cx)
        }
    }
}

/// The best parameter of a profile curve. If the result near the seed does not fit, the whole curve is searched.
pub(super) fn along_curve(
    curve: &Curve,
    p: Point,
    seed: Option<f64>,
    residual: impl Fn(f64) -> (Point, Point),
) -> f64 {
    near_seed(curve, seed, &residual)
        .unwrap_or_else(|| nearest_parameter(&curve.samples(p), residual))
}

/// The parameter to which a seed leads. Returns `None` if the point there is not accepted.
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
    (inside && squared_distance.sqrt() <= ON_SURFACE * size).then_some(t)
}

/// The direction in which a meridian leaves the axis. Returns `None` if they do not lie in one plane.
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
