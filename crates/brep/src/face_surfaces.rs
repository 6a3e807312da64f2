//! Finds the nearest point on the surface of a face, with its normal, parameters and curvature. Boundaries are not considered.

use crate::geometry::Projector;
use crate::mesh::{outward_curvature, rows_of};
use crate::model::Brep;
use crate::motion::{Matrix, inverse, moved_direction, moved_point, product, scale_of};
use partprobe_shape::{Face, Instance, Point};
use std::collections::BTreeMap;

/// The surfaces of a shape, prepared for many projections. A surface is prepared when its face is first used.
pub struct FaceSurfaces<'b> {
    brep: &'b Brep,
    projectors: Vec<Projector<'b>>,
    /// The repeated faces. Their indices follow those of the faces in the file.
    repeated: Vec<Option<RepeatedFace>>,
}

/// A face that is repeated at another occurrence.
struct RepeatedFace {
    /// Index of the face in the file.
    face: u32,
    /// The motion from the first occurrence to this one, and its inverse.
    there: Matrix,
    back: Matrix,
}

/// The point of a face's surface that is nearest to a given point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point, in millimeters.
    pub point: Point,
    /// Its distance from the given point, in millimeters.
    pub distance: f64,
    /// Its parameters.
    pub uv: [f64; 2],
    /// The outward unit normal, or `None` if it is undefined.
    pub normal: Option<Point>,
    /// Principal curvatures in 1/mm, the larger one first. They are positive where the shape is convex, and NaN where they are
    /// undefined.
    pub curvature: [f32; 2],
    /// Their directions.
    pub direction: [[f32; 3]; 2],
}

impl SurfacePoint {
    /// The same point seen from the other side of the surface.
    #[must_use]
    pub fn reversed(self) -> Self {
        let ([k1, k2], [d1, d2]) = (self.curvature, self.direction);
        let normal = self.normal.map(|normal| normal.map(|x| -x));
        Self {
            normal,
            curvature: [-k2, -k1],
            direction: [d2, d1],
            ..self
        }
    }

    /// The same point of the surface after a motion.
    fn moved(self, motion: &Matrix) -> Self {
        let scale = scale_of(motion);
        let origin = moved_point(motion, [0.0; 3]);
        let rotated = |normal: Point| {
            let end = moved_point(motion, normal);
            [0, 1, 2].map(|axis| (end[axis] - origin[axis]) / scale)
        };
        Self {
            point: moved_point(motion, self.point),
            distance: self.distance * scale,
            uv: self.uv,
            normal: self.normal.map(rotated),
            curvature: self.curvature.map(|k| (f64::from(k) / scale) as f32),
            direction: self
                .direction
                .map(|row| moved_direction(motion, scale, row)),
        }
    }
}

impl<'b> FaceSurfaces<'b> {
    /// The surfaces of a shape.
    #[must_use]
    pub fn new(brep: &'b Brep) -> Self {
        let projectors = brep
            .faces
            .iter()
            .map(|face| Projector::new(&face.surface))
            .collect();
        Self {
            brep,
            projectors,
            repeated: Vec::new(),
        }
    }

    /// The surfaces of a shape with all occurrences: its faces and its list of occurrences are those of
    /// [`crate::tessellate_instances`].
    #[must_use]
    pub fn with_instances(brep: &'b Brep, faces: &[Face], instances: &[Instance]) -> Self {
        let (first, further) = faces.split_at(faces.len().min(brep.faces.len()));
        let of_entity: BTreeMap<u64, u32> = (0..)
            .zip(first)
            .map(|(index, face)| (face.step_id, index))
            .collect();
        let transform = |face: &Face| {
            instances
                .get(face.instance as usize)
                .map(|instance| &instance.transform)
        };
        let repeated = |copy: &Face| {
            let face = *of_entity.get(&copy.step_id)?;
            let there = product(
                transform(copy)?,
                &inverse(transform(&first[face as usize])?)?,
            );
            Some(RepeatedFace {
                face,
                there,
                back: inverse(&there)?,
            })
        };
        Self {
            repeated: further.iter().map(repeated).collect(),
            ..Self::new(brep)
        }
    }

    /// Projects a point onto the surface of a face. If parameters near it are given, this is faster, and the result stays on the
    /// same sheet of the surface.
    ///
    /// Returns `None` if the shape does not have the face, or if the surface has no finite point.
    #[must_use]
    pub fn nearest(
        &self,
        face: u32,
        near_point: Point,
        near: Option<[f64; 2]>,
    ) -> Option<SurfacePoint> {
        let Some(projector) = self.projectors.get(face as usize) else {
            let RepeatedFace { face, there, back } = self
                .repeated
                .get(face as usize - self.projectors.len())?
                .as_ref()?;
            return Some(
                self.nearest(*face, moved_point(back, near_point), near)?
                    .moved(there),
            );
        };
        let found = projector.project(
            near_point,
            near.filter(|uv| uv.iter().all(|x| x.is_finite())),
        );
        let face = &self.brep.faces[face as usize];
        let [u, v] = found.uv;
        let side = if face.is_inward() { -1.0 } else { 1.0 };
        let (curvature, direction) = rows_of(outward_curvature(face, face.surface.curvature(u, v)));
        let nearest = SurfacePoint {
            point: found.point,
            distance: found.distance,
            uv: found.uv,
            normal: face
                .surface
                .unit_normal(u, v)
                .map(|normal| normal.map(|x| side * x)),
            curvature,
            direction,
        };
        nearest
            .point
            .iter()
            .all(|x| x.is_finite())
            .then_some(nearest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ReadBudget, read};
    use partprobe_shape::norm;

    #[test]
    fn a_point_goes_to_its_surface_along_the_normal() {
        let text = crate::fixtures::cylinder(3.0, 10.0).bytes();
        let brep = read(&text, &ReadBudget::default()).unwrap();
        let surfaces = FaceSurfaces::new(&brep);
        assert_eq!(surfaces.nearest(99, [0.0; 3], None), None);
        for face in 0..brep.faces.len() as u32 {
            let near_point = [1.0, 2.5, 4.0];
            let found = surfaces.nearest(face, near_point, None).unwrap();
            let normal = found.normal.unwrap();
            assert!((norm(normal) - 1.0).abs() < 1e-12);
            let arm = partprobe_shape::subtract(near_point, found.point);
            assert!((partprobe_shape::dot(arm, normal).abs() - found.distance).abs() < 1e-9);
            let expected =
                if brep.faces[face as usize].face_type == partprobe_shape::FaceType::Plane {
                    0.0
                } else {
                    1.0 / 3.0
                };
            assert_eq!(found.curvature, [expected as f32, 0.0]);
        }
    }
}
