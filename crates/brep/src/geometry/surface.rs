//! Evaluates surfaces: points, derivatives, normals, range and period.

use super::bspline_basis::jumps_at_a_knot;
use super::linear::{along, scaled, sum, unit};
use super::types::{Curve, Frame, Surface};
use partprobe_shape::{Point, cross, dot, norm, subtract};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

impl Surface {
    /// The point at (u, v).
    #[must_use]
    pub fn point(&self, u: f64, v: f64) -> Point {
        match self {
            Self::Plane(frame) => frame.point(u, v, 0.0),
            Self::Extrusion { curve, direction } => along(curve.point(u), *direction, v),
            Self::Offset { basis, distance } => offset_point(basis, *distance, u, v),
            _ => self.derivatives(u, v).0,
        }
    }

    /// Point, ∂u and ∂v at (u, v).
    #[must_use]
    pub fn derivatives(&self, u: f64, v: f64) -> (Point, Point, Point) {
        match self {
            Self::Plane(frame) => (frame.point(u, v, 0.0), frame.x, frame.y),
            Self::Cylinder { frame, radius } => {
                rotated_meridian(frame, u, [*radius, v], [0.0, 1.0])
            }
            Self::Cone {
                frame,
                radius,
                slope,
            } => rotated_meridian(frame, u, [radius + v * slope, v], [*slope, 1.0]),
            Self::Sphere { frame, radius } => {
                let (sin, cos) = libm::sincos(v);
                rotated_meridian(
                    frame,
                    u,
                    [radius * cos, radius * sin],
                    [-radius * sin, radius * cos],
                )
            }
            Self::Torus {
                frame,
                major,
                minor,
            } => {
                let (sin, cos) = libm::sincos(v);
                rotated_meridian(
                    frame,
                    u,
                    [major + minor * cos, minor * sin],
                    [-minor * sin, minor * cos],
                )
            }
            Self::Bspline(spline) => spline.derivatives(u, v),
            Self::Revolution { axis, curve } => revolved(axis, curve, u, v),
            Self::Extrusion { curve, direction } => {
                let (point, slope) = curve.derivative(u);
                (along(point, *direction, v), slope, *direction)
            }
            Self::Offset { basis, distance } => offset_derivatives(self, basis, *distance, u, v),
            Self::Composite(composite) => composite.derivatives(u, v),
            Self::Facets(facets) => facets.derivatives(u, v),
        }
    }

    /// The unit normal `∂u × ∂v` at (u, v). Returns `None` at an apex, at the pole of a spline and on a cusp.
    ///
    /// A sphere and a torus have a normal everywhere. At a pole it is the limit along the meridian u.
    #[must_use]
    pub fn unit_normal(&self, u: f64, v: f64) -> Option<Point> {
        match self {
            Self::Plane(frame) => Some(frame.z),
            Self::Cylinder { frame, .. } => Some(radial(frame, u, 1.0, 0.0)),
            Self::Cone {
                frame,
                radius,
                slope,
            } => {
                let reach = radius + v * slope;
                let side = if reach < 0.0 { -1.0 } else { 1.0 };
                let length = side * (1.0 + slope * slope).sqrt();
                let at_apex = reach.abs() <= 1e-12 * (radius.abs() + (v * slope).abs());
                (!at_apex).then(|| radial(frame, u, 1.0 / length, -slope / length))
            }
            Self::Sphere { frame, .. } => {
                let (sin, cos) = libm::sincos(v);
                Some(radial(frame, u, cos, sin))
            }
            Self::Torus {
                frame,
                major,
                minor,
            } => {
                let (sin, cos) = libm::sincos(v);
                let side = if major + minor * cos < 0.0 { -1.0 } else { 1.0 };
                Some(radial(frame, u, side * cos, side * sin))
            }
            Self::Bspline(_)
            | Self::Revolution { .. }
            | Self::Extrusion { .. }
            | Self::Offset { .. }
            | Self::Composite(_)
            | Self::Facets(_) => {
                let (_, du, dv) = self.derivatives(u, v);
                self.normal_of_tangents(du, dv)
            }
        }
    }

