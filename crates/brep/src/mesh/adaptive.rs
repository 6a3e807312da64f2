//! Meshes all faces, and refines those that come out rough, that have no mesh, or that cut too much off their solid.
//!
//! A finer edge changes both of its faces. So each pass meshes all faces again that share an edge with a refined face.

use super::divisions::Divisions;
use super::edge_points::{EdgePoints, Tolerance, edge_points};
use super::error::FaceMeshError;
use super::face_context::FaceContext;
use super::face_mesh::FaceMesh;
use super::mesh_face::mesh_face;
use super::planar_fallback::planar_mesh;
use super::settings::MeshSettings;
use super::unwrap::Off;
use super::volume_error::cutting_faces;
use crate::geometry::{Curve, Surface};
use crate::model::{Brep, BrepFace, Loop};
use partprobe_shape::Point;

/// The finest level of a face. Two levels halve its chords.
const FINEST: u32 = 6;
/// Levels by which a rough face is refined. A face that only cuts off too much is refined by one level.
const ROUGH_STEP: u32 = 2;
/// Number of refinement passes. One is not enough: dividing a neighbor's edges can make a face rough.
const PASSES: u32 = 5;
/// Largest number of passes in which edges are divided where the boundaries of a face touch. Each division may lead to
/// another contact.
const CONTACT_PASSES: u32 = 8;
/// A face with this many triangles is not refined.
pub(super) const MOST_TRIANGLES: usize = 4000;
/// A face with at most this many edges may be a lens, whose curved edges must be divided.
const LENS_EDGES: usize = 3;
/// Number of pieces of a curved edge of a lens.
const LENS_PIECES: usize = 4;

/// Returns the mesh of each face, or the reason why the face has no mesh. `size` is the diagonal of the shape. If volumes are
/// wanted, `volume_origins` has a point near each solid.
pub(crate) fn face_meshes(
    brep: &Brep,
    settings: &MeshSettings,
    size: f64,
    volume_origins: &[Point],
) -> Vec<Result<FaceMesh, FaceMeshError>> {
    let mut meshing = AdaptiveMeshing::new(brep, settings, size, volume_origins);
    for pass in 0..=PASSES {
        meshing.divide_at_contacts();
        if pass == PASSES || !meshing.refine() {
            break;
        }
    }
    meshing.flatten_displaced_faces();
    meshing.meshes
}

/// The edges and faces of a shape while they are refined.
struct AdaptiveMeshing<'a> {
    brep: &'a Brep,
    settings: &'a MeshSettings,
    size: f64,
    volume_origins: &'a [Point],
    /// The least number of pieces of each edge.
    least: Vec<usize>,
    levels: Levels,
    divisions: Divisions,
    edges: Vec<Option<EdgePoints>>,
    meshes: Vec<Result<FaceMesh, FaceMeshError>>,
}

impl<'a> AdaptiveMeshing<'a> {
    /// All faces, meshed at the tolerances of the settings.
    fn new(
        brep: &'a Brep,
        settings: &'a MeshSettings,
        size: f64,
        volume_origins: &'a [Point],
    ) -> Self {
        let mut meshing = Self {
            brep,
            settings,
            size,
            volume_origins,
            least: least_pieces(brep),
            levels: Levels {
                edges: vec![0; brep.edges.len()],
                faces: vec![0; brep.faces.len()],
            },
            divisions: Divisions::none(brep.edges.len(), size, settings.chord_mm),
            edges: Vec::new(),
            meshes: Vec::new(),
        };
        meshing.edges = (0..brep.edges.len())
            .map(|edge| meshing.divided(edge))
            .collect();
        meshing.meshes = (0..brep.faces.len())
            .map(|face| meshing.meshed(face))
            .collect();
        meshing
    }

    fn tolerance(&self) -> Tolerance {
        Tolerance {
            chord: self.settings.chord_mm,
            angle: self.settings.angle_rad,
        }
    }

