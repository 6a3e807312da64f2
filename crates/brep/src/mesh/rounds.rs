//! Meshing in rounds: faces that come out rough or not at all, or cut too much off their solid, are tried again with
//! finer edges.
//!
//! A finer edge changes both its faces, so a round meshes again every face that touches one.

use super::MeshSettings;
use super::cut_off::cutting_faces;
use super::divisions::Divisions;
use super::edge_points::{EdgePoints, Tolerance, edge_points};
use super::face_mesh::{FaceContext, FaceMesh, face_mesh};
use super::flat::flat_mesh;
use super::layout::Obstacle;
use super::unwrap::Off;
use crate::geometry::{Curve, Surface};
use crate::model::{Brep, BrepFace, Loop};
use partprobe_shape::Point;

/// The finest level of a face; two levels halve its chords.
const FINEST: u32 = 6;
/// Levels by which a rough face is made finer: one that only cuts off too much needs no more than one.
const ROUGH_STEP: u32 = 2;
/// How often it is looked for faces to try again: one may become rough only when its neighbors' edges are divided.
const ROUNDS: u32 = 5;
/// How often edges are divided further where the boundaries of a face touch: each division may show another contact.
const CONTACT_ROUNDS: u32 = 8;
/// A face with so many triangles stays as it is.
pub(super) const MOST_TRIANGLES: usize = 4000;
/// A face with so few edges may be a lens, which needs its curved edges divided.
const LENS_EDGES: usize = 3;
/// Pieces of a lens' curved edge.
const LENS_PIECES: usize = 4;

/// The mesh of each face, or why it has none. `size` is the diagonal of the shape, `volume_origins` a place near
/// each solid if volumes are wanted.
pub(crate) fn face_meshes(
    brep: &Brep,
    settings: &MeshSettings,
    size: f64,
    volume_origins: &[Point],
) -> Vec<Result<FaceMesh, Obstacle>> {
    let tolerance = Tolerance {
        chord: settings.chord_mm,
        angle: settings.angle_rad,
    };
    let least = least_pieces(brep);
    let mut levels = Levels {
        edges: vec![0; brep.edges.len()],
        faces: vec![0; brep.faces.len()],
    };
    let mut divisions = Divisions::none(brep.edges.len(), size, settings.chord_mm);
    let divide = |edge: usize, level: u32, divisions: &Divisions| -> Option<EdgePoints> {
        let curve = &brep.edges[edge];
        let points = edge_points(
            curve,
            &brep.vertices,
            tolerance.finer(level),
            least[edge] << (level / 2).min(4),
        )?;
        Some(divisions.applied(edge, curve, points))
    };
    let mut edges: Vec<Option<EdgePoints>> = (0..brep.edges.len())
        .map(|edge| divide(edge, 0, &divisions))
        .collect();
    let (chord, attributes) = (settings.chord_mm, settings.attributes);
    let mesh = |face: usize, edges: &[Option<EdgePoints>], level: u32| {
        let context = FaceContext {
            brep,
            edges,
            size,
            chord,
            attributes,
            volume_origins,
        };
        face_mesh(context, &brep.faces[face], tolerance.finer(level))
    };
    let mut meshes: Vec<_> = (0..brep.faces.len())
        .map(|face| mesh(face, &edges, 0))
        .collect();
    for round in 0..=ROUNDS {
        for _ in 0..CONTACT_ROUNDS {
            let touched = divisions.add_all(brep, &edges, &meshes);
            if touched.is_empty() {
                break;
            }
            for &edge in &touched {
                edges[edge] = divide(edge, levels.edges[edge], &divisions);
            }
            for (face, slot) in meshes.iter_mut().enumerate() {
                if edges_of(&brep.faces[face]).any(|edge| touched.binary_search(&edge).is_ok()) {
                    *slot = mesh(face, &edges, levels.faces[face]);
                }
            }
        }
        if round == ROUNDS {
            break;
        }
        let cuts = cuts(brep, &meshes, settings);
        let may_be_tried =
            |face: &usize| levels.faces[*face] < FINEST && wants_finer(&meshes[*face], cuts[*face]);
        let tried: Vec<usize> = (0..meshes.len()).filter(may_be_tried).collect();
        if tried.is_empty() {
            break;
        }
        let mut is_touched = vec![false; brep.edges.len()];
        for &face in &tried {
            levels.raise(brep, face, is_rough(&meshes[face]), &mut is_touched);
        }
        for edge in (0..brep.edges.len()).filter(|&edge| is_touched[edge]) {
            edges[edge] = divide(edge, levels.edges[edge], &divisions);
        }
        for (face, slot) in meshes.iter_mut().enumerate() {
            let borders = || curved_edges(brep, &brep.faces[face]).any(|edge| is_touched[edge]);
            if tried.binary_search(&face).is_ok() || borders() {
                *slot = mesh(face, &edges, levels.faces[face]);
            }
        }
    }
    let is_displaced = |(face, mesh): &(usize, &mut Result<FaceMesh, Obstacle>)| match mesh {
        // The boundary of a plane face is a plane face without its surface, too.
        Ok(mesh) => {
            mesh.off_surface == Some(Off::Moved)
                && matches!(*brep.faces[*face].surface, Surface::Plane(_))
        }
        Err(_) => true,
    };
    for (face, mesh) in meshes.iter_mut().enumerate().filter(is_displaced) {
        let context = FaceContext {
            brep,
            edges: &edges,
            size,
            chord,
            attributes,
            volume_origins,
        };
        if let Some(flat) = flat_mesh(context, &brep.faces[face], tolerance) {
            *mesh = Ok(flat);
        }
    }
    meshes
}

