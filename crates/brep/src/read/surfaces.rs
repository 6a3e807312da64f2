//! Reads surfaces. Entities that only trim a surface are followed to the surface itself.

use super::curves::{DirectedCurve, MAX_NESTING};
use super::error::{EntityError, Problem};
use super::space::Reader;
use crate::geometry::Surface;
use crate::part21::{Keyword, Param, ParamError, Record};
use partprobe_shape::FaceType;
use std::f64::consts::FRAC_PI_2;

/// A surface with the class that the file gives it.
#[derive(Clone, Debug)]
pub(super) struct TypedSurface {
    pub(super) surface: Surface,
    pub(super) face_type: FaceType,
    /// False if the requested surface has the opposite normal, which is possible for a trimmed surface.
    pub(super) same_sense: bool,
}

impl<'a> Reader<'_, 'a> {
    /// The basis surface of an instance.
    pub(super) fn surface(&self, id: u64, nesting: u32) -> Result<TypedSurface, EntityError> {
        if nesting > MAX_NESTING {
            return Err(EntityError::from(Problem::TooDeep).within(id));
        }
        self.source.entity(id, |record| match record.keyword {
            Keyword::RectangularTrimmedSurface => self.trimmed_surface(record, nesting),
            Keyword::CurveBoundedSurface => {
                let [_, basis] = self.source.params(record)?;
                self.surface(basis.reference()?, nesting + 1)
            }
            Keyword::OffsetSurface => self.offset_surface(record, nesting),
            Keyword::RectangularCompositeSurface => self.composite_surface(record, nesting),
            Keyword::SurfaceOfLinearExtrusion | Keyword::SurfaceOfRevolution => {
                self.swept_surface(record, nesting)
            }
            Keyword::SurfaceReplica => self.replicated_surface(record, nesting),
            _ => {
                let (surface, face_type) = self.basis_surface(record)?;
                // If the representation is mirrored, the normal `∂u × ∂v` of a spline is reversed. Elementary surfaces are
                // symmetric.
                let reverses_normal = matches!(surface, Surface::Bspline(_));
                Ok(TypedSurface {
                    surface,
                    face_type,
                    same_sense: !(reverses_normal && self.is_mirrored()),
                })
            }
        })
    }

    /// A surface that an operator has moved. If the operator includes a reflection, `∂u × ∂v` of the replica is opposite to the
    /// mirrored normal. A mirrored reader keeps the mirrored normal, so the sense is reversed.
    fn replicated_surface(
        &self,
        record: Record,
        nesting: u32,
    ) -> Result<TypedSurface, EntityError> {
        let (reader, parent) = self.without_replicas(record.id, Keyword::SurfaceReplica)?;
        let replica = reader.surface(parent.id, nesting + 1)?;
        let mirrors = reader.is_mirrored() != self.is_mirrored();
        Ok(TypedSurface {
            same_sense: replica.same_sense != mirrors,
            ..replica
        })
    }

    fn basis_surface(&self, record: Record) -> Result<(Surface, FaceType), EntityError> {
        match record.keyword {
            Keyword::Plane
            | Keyword::CylindricalSurface
            | Keyword::ConicalSurface
            | Keyword::SphericalSurface
            | Keyword::ToroidalSurface
            | Keyword::DegenerateToroidalSurface => self.elementary_surface(record),
            _ => self.spline_surface(record),
        }
    }

    fn elementary_surface(&self, record: Record) -> Result<(Surface, FaceType), EntityError> {
        let [_, position] = self.source.params(record)?;
        let frame = self.frame(position.reference()?)?;
        if record.keyword == Keyword::Plane {
            return Ok((Surface::Plane(frame), FaceType::Plane));
        }
        let [_, _, radius] = self.source.params(record)?;
        match record.keyword {
            Keyword::CylindricalSurface => Ok((
                Surface::Cylinder {
                    frame,
                    radius: self.radius(radius)?,
                },
                FaceType::Cylinder,
            )),
            Keyword::SphericalSurface => Ok((
                Surface::Sphere {
                    frame,
                    radius: self.radius(radius)?,
                },
                FaceType::Sphere,
            )),
            Keyword::ConicalSurface => {
                let [_, _, _, half_angle] = self.source.params(record)?;
                let half_angle = half_angle.number()? * self.space.rad_per_unit;
                if half_angle.abs() >= FRAC_PI_2 {
                    return Err(ParamError::Kind("a half angle below a right angle").into());
                }
                let slope = libm::tan(half_angle);
                // The radius may be 0. Then the placement is at the apex.
                Ok((
                    Surface::Cone {
                        frame,
                        radius: self.length(radius)?,
                        slope,
                    },
                    FaceType::Cone,
                ))
            }
            _ => {
                let [_, _, _, minor] = self.source.params(record)?;
                let (major, minor) = (self.length(radius)?, self.radius(minor)?);
                let major = if self.is_lemon(record, major, minor) {
                    -major
                } else {
                    major
                };
                Ok((
                    Surface::Torus {
                        frame,
                        major,
                        minor,
                    },
                    FaceType::Torus,
                ))
            }
        }
    }

    /// Whether the file selects the inner part of a torus that meets itself. A negative major radius gives this part.
    fn is_lemon(&self, record: Record, major: f64, minor: f64) -> bool {
        let meets_itself =
            record.keyword == Keyword::DegenerateToroidalSurface && 0.0 < major && major < minor;
        let select_outer = |[_, _, _, _, flag]: [Param<'a>; 5]| flag.flag().unwrap_or(true);
        // If the choice is left out, it is the outer part.
        meets_itself && !self.source.params(record).map_or(true, select_outer)
    }

    /// An extruded or revolved curve. If the curve is walked backwards, the normal of the sweep is reversed.
    fn swept_surface(&self, record: Record, nesting: u32) -> Result<TypedSurface, EntityError> {
        let [_, curve, axis] = self.source.params(record)?;
        let DirectedCurve { curve, same_sense } = self.curve(curve.reference()?, nesting + 1)?;
        let (curve, axis) = (Box::new(curve), axis.reference()?);
        if record.keyword == Keyword::SurfaceOfRevolution {
            let surface = Surface::Revolution {
                axis: self.frame(axis)?,
                curve,
            };
            return Ok(TypedSurface {
                surface,
                face_type: FaceType::Revolution,
                same_sense,
            });
        }
        // If the representation is mirrored, the normal `∂u × ∂v` of an extrusion is reversed. A surface of revolution is
        // symmetric.
        let surface = Surface::Extrusion {
            curve,
            direction: self.vector(axis)?,
        };
        Ok(TypedSurface {
            surface,
            face_type: FaceType::Extrusion,
            same_sense: same_sense != self.is_mirrored(),
        })
    }

    fn offset_surface(&self, record: Record, nesting: u32) -> Result<TypedSurface, EntityError> {
        let [_, basis, distance] = self.source.params(record)?;
        let basis = self.surface(basis.reference()?, nesting + 1)?;
        let distance = self.length(distance)?;
        // The offset is along the normal of the named surface, which may be reversed.
        let distance = if basis.same_sense {
            distance
        } else {
            -distance
        };
        let surface = Surface::Offset {
            basis: Box::new(basis.surface),
            distance,
        };
        Ok(TypedSurface {
            surface,
            face_type: FaceType::Offset,
            same_sense: basis.same_sense,
        })
    }

    /// A trimmed surface has the normal of its basis. The normal is reversed if exactly one of the parameters runs backwards.
    fn trimmed_surface(&self, record: Record, nesting: u32) -> Result<TypedSurface, EntityError> {
        let [_, basis, _, _, _, _, sense_u, sense_v] = self.source.params(record)?;
        let basis = self.surface(basis.reference()?, nesting + 1)?;
        let is_reversed =
            self.source.flag(record, sense_u)? != self.source.flag(record, sense_v)?;
        Ok(TypedSurface {
            same_sense: basis.same_sense != is_reversed,
            ..basis
        })
    }

    fn spline_surface(&self, record: Record) -> Result<(Surface, FaceType), EntityError> {
        let is_bezier = match record.keyword {
            Keyword::Complex => self
                .source
                .exchange
                .partial(record, "BEZIER_SURFACE")
                .is_some(),
            keyword => keyword == Keyword::BezierSurface,
        };
        let surface = Surface::Bspline(Box::new(self.bspline_surface(record)?));
        Ok((
            surface,
            if is_bezier {
                FaceType::Bezier
            } else {
                FaceType::Bspline
            },
        ))
    }
}