    /// The point and the unit normal at (u, v). If the normal needs the tangents, the surface is evaluated only once.
    pub(crate) fn point_and_normal(&self, u: f64, v: f64) -> (Point, Option<Point>) {
        match self {
            Self::Plane(_)
            | Self::Cylinder { .. }
            | Self::Cone { .. }
            | Self::Sphere { .. }
            | Self::Torus { .. } => (self.point(u, v), self.unit_normal(u, v)),
            _ => {
                let (point, du, dv) = self.derivatives(u, v);
                (point, self.normal_of_tangents(du, dv))
            }
        }
    }

    /// The normal at `at`. Where it is undefined, this is its limit on the way from `inside`.
    #[must_use]
    pub fn limit_normal(&self, at: [f64; 2], inside: [f64; 2]) -> Option<Point> {
        self.unit_normal(at[0], at[1]).or_else(|| {
            [1e-6, 1e-4, 1e-2].iter().find_map(|step| {
                self.unit_normal(
                    at[0] + step * (inside[0] - at[0]),
                    at[1] + step * (inside[1] - at[1]),
                )
            })
        })
    }

    /// The period of u and of v. A period is `None` if the surface does not close.
    #[must_use]
    pub fn period(&self) -> [Option<f64>; 2] {
        match self {
            Self::Plane(_) | Self::Facets(_) => [None, None],
            Self::Cylinder { .. } | Self::Cone { .. } | Self::Sphere { .. } => [Some(TAU), None],
            Self::Torus { major, minor, .. } => [Some(TAU), (major.abs() > *minor).then_some(TAU)],
            Self::Bspline(spline) => {
                let [u, v] = spline.range();
                [
                    spline.closed_u.then_some(u.1 - u.0),
                    spline.closed_v.then_some(v.1 - v.0),
                ]
            }
            Self::Revolution { curve, .. } => [Some(TAU), curve.period()],
            Self::Extrusion { curve, .. } => [curve.period(), None],
            Self::Offset { basis, .. } => basis.period(),
            Self::Composite(composite) => {
                let [u, v] = composite.range();
                [
                    composite.closed_u.then_some(u.1),
                    composite.closed_v.then_some(v.1),
                ]
            }
        }
    }

    /// The natural bounds of u and v. An end without a bound is infinite.
    #[must_use]
    pub fn range(&self) -> [Option<(f64, f64)>; 2] {
        let turn = Some((0.0, TAU));
        match self {
            Self::Plane(_) => [None, None],
            Self::Cylinder { .. } => [turn, None],
            Self::Cone { radius, slope, .. } => [turn, cone_range(*radius, *slope)],
            Self::Sphere { .. } => [turn, Some((-FRAC_PI_2, FRAC_PI_2))],
            Self::Torus { major, minor, .. } if major.abs() > *minor => [turn, turn],
            Self::Torus { major, minor, .. } => {
                let end = if major == minor {
                    PI
                } else {
                    libm::acos(-major / minor)
                };
                [turn, Some((-end, end))]
            }
            Self::Bspline(spline) => spline.range().map(Some),
            Self::Revolution { curve, .. } => [turn, curve.range()],
            Self::Extrusion { curve, .. } => [curve.range(), None],
            Self::Offset { basis, .. } => basis.range(),
            Self::Composite(composite) => composite.range().map(Some),
            Self::Facets(facets) => facets.range().map(Some),
        }
    }

    /// The extents of u and v, by which the two tangents are compared. The extent is 1 if a direction has no ends.
    pub(crate) fn extent(&self) -> [f64; 2] {
        self.range().map(|range| match range {
            Some((low, high)) if (high - low).is_finite() && high > low => high - low,
            _ => 1.0,
        })
    }

