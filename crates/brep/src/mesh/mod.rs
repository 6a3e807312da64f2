//! Tessellation: a B-Rep and tolerances in, a triangle mesh, the faces' areas and the faces without triangles out.
//!
//! Each edge is divided once and both its faces take the same points, so that the meshes of closed solids close.
//! Nothing here moves a vertex, sews a gap or asks the clock; work is bounded by numbers of triangles and rounds.

mod boundary;
mod chart;
mod closed_surface;
mod edge_points;
mod face_mesh;
mod flat;
mod layout;
mod rounds;
mod sliver;
mod sphere_axis;
mod steps;
mod surface_fit;
#[cfg(test)]
mod tests;
mod triangulation;
mod unwrap;
mod walks;

use crate::bounds::diagonal;
use crate::model::{Brep, Loss, LossKind};
use carrier::{Mesh, Point, bounding_diagonal};
use face_mesh::FaceMesh;

pub(crate) use walks::mended;

/// How finely a shape is meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeshSettings {
    /// Largest distance between an edge and its chord, in millimetres.
    pub(crate) chord_mm: f64,
    /// Largest angle between neighbouring chords, in radians.
    pub(crate) angle_rad: f64,
    /// Whether the surface's normal is wanted at each vertex.
    pub(crate) vertex_normals: bool,
    /// Faces that would bring the mesh above this number of triangles are lost.
    pub(crate) max_triangles: u64,
}

/// The mesh of a shape.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tessellation {
    /// Triangles, in face order.
    pub(crate) mesh: Mesh,
    /// Area of each face's trimmed surface in square millimetres; 0 where it was lost.
    pub(crate) areas: Vec<f64>,
    /// Faces without triangles.
    pub(crate) lost: Vec<Loss>,
}

/// Meshes every face of a shape.
pub(crate) fn tessellate(brep: &Brep, settings: &MeshSettings) -> Tessellation {
    let mut result = Tessellation::default();
    let faces = rounds::face_meshes(brep, settings, shape_size(brep));
    for (index, (face, mesh)) in brep.faces.iter().zip(faces).enumerate() {
        let room = settings.max_triangles.saturating_sub(result.mesh.triangles.len() as u64);
        let mesh = mesh.and_then(|mesh| {
            let fits = mesh.triangles.len() as u64 <= room;
            if fits { Ok(mesh) } else { Err("the triangle budget is used up; raise it or the tolerances") }
        });
        match mesh {
            Ok(mesh) => append(&mut result, index as u32, mesh),
            Err(reason) => {
                result.areas.push(0.0);
                let reason = format!("no triangles: {reason}");
                result.lost.push(Loss { kind: LossKind::Face, step_id: face.step_id, reason });
            }
        }
    }
    result
}

/// The extent of the vertices, and only where there are too few of them a closer look.
fn shape_size(brep: &Brep) -> f64 {
    let places: Vec<Point> = brep.vertices.iter().map(|vertex| vertex.point).collect();
    let by_vertices = bounding_diagonal(&places);
    if places.len() > 2 && by_vertices > 0.0 { by_vertices } else { diagonal(brep) }
}

fn append(result: &mut Tessellation, face: u32, mesh: FaceMesh) {
    let first = result.mesh.vertices.len() as u32;
    result.mesh.vertex_face.extend(std::iter::repeat_n(face, mesh.points.len()));
    result.mesh.tri_face.extend(std::iter::repeat_n(face, mesh.triangles.len()));
    result.mesh.vertices.extend(mesh.points);
    result.mesh.vertex_normal.extend(mesh.normals);
    result.mesh.triangles.extend(mesh.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
    result.areas.push(mesh.area);
}
