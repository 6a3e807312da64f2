//! Computes the dimensions of a face's surface for users: radius, axis, angle.

use partprobe_brep::geometry::{Frame, Surface};
use partprobe_carrier::Point;
use serde::Serialize;

/// The dimensions of a surface, in millimeters and degrees. Dimensions that a type does not have are `null`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(super) struct SurfaceReport {
    /// A point of the plane or the axis, or the center of a sphere or torus.
    pub(super) origin: Point,
    /// The normal of a plane, or the axis of the other types, with unit length. It is that of the surface: a face that uses its
    /// surface against its sense has the opposite normal.
    pub(super) axis: Point,
    /// The radius. For a cone, it is the one at `origin`. For a torus, it is the larger one.
    pub(super) radius: Option<f64>,
    /// The radius of a torus's tube.
    pub(super) minor_radius: Option<f64>,
    /// The angle between a cone's axis and its side.
    pub(super) half_angle: Option<f64>,
}

impl SurfaceReport {
    /// The dimensions of a surface. Returns `None` for splines and swept surfaces.
    pub(super) fn of(surface: &Surface) -> Option<Self> {
        let report = match surface {
            Surface::Plane(frame) => Self::at(frame),
            Surface::Cylinder { frame, radius } | Surface::Sphere { frame, radius } => Self {
                radius: Some(*radius),
                ..Self::at(frame)
            },
            Surface::Cone {
                frame,
                radius,
                slope,
            } => Self {
                radius: Some(*radius),
                half_angle: Some(slope.atan().to_degrees()),
                ..Self::at(frame)
            },
            Surface::Torus {
                frame,
                major,
                minor,
            } => Self {
                radius: Some(*major),
                minor_radius: Some(*minor),
                ..Self::at(frame)
            },
            _ => return None,
        };
        Some(report)
    }

    fn at(frame: &Frame) -> Self {
        Self {
            origin: frame.origin,
            axis: frame.z,
            ..Self::default()
        }
    }
}
