//! Makes a triangle mesh of a B-Rep, measures the areas of its faces, and names the faces that have no triangles.
//!
//! Each edge is divided once, and both of its faces take the same points. Therefore the meshes of closed solids close.
//! Nothing here moves a vertex, sews a gap or reads the clock. The work is bounded by numbers of triangles and of passes.

mod adaptive;
mod aligned_grid;
mod attributes;
mod bands;
mod boundary;
mod chart;
mod charted_face;
mod chords;
mod closed_surface;
mod contacts;
mod divisions;
mod edge_points;
mod edge_walks;
mod error;
mod face_context;
mod face_mesh;
mod facets;
mod gap_filling;
mod grid;
mod layout;
mod lost;
mod mesh_face;
mod near_chords;
mod nesting;
mod off_surface;
mod orientation;
mod plain;
mod plain_face;
mod planar_fallback;
mod poles;
mod quadrature;
mod repaired;
mod settings;
mod shell_sides;
mod solids;
mod sphere_axis;
mod steps;
mod strips;
mod surface_fit;
#[cfg(test)]
mod tests;
mod triangulated;
mod triangulation;
mod two_areas;
mod unwrap;
mod volume;
mod volume_error;

use crate::bounds::diagonal;
use crate::model::{Brep, LostEntity, LostKind, Note};
use error::FaceMeshError;
use face_mesh::FaceMesh;
use lost::{beyond_max_triangles, lost_description};
use partprobe_shape::{Mesh, Point, SurfaceAttributes, bounding_diagonal};
use solids::{solid_of, solid_origins};

pub(crate) use attributes::{outward_curvature, rows_of};
pub(crate) use repaired::repaired;
pub use settings::AttributeChoice;
pub(crate) use settings::MeshSettings;

/// The mesh of a B-Rep.
#[derive(Clone, Debug, Default)]
pub(crate) struct BrepMesh {
    /// Triangles, in face order.
    pub(crate) mesh: Mesh,
    /// The other attributes that were asked for at its vertices.
    pub(crate) attributes: SurfaceAttributes,
    /// Area of each face's trimmed surface, in square millimeters. It is 0 if the face was lost.
    pub(crate) areas: Vec<f64>,
    /// Volume that each solid's surfaces enclose, in cubic millimeters. The list is empty unless volumes were requested.
    pub(crate) solid_volumes: Vec<f64>,
    /// Faces without triangles.
    pub(crate) lost: Vec<LostEntity>,
    /// Faces whose triangles and surface have different areas, and are not lost.
    pub(crate) notes: Vec<Note>,
    /// Whether a face was lost because the triangle budget was used up.
    pub(crate) is_over_budget: bool,
}

/// Meshes every face of a B-Rep.
pub(crate) fn mesh_brep(brep: &Brep, settings: &MeshSettings) -> BrepMesh {
    let origins = if settings.solid_volumes {
        solid_origins(brep)
    } else {
        Vec::new()
    };
    let size = brep_size(brep);
    let mut faces = adaptive::face_meshes(brep, settings, size, &origins);
    orientation::agree_with_neighbors(brep, &mut faces);
    shell_sides::reverse_shells(brep, &mut faces);
    chords::divide_shared_chords(&mut faces);

    let mut result = BrepMesh {
        solid_volumes: vec![0.0; origins.len()],
        ..BrepMesh::default()
    };
    for (index, mesh) in faces.into_iter().enumerate() {
        result.add_face(brep, index, mesh, settings, size);
    }
    result
}

impl BrepMesh {
    /// Adds the mesh of a face, or records what is lost of the face.
    fn add_face(
        &mut self,
        brep: &Brep,
        index: usize,
        mesh: Result<FaceMesh, FaceMeshError>,
        settings: &MeshSettings,
        size: f64,
    ) {
        let face = &brep.faces[index];
        if let (Ok(mesh), Some(solid)) = (&mesh, solid_of(brep, face))
            && let Some(volume) = self.solid_volumes.get_mut(solid)
        {
            *volume += mesh.volume;
        }

        let n_triangles = mesh.as_ref().map_or(0, |mesh| mesh.triangles.len() as u64);
        let is_beyond = n_triangles > self.room(settings);
        self.is_over_budget |= is_beyond;
        let lost = if is_beyond {
            Some(beyond_max_triangles(brep, face, size))
        } else {
            lost_description(brep, face, &mesh, size)
        };

        if let Some(reason) = lost {
            self.lost.push(LostEntity {
                kind: LostKind::Face,
                step_id: face.step_id,
                reason,
            });
        } else if let Some(text) = mesh
            .as_ref()
            .ok()
            .and_then(|mesh| two_areas::disagreement(mesh, settings.chord_mm))
        {
            self.notes.push(Note {
                step_id: face.step_id,
                text,
            });
        }
        match mesh {
            Ok(mesh) if !is_beyond => self.append(index as u32, mesh),
            _ => self.areas.push(0.0),
        }
    }

    /// The number of triangles that the settings still allow.
    fn room(&self, settings: &MeshSettings) -> u64 {
        settings
            .max_triangles
            .saturating_sub(self.mesh.triangles.len() as u64)
    }

    fn append(&mut self, face: u32, mesh: FaceMesh) {
        let first = self.mesh.vertices.len() as u32;
        let face_of_vertices = std::iter::repeat_n(face, mesh.points.len());
        let face_of_triangles = std::iter::repeat_n(face, mesh.triangles.len());
        let triangles = mesh.triangles.iter();

        self.mesh.vertex_face.extend(face_of_vertices);
        self.mesh.tri_face.extend(face_of_triangles);
        self.mesh.vertices.extend(mesh.points);
        self.mesh.vertex_normal.extend(mesh.normals);
        self.attributes.extend(mesh.attributes);
        self.mesh
            .triangles
            .extend(triangles.map(|corners| corners.map(|corner| first + corner)));
        self.areas.push(mesh.area);
    }
}

/// The diagonal of the vertices' bounding box. If there are too few vertices, the curves are sampled, too.
fn brep_size(brep: &Brep) -> f64 {
    let points: Vec<Point> = brep.vertices.iter().map(|vertex| vertex.point).collect();
    let by_vertices = bounding_diagonal(&points);
    if points.len() > 2 && by_vertices > 0.0 {
        by_vertices
    } else {
        diagonal(brep)
    }
}
