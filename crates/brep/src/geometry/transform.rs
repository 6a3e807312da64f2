//! Moves curves and surfaces by a rotation, a uniform scale and a translation, as an assembly requires.

use super::facets::Facets;
use super::linear::{scaled, sum, unit};
use super::types::{
    BsplineCurve, BsplineSurface, CompositeSegment, CompositeSurface, Curve, Frame, Surface,
    SurfaceCurve, SurfacePatch,
};
use partprobe_shape::{Point, dot, norm};
use std::sync::Arc;

/// `p ↦ rotation·p + translation`. The rotation may include a scale that is the same along all axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Rows of the matrix.
    pub rotation: [[f64; 3]; 3],
    /// The translation in millimeters.
    pub translation: Point,
}

impl Transform {
    /// The transform that moves nothing.
    pub const IDENTITY: Self = Self {
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
    };

    /// The transformed point.
    #[must_use]
    pub fn point(&self, p: Point) -> Point {
        sum(self.vector(p), self.translation)
    }

    /// The transformed vector.
    #[must_use]
    pub fn vector(&self, a: Point) -> Point {
        self.rotation.map(|row| dot(row, a))
    }

    /// The factor by which lengths are multiplied.
    #[must_use]
    pub fn scale(&self) -> f64 {
        norm([
            self.rotation[0][0],
            self.rotation[1][0],
            self.rotation[2][0],
        ])
    }

    fn frame(&self, frame: &Frame) -> Frame {
        let rotated = |axis: Point| unit(self.vector(axis)).unwrap_or(axis);
        Frame {
            origin: self.point(frame.origin),
            x: rotated(frame.x),
            y: rotated(frame.y),
            z: rotated(frame.z),
        }
    }

    fn pole(&self, pole: [f64; 4]) -> [f64; 4] {
        let moved = sum(
            self.vector([pole[0], pole[1], pole[2]]),
            scaled(self.translation, pole[3]),
        );
        [moved[0], moved[1], moved[2], pole[3]]
    }
}

impl Curve {
    /// The transformed curve. Its parameters keep their meaning, but parameters that are lengths are scaled.
    #[must_use]
    pub fn transformed(&self, rigid: &Transform) -> Self {
        let scale = rigid.scale();
        match self {
            Self::Line { origin, direction } => Self::Line {
                origin: rigid.point(*origin),
                direction: rigid.vector(*direction),
            },
            Self::Ellipse { frame, rx, ry } => Self::Ellipse {
                frame: rigid.frame(frame),
                rx: rx * scale,
                ry: ry * scale,
            },
            Self::Parabola { frame, focal } => Self::Parabola {
                frame: rigid.frame(frame),
                focal: focal * scale,
            },
            Self::Hyperbola { frame, a, b } => Self::Hyperbola {
                frame: rigid.frame(frame),
                a: a * scale,
                b: b * scale,
            },
            Self::Bspline(spline) => Self::Bspline(BsplineCurve {
                poles: spline.poles.iter().map(|&pole| rigid.pole(pole)).collect(),
                ..spline.clone()
            }),
            Self::Polyline(points) => {
                Self::Polyline(points.iter().map(|&point| rigid.point(point)).collect())
            }
            Self::Composite(segments) => Self::Composite(
                segments
                    .iter()
                    .map(|piece| piece.transformed(rigid))
                    .collect(),
            ),
            Self::Offset {
                basis,
                distance,
                reference,
            } => Self::Offset {
                basis: Box::new(basis.transformed(rigid)),
                distance: distance * scale,
                reference: rigid.vector(*reference),
            },
            Self::OnSurface(on) => {
                let lengths = on
                    .surface
                    .lengths()
                    .map(|is_length| if is_length { scale } else { 1.0 });
                Self::OnSurface(Box::new(SurfaceCurve {
                    surface: Arc::new(on.surface.transformed(rigid)),
                    curve: on.curve.clone(),
                    scale: [on.scale[0] * lengths[0], on.scale[1] * lengths[1]],
                }))
            }
        }
    }
}

impl CompositeSegment {
    fn transformed(&self, rigid: &Transform) -> Self {
        Self {
            curve: self.curve.transformed(rigid),
            start: self.start,
            end: self.end,
        }
    }
}

impl SurfacePatch {
    fn transformed(&self, rigid: &Transform) -> Self {
        let lengths = self
            .surface
            .lengths()
            .map(|is_length| if is_length { rigid.scale() } else { 1.0 });
        let grown = |uv: [f64; 2]| [uv[0] * lengths[0], uv[1] * lengths[1]];
        Self {
            surface: self.surface.transformed(rigid),
            start: grown(self.start),
            end: grown(self.end),
            face_type: self.face_type,
        }
    }
}

impl BsplineSurface {
    fn transformed(&self, rigid: &Transform) -> Self {
        Self {
            poles: self.poles.iter().map(|&pole| rigid.pole(pole)).collect(),
            ..self.clone()
        }
    }
}

impl CompositeSurface {
    fn transformed(&self, rigid: &Transform) -> Self {
        Self {
            patches: self
                .patches
                .iter()
                .map(|patch| patch.transformed(rigid))
                .collect(),
            ..self.clone()
        }
    }
}

impl Facets {
    fn transformed(&self, rigid: &Transform) -> Self {
        Self {
            points: self
                .points
                .iter()
                .map(|&point| rigid.point(point))
                .collect(),
            normals: self
                .normals
                .iter()
                .map(|&normal| rigid.vector(normal))
                .collect(),
            triangles: self.triangles.clone(),
        }
    }
}

impl Surface {
    /// Whether u and v are lengths, which are scaled. Angles and the parameters of curves are not scaled.
    fn lengths(&self) -> [bool; 2] {
        match self {
            Self::Plane(_) => [true, true],
            Self::Cylinder { .. } | Self::Cone { .. } => [false, true],
            Self::Offset { basis, .. } => basis.lengths(),
            _ => [false, false],
        }
    }

    /// The transformed surface. Parameters that are angles stay the same, and parameters that are lengths are scaled.
    #[must_use]
    pub fn transformed(&self, rigid: &Transform) -> Self {
        let scale = rigid.scale();
        match self {
            Self::Plane(frame) => Self::Plane(rigid.frame(frame)),
            Self::Cylinder { frame, radius } => Self::Cylinder {
                frame: rigid.frame(frame),
                radius: radius * scale,
            },
            Self::Cone {
                frame,
                radius,
                slope,
            } => Self::Cone {
                frame: rigid.frame(frame),
                radius: radius * scale,
                slope: *slope,
            },
            Self::Sphere { frame, radius } => Self::Sphere {
                frame: rigid.frame(frame),
                radius: radius * scale,
            },
            Self::Torus {
                frame,
                major,
                minor,
            } => Self::Torus {
                frame: rigid.frame(frame),
                major: major * scale,
                minor: minor * scale,
            },
            Self::Bspline(spline) => Self::Bspline(Box::new(spline.transformed(rigid))),
            Self::Revolution { axis, curve } => Self::Revolution {
                axis: rigid.frame(axis),
                curve: Box::new(curve.transformed(rigid)),
            },
            Self::Extrusion { curve, direction } => Self::Extrusion {
                curve: Box::new(curve.transformed(rigid)),
                direction: rigid.vector(*direction),
            },
            Self::Offset { basis, distance } => Self::Offset {
                basis: Box::new(basis.transformed(rigid)),
                distance: distance * scale,
            },
            Self::Composite(composite) => Self::Composite(Box::new(composite.transformed(rigid))),
            Self::Facets(facets) => Self::Facets(Box::new(facets.transformed(rigid))),
        }
    }
}
