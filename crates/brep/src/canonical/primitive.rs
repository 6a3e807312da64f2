//! Represents the five primitives with the data that the distance of a point from them requires.

use partprobe_shape::{FaceType, Point, cross, dot, norm, subtract};

/// A primitive in space. Axes and normals have unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Primitive {
    Plane {
        point: Point,
        normal: Point,
    },
    Cylinder {
        point: Point,
        axis: Point,
        radius: f64,
    },
    /// One nappe: the axis points from the apex into it.
    Cone {
        apex: Point,
        axis: Point,
        half_angle: f64,
    },
    Sphere {
        center: Point,
        radius: f64,
    },
    Torus {
        center: Point,
        axis: Point,
        major: f64,
        minor: f64,
    },
}

impl Primitive {
    pub(super) fn face_type(&self) -> FaceType {
        match self {
            Self::Plane { .. } => FaceType::Plane,
            Self::Cylinder { .. } => FaceType::Cylinder,
            Self::Cone { .. } => FaceType::Cone,
            Self::Sphere { .. } => FaceType::Sphere,
            Self::Torus { .. } => FaceType::Torus,
        }
    }

    /// The distance of a point from the primitive, or NaN if it is undefined.
    pub(super) fn distance(&self, p: Point) -> f64 {
        match *self {
            Self::Plane { point, normal } => dot(subtract(p, point), normal).abs(),
            Self::Cylinder {
                point,
                axis,
                radius,
            } => (norm(cross(subtract(p, point), axis)) - radius).abs(),
            Self::Cone {
                apex,
                axis,
                half_angle,
            } => {
                let arm = subtract(p, apex);
                let (sin, cos) = libm::sincos(half_angle);
                let (along, across) = (dot(arm, axis), norm(cross(arm, axis)));
                // Behind the apex, the apex itself is the nearest point.
                if along * cos + across * sin < 0.0 {
                    norm(arm)
                } else {
                    (across * cos - along * sin).abs()
                }
            }
            Self::Sphere { center, radius } => (norm(subtract(p, center)) - radius).abs(),
            Self::Torus {
                center,
                axis,
                major,
                minor,
            } => {
                let arm = subtract(p, center);
                let (along, across) = (dot(arm, axis), norm(cross(arm, axis)));
                (libm::hypot(across - major, along) - minor).abs()
            }
        }
    }
}