    /// Whether the tangents may jump somewhere inside, for example at a knot whose multiplicity reaches the degree.
    pub(crate) fn has_kinks(&self) -> bool {
        match self {
            Self::Bspline(spline) => {
                jumps_at_a_knot(&spline.knots_u, spline.degree_u)
                    || jumps_at_a_knot(&spline.knots_v, spline.degree_v)
            }
            Self::Revolution { curve, .. } | Self::Extrusion { curve, .. } => curve.has_kinks(),
            Self::Offset { basis, .. } => basis.has_kinks(),
            Self::Composite(_) | Self::Facets(_) => true,
            Self::Plane(_)
            | Self::Cylinder { .. }
            | Self::Cone { .. }
            | Self::Sphere { .. }
            | Self::Torus { .. } => false,
        }
    }

    fn normal_of_tangents(&self, du: Point, dv: Point) -> Option<Point> {
        let extent = self.extent();
        let (reach_u, reach_v) = (norm(du) * extent[0], norm(dv) * extent[1]);
        let across = cross(du, dv);
        let vanishes = reach_u.min(reach_v) <= 1e-9 * reach_u.max(reach_v);
        let parallel = norm(across) <= 1e-9 * norm(du) * norm(dv);
        if vanishes || parallel {
            None
        } else {
            unit(across)
        }
    }
}

/// The vector `out·(cos u·x + sin u·y) + up·z`.
fn radial(frame: &Frame, u: f64, out: f64, up: f64) -> Point {
    let (sin, cos) = libm::sincos(u);
    frame.vector(out * cos, out * sin, up)
}

/// A meridian at (distance from the axis, height), with its derivative, rotated by u.
fn rotated_meridian(
    frame: &Frame,
    u: f64,
    [reach, height]: [f64; 2],
    slope: [f64; 2],
) -> (Point, Point, Point) {
    let (sin, cos) = libm::sincos(u);
    (
        frame.point(reach * cos, reach * sin, height),
        frame.vector(-reach * sin, reach * cos, 0.0),
        frame.vector(slope[0] * cos, slope[0] * sin, slope[1]),
    )
}

fn revolved(axis: &Frame, curve: &Curve, u: f64, v: f64) -> (Point, Point, Point) {
    let (point, slope) = curve.derivative(v);
    let [x, y, z] = axis.local(point);
    let (dx, dy, dz) = (dot(slope, axis.x), dot(slope, axis.y), dot(slope, axis.z));
    let (sin, cos) = libm::sincos(u);
    (
        axis.point(x * cos - y * sin, x * sin + y * cos, z),
        axis.vector(-x * sin - y * cos, x * cos - y * sin, 0.0),
        axis.vector(dx * cos - dy * sin, dx * sin + dy * cos, dz),
    )
}

fn offset_point(basis: &Surface, distance: f64, u: f64, v: f64) -> Point {
    let normal = basis.unit_normal(u, v).unwrap_or([0.0; 3]);
    along(basis.point(u, v), normal, distance)
}

/// Tangents of an offset, by differences of the normal of its basis. They are used if the basis has no second derivative in
/// closed form.
fn offset_derivatives(
    surface: &Surface,
    basis: &Surface,
    distance: f64,
    u: f64,
    v: f64,
) -> (Point, Point, Point) {
    let (point, du, dv) = basis.derivatives(u, v);
    let [extent_u, extent_v] = surface.extent();
    let normal = |u: f64, v: f64| basis.unit_normal(u, v);
    let bent = |tangent: Point, plus: Option<Point>, minus: Option<Point>, step: f64| match (
        plus, minus,
    ) {
        (Some(plus), Some(minus)) => sum(
            tangent,
            scaled(subtract(plus, minus), 0.5 * distance / step),
        ),
        _ => tangent,
    };
    let (step_u, step_v) = (1e-6 * extent_u, 1e-6 * extent_v);
    (
        along(point, normal(u, v).unwrap_or([0.0; 3]), distance),
        bent(du, normal(u + step_u, v), normal(u - step_u, v), step_u),
        bent(dv, normal(u, v + step_v), normal(u, v - step_v), step_v),
    )
}

/// The range of v on the nappe of a cone on which its radius is positive.
fn cone_range(radius: f64, slope: f64) -> Option<(f64, f64)> {
    if slope > 0.0 {
        Some((-radius / slope, f64::INFINITY))
    } else if slope < 0.0 {
        Some((f64::NEG_INFINITY, -radius / slope))
    } else {
        None
    }
}