    fn context(&self) -> FaceContext<'_> {
        FaceContext {
            brep: self.brep,
            edges: &self.edges,
            size: self.size,
            chord: self.settings.chord_mm,
            attributes: self.settings.attributes,
            volume_origins: self.volume_origins,
        }
    }

    /// The points of an edge at its level. Returns `None` if they are not finite.
    fn divided(&self, edge: usize) -> Option<EdgePoints> {
        let level = self.levels.edges[edge];
        let curve = &self.brep.edges[edge];
        let points = edge_points(
            curve,
            &self.brep.vertices,
            self.tolerance().finer(level),
            self.least[edge] << (level / 2).min(4),
        )?;
        Some(self.divisions.applied(edge, curve, points))
    }

    /// The mesh of a face at its level.
    fn meshed(&self, face: usize) -> Result<FaceMesh, FaceMeshError> {
        let tolerance = self.tolerance().finer(self.levels.faces[face]);
        mesh_face(self.context(), &self.brep.faces[face], tolerance)
    }

    /// Divides edges where the boundaries of a face touch, until no contact is left or the passes are used up.
    fn divide_at_contacts(&mut self) {
        for _ in 0..CONTACT_PASSES {
            let touched = self.divisions.add_all(self.brep, &self.edges, &self.meshes);
            if touched.is_empty() {
                return;
            }
            for &edge in &touched {
                self.edges[edge] = self.divided(edge);
            }
            for (index, face) in self.brep.faces.iter().enumerate() {
                if edges_of(face).any(|edge| touched.binary_search(&edge).is_ok()) {
                    self.meshes[index] = self.meshed(index);
                }
            }
        }
    }

    /// Meshes unsatisfactory faces and their neighbors with finer edges. Returns `false` if there is no such face.
    fn refine(&mut self) -> bool {
        let cuts = cuts(self.brep, &self.meshes, self.settings);
        let tried: Vec<usize> = (0..self.meshes.len())
            .filter(|&face| self.levels.faces[face] < FINEST)
            .filter(|&face| wants_finer(&self.meshes[face], cuts[face]))
            .collect();
        if tried.is_empty() {
            return false;
        }

        let mut is_touched = vec![false; self.brep.edges.len()];
        for &face in &tried {
            let is_rough = is_rough(&self.meshes[face]);
            self.levels
                .raise(self.brep, face, is_rough, &mut is_touched);
        }
        for edge in (0..is_touched.len()).filter(|&edge| is_touched[edge]) {
            self.edges[edge] = self.divided(edge);
        }
        for (index, face) in self.brep.faces.iter().enumerate() {
            let has_finer_edge = || curved_edges(self.brep, face).any(|edge| is_touched[edge]);
            if tried.binary_search(&index).is_ok() || has_finer_edge() {
                self.meshes[index] = self.meshed(index);
            }
        }
        true
    }

    /// Meshes faces in the plane of their boundary if they have no mesh on their surface.
    fn flatten_displaced_faces(&mut self) {
        for (index, face) in self.brep.faces.iter().enumerate() {
            if is_displaced(face, &self.meshes[index])
                && let Some(planar) = planar_mesh(self.context(), face, self.tolerance())
            {
                self.meshes[index] = Ok(planar);
            }
        }
    }
}

/// Whether the plane of its boundary may suit a face better than its own surface. The boundary of a plane face lies in a plane
/// even if its surface is in the wrong position.
fn is_displaced(face: &BrepFace, mesh: &Result<FaceMesh, FaceMeshError>) -> bool {
    let Ok(mesh) = mesh else {
        return true;
    };
    mesh.off_surface == Some(Off::Moved) && matches!(*face.surface, Surface::Plane(_))
}

/// The refinement level of each edge and each face.
struct Levels {
    edges: Vec<u32>,
    faces: Vec<u32>,
}

impl Levels {
    /// Refines a face and its curved edges, and marks the edges that must be divided again.
    fn raise(&mut self, brep: &Brep, face: usize, is_rough: bool, is_touched: &mut [bool]) {
        let edges = || curved_edges(brep, &brep.faces[face]);
        let finest_edge = edges().map(|edge| self.edges[edge]).max().unwrap_or(0);
        let step = if is_rough { ROUGH_STEP } else { 1 };
        // The finer edge of a neighbor may be the only reason why the face is rough.
        let level = if finest_edge > self.faces[face] {
            finest_edge
        } else {
            self.faces[face] + step
        };
        self.faces[face] = level;
        for edge in edges() {
            // All edges of a face are divided alike, because a thin ring with one side finer than the other is rough.
            is_touched[edge] |= self.edges[edge] < level;
            self.edges[edge] = self.edges[edge].max(level);
        }
    }
}

/// Returns for each face whether it cuts too much off its solid. A shape that has used a quarter of its triangle budget saves the
/// rest for rough faces.
fn cuts(
    brep: &Brep,
    meshes: &[Result<FaceMesh, FaceMeshError>],
    settings: &MeshSettings,
) -> Vec<bool> {
    if settings.volume_loss <= 0.0 || n_triangles(meshes) > settings.max_triangles / 4 {
        return vec![false; meshes.len()];
    }
    cutting_faces(brep, meshes, settings.volume_loss)
}

fn wants_finer(mesh: &Result<FaceMesh, FaceMeshError>, cuts: bool) -> bool {
    (cuts || is_rough(mesh))
        && mesh
            .as_ref()
            .map_or(true, |mesh| mesh.triangles.len() < MOST_TRIANGLES)
}

fn is_rough(mesh: &Result<FaceMesh, FaceMeshError>) -> bool {
    mesh.as_ref().map_or(true, |mesh| mesh.is_rough)
}

fn n_triangles(meshes: &[Result<FaceMesh, FaceMeshError>]) -> u64 {
    meshes
        .iter()
        .flatten()
        .map(|mesh| mesh.triangles.len() as u64)
        .sum()
}

fn edges_of(face: &BrepFace) -> impl Iterator<Item = usize> + '_ {
    let uses = face.loops.iter().flat_map(|bound| match bound {
        Loop::Edges(uses) => uses.as_slice(),
        Loop::Vertex(_) => &[],
    });
    uses.map(|use_| use_.edge as usize)
}

fn curved_edges<'a>(brep: &'a Brep, face: &'a BrepFace) -> impl Iterator<Item = usize> + 'a {
    let is_curved = |edge: &usize| {
        brep.edges
            .get(*edge)
            .is_some_and(|edge| !matches!(*edge.curve, Curve::Line { .. }))
    };
    edges_of(face).filter(is_curved)
}

/// The least number of pieces of each edge. It is larger for an edge that may bound a lens.
fn least_pieces(brep: &Brep) -> Vec<usize> {
    let mut least = vec![1; brep.edges.len()];
    for face in &brep.faces {
        if edges_of(face).take(LENS_EDGES + 1).count() <= LENS_EDGES {
            for edge in curved_edges(brep, face) {
                least[edge] = LENS_PIECES;
            }
        }
    }
    least
}
