//! Recognizes planes, cylinders, cones, spheres and tori that a file writes as another class of surface.
//!
//! Exporters write the same cylinder as a `CYLINDRICAL_SURFACE`, a rational B-spline, an extruded circle or a revolved line. The
//! test uses the whole surface, never only a face's region of it, so a face keeps its type if it is cut in two. Sweeps of lines
//! and circles are recognized by their definition. For other surfaces, a primitive is fitted to a few points and normals, and all
//! points of a dense grid must lie on it. Nothing here changes a surface, and `face_type` remains the type in the file.

mod eigen;
mod fits;
mod primitive;
mod samples;
mod sweeps;

use crate::geometry::Surface;
use crate::model::Brep;
use fits::fitted;
use partprobe_shape::{FaceGraph, FaceType};
use samples::Patch;

/// A surface is a primitive if no point of it is farther from the primitive than this fraction of the shape's diagonal,
const OF_DIAGONAL: f64 = 1e-6;
/// or than this fraction of the surface's own extent. The second limit keeps a tiny face from being every primitive at once.
const OF_EXTENT: f64 = 1e-3;

/// Sets `canonical_type` of every face whose type is not plane, cylinder, cone, sphere or torus.
pub(crate) fn recognize_primitives(graph: &mut FaceGraph, brep: &Brep, diagonal_mm: f64) {
    let tolerance = OF_DIAGONAL * diagonal_mm;
    for (face, source) in graph.faces.iter_mut().zip(&brep.faces) {
        if face.face_type > FaceType::Torus {
            face.canonical_type =
                primitive_type(&source.surface, tolerance).unwrap_or(face.face_type);
        }
    }
}

/// The type of the primitive that the surface equals within `tolerance` millimeters. Returns `None` if it is not a primitive.
fn primitive_type(surface: &Surface, tolerance: f64) -> Option<FaceType> {
    match surface {
        Surface::Plane(_) => Some(FaceType::Plane),
        Surface::Cylinder { .. } => Some(FaceType::Cylinder),
        Surface::Cone { .. } => Some(FaceType::Cone),
        Surface::Sphere { .. } => Some(FaceType::Sphere),
        Surface::Torus { .. } => Some(FaceType::Torus),
        // The surface from which the triangles were made is unknown.
        Surface::Facets(_) => None,
        // An offset of a primitive is a primitive of the same type.
        Surface::Offset { basis, .. } => primitive_type(basis, tolerance),
        _ => match sweeps::swept_type(surface, tolerance) {
            Some(answer) => answer,
            None => fitted_type(surface, tolerance),
        },
    }
}

fn fitted_type(surface: &Surface, tolerance: f64) -> Option<FaceType> {
    let patch = Patch::of(surface)?;
    let coarse = patch.coarse_samples();
    let tolerance = tolerance.min(OF_EXTENT * coarse.extent());
    let primitive = fitted(&coarse, tolerance)?;
    patch
        .dense_points()
        .all(|point| primitive.distance(point) <= tolerance)
        .then(|| primitive.face_type())
}

#[cfg(test)]
mod tests;
