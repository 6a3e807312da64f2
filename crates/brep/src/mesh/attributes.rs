//! Computes the attributes of the true surface at the vertices of a mesh: normals, parameters, curvatures and their
//! directions.

use super::settings::AttributeChoice;
use crate::geometry::linear::{sum, unit};
use crate::geometry::{Curvature, Surface};
use crate::model::BrepFace;
use partprobe_shape::{Point, SurfaceAttributes, cross, subtract};

/// The normals and the other attributes that `choice` asks for, at the vertices of a mesh: points, triangles, and parameters
/// of the points on `surface`. The surface is the face's own, or a sphere rotated about its center.
pub(super) fn vertex_attributes(
    mesh: (&[Point], &[[u32; 3]], &[[f64; 2]]),
    face: &BrepFace,
    surface: &Surface,
    choice: AttributeChoice,
) -> (Vec<[f32; 3]>, SurfaceAttributes) {
    let (points, _, parameters) = mesh;
    let mut normals = Vec::new();
    let mut attributes = SurfaceAttributes::default();
    if choice.normal {
        normals = outward_normals(mesh, face, surface);
    }
    if choice.uv {
        attributes.uv = match surface {
            Surface::Sphere { .. } => points
                .iter()
                .map(|&point| face.surface.project(point, None).uv)
                .collect(),
            _ => parameters.to_vec(),
        };
    }
    if choice.curvature {
        for &[u, v] in parameters {
            let (curvature, direction) = rows_of(outward_curvature(face, surface.curvature(u, v)));
            attributes.curvature.push(curvature);
            attributes.direction.push(direction);
        }
    }
    (normals, attributes)
}

/// Sets every row to NaN. This is for a mesh that does not follow the face's own surface.
pub(super) fn forget_attributes(attributes: &mut SurfaceAttributes) {
    attributes.uv.fill([f64::NAN; 2]);
    attributes.curvature.fill([f32::NAN; 2]);
    attributes.direction.fill([[f32::NAN; 3]; 2]);
}

/// Adds a vertex at which the attributes are not defined. Kinds that were not requested stay empty.
pub(super) fn push_undefined(attributes: &mut SurfaceAttributes) {
    let SurfaceAttributes {
        uv,
        curvature,
        direction,
    } = attributes;
    if !uv.is_empty() {
        uv.push([f64::NAN; 2]);
    }
    if !curvature.is_empty() {
        curvature.push([f32::NAN; 2]);
        direction.push([[f32::NAN; 3]; 2]);
    }
}

/// The attributes as they are seen from the other side of the face.
pub(super) fn reverse_attributes(attributes: &mut SurfaceAttributes) {
    attributes
        .curvature
        .iter_mut()
        .for_each(|[k1, k2]| (*k1, *k2) = (-*k2, -*k1));
    attributes
        .direction
        .iter_mut()
        .for_each(|directions| directions.swap(0, 1));
}

/// The curvature as it is seen from outside the shape.
pub(crate) fn outward_curvature(
    face: &BrepFace,
    curvature: Option<Curvature>,
) -> Option<Curvature> {
    curvature.map(|curvature| {
        if face.is_inward() {
            curvature.flipped()
        } else {
            curvature
        }
    })
}

/// The rows of a carrier. They are NaN where the curvature is undefined.
pub(crate) fn rows_of(curvature: Option<Curvature>) -> ([f32; 2], [[f32; 3]; 2]) {
    match curvature {
        Some(Curvature {
            principal,
            directions,
        }) => (
            principal.map(|k| k as f32),
            directions.map(|direction| direction.map(|x| x as f32)),
        ),
        None => ([f32::NAN; 2], [[f32::NAN; 3]; 2]),
    }
}

/// The surface's normal at each vertex. Where the surface has no normal, as at an apex, the mean normal of the vertex's triangles
/// is used.
fn outward_normals(
    (points, triangles, parameters): (&[Point], &[[u32; 3]], &[[f64; 2]]),
    face: &BrepFace,
    surface: &Surface,
) -> Vec<[f32; 3]> {
    let side = if face.is_inward() { -1.0 } else { 1.0 };
    let mut mean = vec![[0.0; 3]; points.len()];
    for corners in triangles {
        let [a, b, c] = corners.map(|corner| points[corner as usize]);
        let normal = unit(cross(subtract(b, a), subtract(c, a))).unwrap_or_default();
        for &corner in corners {
            mean[corner as usize] = sum(mean[corner as usize], normal);
        }
    }
    let of_vertex = |(&[u, v], mean): (&[f64; 2], Point)| {
        let normal = surface
            .unit_normal(u, v)
            .map(|normal| normal.map(|x| side * x));
        normal
            .or_else(|| unit(mean))
            .unwrap_or_default()
            .map(|x| x as f32)
    };
    parameters.iter().zip(mean).map(of_vertex).collect()
}
