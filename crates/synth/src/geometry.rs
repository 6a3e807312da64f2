//! Defines the curves and surfaces of a shape, with normals in closed form.

use crate::frame::{Frame, Planar, added, scaled, unit};
use crate::patch::Patch;
use crate::spline;
use partprobe_carrier::{FaceType, Point, cross, dot, subtract};
use std::f64::consts::TAU;

/// The curve of an edge. It has the direction of the edge.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Curve {
    /// A straight line between the edge's ends.
    Line,
    /// A circle, anticlockwise in the frame's plane.
    Circle { frame: Frame, radius: f64 },
    /// An ellipse, anticlockwise in the frame's plane, with its axes along x and y.
    Ellipse {
        frame: Frame,
        along_x: f64,
        along_y: f64,
    },
    /// A clamped uniform cubic spline with these control points.
    Spline(Vec<Point>),
}

impl Curve {
    /// The point at half of the edge's parameter range.
    pub(crate) fn middle(&self, start: Point, end: Point) -> Point {
        match self {
            Self::Line => scaled(added(start, end), 0.5),
            Self::Circle { frame, radius } => conic_middle(frame, [*radius; 2], start, end),
            Self::Ellipse {
                frame,
                along_x,
                along_y,
            } => conic_middle(frame, [*along_x, *along_y], start, end),
            Self::Spline(controls) => spline::point(controls, 0.5),
        }
    }
}

fn conic_middle(frame: &Frame, [a, b]: Planar, start: Point, end: Point) -> Point {
    let angle = |point| {
        let [x, y, _] = frame.coordinates(point);
        libm::atan2(y / b, x / a)
    };
    let (from, to) = (angle(start), angle(end));
    let turn = if to - from <= 1e-9 {
        to - from + TAU
    } else {
        to - from
    };
    let middle = from + turn / 2.0;
    frame.point([a * libm::cos(middle), b * libm::sin(middle)], 0.0)
}

/// The surface of a face. Lengths are in millimeters, angles in radians.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Surface {
    /// The plane through the origin, normal to z.
    Plane(Frame),
    /// A cylinder about z.
    Cylinder { frame: Frame, radius: f64 },
    /// A cone about z that widens along z. `radius` is its radius at the origin.
    Cone {
        frame: Frame,
        radius: f64,
        half_angle: f64,
    },
    /// A sphere about the origin.
    Sphere { frame: Frame, radius: f64 },
    /// A torus about z.
    Torus {
        frame: Frame,
        major: f64,
        minor: f64,
    },
    /// A cubic B-spline surface.
    Patch(Patch),
    /// A spline moved along a direction.
    Extrusion { controls: Vec<Point>, along: Point },
    /// A spline revolved about z.
    Revolution { controls: Vec<Point>, axis: Frame },
}

impl Surface {
    /// The primitive type of the STEP entity that the surface is written as.
    pub(crate) fn face_type(&self) -> FaceType {
        match self {
            Self::Plane(_) => FaceType::Plane,
            Self::Cylinder { .. } => FaceType::Cylinder,
            Self::Cone { .. } => FaceType::Cone,
            Self::Sphere { .. } => FaceType::Sphere,
            Self::Torus { .. } => FaceType::Torus,
            Self::Patch(_) => FaceType::Bspline,
            Self::Extrusion { .. } => FaceType::Extrusion,
            Self::Revolution { .. } => FaceType::Revolution,
        }
    }

    /// The unit normal of the surface at one of its points.
    pub(crate) fn normal(&self, point: Point) -> Point {
        match self {
            Self::Plane(frame) => frame.z,
            Self::Cylinder { frame, .. } => unit(radial(frame, point)),
            Self::Cone {
                frame, half_angle, ..
            } => {
                let outward = scaled(unit(radial(frame, point)), libm::cos(*half_angle));
                added(outward, scaled(frame.z, -libm::sin(*half_angle)))
            }
            Self::Sphere { frame, .. } => unit(subtract(point, frame.origin)),
            Self::Torus { frame, major, .. } => {
                let ring = added(frame.origin, scaled(unit(radial(frame, point)), *major));
                unit(subtract(point, ring))
            }
            Self::Patch(patch) => patch.normal(point),
            Self::Extrusion { controls, along } => {
                let across = |p: Point| subtract(p, scaled(*along, dot(p, *along)));
                let flat: Vec<Point> = controls.iter().copied().map(across).collect();
                unit(cross(
                    spline::slope(&flat, spline::nearest(&flat, across(point))),
                    *along,
                ))
            }
            Self::Revolution { controls, axis } => revolved_normal(controls, axis, point),
        }
    }
}

/// The vector from the axis to the point.
fn radial(frame: &Frame, point: Point) -> Point {
    let offset = subtract(point, frame.origin);
    subtract(offset, scaled(frame.z, dot(offset, frame.z)))
}

/// The normal of a spline revolved about z: the normal of the meridian, rotated to the point.
fn revolved_normal(controls: &[Point], axis: &Frame, point: Point) -> Point {
    let meridian = |p: Point| {
        [
            partprobe_carrier::norm(radial(axis, p)),
            dot(subtract(p, axis.origin), axis.z),
        ]
    };
    let flat: Vec<Planar> = controls.iter().copied().map(meridian).collect();
    let [outward, upward] = spline::slope(&flat, spline::nearest(&flat, meridian(point)));
    unit(added(
        scaled(unit(radial(axis, point)), upward),
        scaled(axis.z, -outward),
    ))
}

/// The angle between two unit vectors, in degrees. The formula is well-conditioned at 0° and at 180°.
pub(crate) fn angle_deg(a: Point, b: Point) -> f64 {
    libm::atan2(partprobe_carrier::norm(cross(a, b)), dot(a, b)).to_degrees()
}