/// How fine each edge and each face is meshed.
struct Levels {
    edges: Vec<u32>,
    faces: Vec<u32>,
}

impl Levels {
    /// Makes a face finer, and its curved edges with it; marks those that must be divided again.
    fn raise(&mut self, brep: &Brep, face: usize, is_rough: bool, is_touched: &mut [bool]) {
        let edges = || curved_edges(brep, &brep.faces[face]);
        let finest_edge = edges().map(|edge| self.edges[edge]).max().unwrap_or(0);
        let step = if is_rough { ROUGH_STEP } else { 1 };
        // A neighbor's finer edge alone may have made it rough.
        let level = if finest_edge > self.faces[face] {
            finest_edge
        } else {
            self.faces[face] + step
        };
        self.faces[face] = level;
        for edge in edges() {
            // All around a face its edges are divided alike: a thin ring with one side finer than the other is rough.
            is_touched[edge] |= self.edges[edge] < level;
            self.edges[edge] = self.edges[edge].max(level);
        }
    }
}

/// For each face whether it cuts too much off its solid. A shape that is near its budget keeps what room there is for
/// rough faces.
fn cuts(brep: &Brep, meshes: &[Result<FaceMesh, Obstacle>], settings: &MeshSettings) -> Vec<bool> {
    if settings.volume_loss <= 0.0 || n_triangles(meshes) > settings.max_triangles / 4 {
        return vec![false; meshes.len()];
    }
    cutting_faces(brep, meshes, settings.volume_loss)
}

fn wants_finer(mesh: &Result<FaceMesh, Obstacle>, cuts: bool) -> bool {
    (cuts || is_rough(mesh))
        && mesh
            .as_ref()
            .map_or(true, |mesh| mesh.triangles.len() < MOST_TRIANGLES)
}

fn is_rough(mesh: &Result<FaceMesh, Obstacle>) -> bool {
    mesh.as_ref().map_or(true, |mesh| mesh.is_rough)
}

fn n_triangles(meshes: &[Result<FaceMesh, Obstacle>]) -> u64 {
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

/// The least number of pieces of each edge: more where it may bound a lens.
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
