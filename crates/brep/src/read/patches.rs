//! Reads rectangles of surfaces: `RECTANGULAR_TRIMMED_SURFACE`, and the patches of a `RECTANGULAR_COMPOSITE_SURFACE`.

use super::error::{EntityError, Problem};
use super::space::Reader;
use super::surfaces::TypedSurface;
use crate::geometry::{CompositeSurface, Curve, Surface, SurfacePatch};
use crate::part21::{Keyword, Param, Record};
use partprobe_shape::FaceType;

impl<'a> Reader<'_, 'a> {
    /// A surface of patches. If all patches are on the same surface, the result is that surface. If they have the same class, the
    /// result has this class.
    pub(super) fn composite_surface(
        &self,
        record: Record,
        nesting: u32,
    ) -> Result<TypedSurface, EntityError> {
        let (grid, patches) = self.patches(record, nesting)?;
        let [first, others @ ..] = patches.as_slice() else {
            return Err(Problem::Geometry("it has no patches").into());
        };
        if others.iter().all(|other| {
            first.surface == other.surface && first.is_reversed() == other.is_reversed()
        }) {
            let same_sense = first.is_reversed() == self.is_mirrored();
            return Ok(TypedSurface {
                surface: first.surface.clone(),
                face_type: first.face_type,
                same_sense,
            });
        }
        let is_one_class = others
            .iter()
            .all(|other| other.face_type == first.face_type);
        let face_type = if is_one_class {
            first.face_type
        } else {
            FaceType::Other
        };
        let surface = CompositeSurface::new(grid, patches)
            .ok_or(Problem::Geometry("its patches fill no grid"))?;
        let surface = Surface::Composite(Box::new(surface));
        Ok(TypedSurface {
            surface,
            face_type,
            same_sense: !self.is_mirrored(),
        })
    }

    /// The rectangle that a bounded surface covers. Its parameters have the directions of those in the file.
    pub(super) fn rectangle_of(&self, record: Record) -> Result<SurfacePatch, EntityError> {
        if record.keyword != Keyword::RectangularCompositeSurface {
            return self.patch(record.id, 0);
        }
        let (_, patches) = self.patches(record, 0)?;
        let TypedSurface {
            surface, face_type, ..
        } = self.composite_surface(record, 0)?;
        match (patches.first(), patches.last()) {
            (Some(first), Some(last)) if !matches!(surface, Surface::Composite(_)) => {
                Ok(SurfacePatch {
                    surface,
                    start: first.start,
                    end: last.end,
                    face_type,
                })
            }
            _ => bounded(surface, face_type),
        }
    }

    /// The grid of patches, with v varying fastest.
    fn patches(
        &self,
        record: Record,
        nesting: u32,
    ) -> Result<([usize; 2], Vec<SurfacePatch>), EntityError> {
        let [_, rows] = self.source.params(record)?;
        let (mut patches, mut n_u) = (Vec::new(), 0);
        for row in rows.list()?.iter() {
            n_u += 1;
            for segment in row?.list()?.iter() {
                patches.push(self.surface_patch(segment?.reference()?, nesting)?);
            }
        }
        let n_v = patches.len() / n_u.max(1);
        Ok(([n_u, n_v], patches))
    }

    /// The patch of a `SURFACE_PATCH`: a bounded surface whose parameters may both run backwards.
    fn surface_patch(&self, id: u64, nesting: u32) -> Result<SurfacePatch, EntityError> {
        self.source.entity(id, |record| {
            let [parent, _, _, sense_u, sense_v] = self.source.params(record)?;
            let mut patch = self.patch(parent.reference()?, nesting + 1)?;
            for (axis, sense) in [sense_u, sense_v].into_iter().enumerate() {
                if !self.source.flag(record, sense)? {
                    let SurfacePatch { start, end, .. } = &mut patch;
                    std::mem::swap(&mut start[axis], &mut end[axis]);
                }
            }
            Ok(patch)
        })
    }

    /// A bounded surface as a rectangle of its basis.
    fn patch(&self, id: u64, nesting: u32) -> Result<SurfacePatch, EntityError> {
        self.source.entity(id, |record| {
            if record.keyword == Keyword::RectangularTrimmedSurface {
                return self.trimmed_patch(record, nesting);
            }
            let TypedSurface {
                surface, face_type, ..
            } = self.surface(id, nesting)?;
            bounded(surface, face_type)
        })
    }

    fn trimmed_patch(&self, record: Record, nesting: u32) -> Result<SurfacePatch, EntityError> {
        let [_, basis, u1, u2, v1, v2, sense_u, sense_v] = self.source.params(record)?;
        let TypedSurface {
            surface, face_type, ..
        } = self.surface(basis.reference()?, nesting + 1)?;
        let (scale, period) = (self.parameter_scales(&surface), surface.period());
        let ends =
            |axis: usize, [from, to, sense]: [Param<'a>; 3]| -> Result<[f64; 2], EntityError> {
                let (from, to) = (scale[axis] * from.number()?, scale[axis] * to.number()?);
                let grows = self.source.flag(record, sense)? == (scale[axis] > 0.0);
                let turn = period[axis]
                    .filter(|_| from != to && (to > from) != grows)
                    .unwrap_or(0.0);
                Ok([from, if grows { to + turn } else { to - turn }])
            };
        let [[u1, u2], [v1, v2]] = [ends(0, [u1, u2, sense_u])?, ends(1, [v1, v2, sense_v])?];
        let has_extent = [u1, u2, v1, v2].iter().all(|end| end.is_finite()) && u1 != u2 && v1 != v2;
        if !has_extent {
            return Err(Problem::Geometry("its ends enclose nothing").into());
        }
        Ok(SurfacePatch {
            surface,
            start: [u1, v1],
            end: [u2, v2],
            face_type,
        })
    }

    /// The factors from numbers of the file to parameters of a surface. Lengths and angles have units. If the representation is
    /// mirrored, the angle around an axis runs in the opposite direction.
    pub(super) fn parameter_scales(&self, surface: &Surface) -> [f64; 2] {
        let length = self.space.mm_per_unit * self.space.motion.map_or(1.0, |motion| motion.scale);
        let angle = self.space.rad_per_unit;
        let hand = if self.is_mirrored() { -1.0 } else { 1.0 };
        match surface {
            Surface::Plane(_) => [length, hand * length],
            Surface::Cylinder { .. } | Surface::Cone { .. } => [hand * angle, length],
            Surface::Sphere { .. } | Surface::Torus { .. } => [hand * angle, angle],
            Surface::Revolution { curve, .. } => [hand * angle, self.parameter_scale(curve)],
            Surface::Extrusion { curve, .. } => [self.parameter_scale(curve), 1.0],
            Surface::Offset { basis, .. } => self.parameter_scales(basis),
            Surface::Bspline(_) | Surface::Composite(_) | Surface::Facets(_) => [1.0, 1.0],
        }
    }

    /// The factor from numbers of the file to parameters of a curve. The parameters of circles and ellipses are angles.
    pub(super) fn parameter_scale(&self, curve: &Curve) -> f64 {
        match curve {
            Curve::Ellipse { .. } => self.space.rad_per_unit,
            Curve::Offset { basis, .. } => self.parameter_scale(basis),
            _ => 1.0,
        }
    }
}

/// The whole of a surface that has ends, as a patch.
fn bounded(surface: Surface, face_type: FaceType) -> Result<SurfacePatch, EntityError> {
    match surface.range() {
        [Some(u), Some(v)] if [u.0, u.1, v.0, v.1].iter().all(|end| end.is_finite()) => {
            Ok(SurfacePatch {
                surface,
                start: [u.0, v.0],
                end: [u.1, v.1],
                face_type,
            })
        }
        _ => Err(Problem::Geometry("a patch without ends").into()),
    }
}
