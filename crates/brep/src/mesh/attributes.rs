//! What the true surface says at a mesh's vertices: parameters in, normals, curvatures and directions out.

use super::face_mesh::FaceMesh;
use crate::geometry::linear::{sum, unit};
use crate::geometry::{Curvature, Surface};
use crate::model::BrepFace;
use crate::shape::AttributeChoice;
use partprobe_shape::{Point, SurfaceAttributes, cross, subtract};

/// Keeps what was asked for in the face's mesh. `surface` is the face's own, or a sphere turned about its center;
/// `parameters` are those of the mesh's points on it.
pub(super) fn add_attributes(
    mesh: &mut FaceMesh,
    face: &BrepFace,
    surface: &Surface,
    parameters: &[[f64; 2]],
    choice: AttributeChoice,
) {
    if choice.normal {
        mesh.normals = outward_normals(mesh, face, surface, parameters);
    }
    if choice.uv {
        mesh.attributes.uv = match surface {
            Surface::Sphere { .. } => mesh
                .points
                .iter()
                .map(|&point| face.surface.project(point, None).uv)
                .collect(),
            _ => parameters.to_vec(),
        };
    }
    if choice.curvature {
        for &[u, v] in parameters {
            let (curvature, direction) = rows_of(outward_curvature(face, surface.curvature(u, v)));
            mesh.attributes.curvature.push(curvature);
            mesh.attributes.direction.push(direction);
        }
    }
}

/// NaN in every row: the mesh follows another surface than the face's.
pub(super) fn forget_attributes(attributes: &mut SurfaceAttributes) {
    attributes.uv.fill([f64::NAN; 2]);
    attributes.curvature.fill([f32::NAN; 2]);
    attributes.direction.fill([[f32::NAN; 3]; 2]);
}

/// The same attributes seen from the face's other side.
pub(super) fn turn_attributes(attributes: &mut SurfaceAttributes) {
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

/// The rows of a carrier; NaN where the curvature is undefined.
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

/// The surface's normal at each vertex; the mean of its triangles' where it has none, as at an apex.
fn outward_normals(
    mesh: &FaceMesh,
    face: &BrepFace,
    surface: &Surface,
    parameters: &[[f64; 2]],
) -> Vec<[f32; 3]> {
    let side = if face.is_inward() { -1.0 } else { 1.0 };
    let mut mean = vec![[0.0; 3]; mesh.points.len()];
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|corner| mesh.points[corner as usize]);
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
