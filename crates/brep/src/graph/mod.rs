//! Makes the face graph of a B-Rep: which faces share an edge, at which dihedral angle, along which length.
//!
//! Two faces are neighbors if they use the same edge in the file. Nothing is sewn. A defect of orientation is counted, never
//! repaired.

mod adjacency;
mod dihedral;
#[cfg(test)]
mod tests;

use crate::geometry::edge_length;
use crate::model::{Brep, BrepFace};
use dihedral::Dihedral;
use partprobe_shape::{Edge, Face, FaceGraph, Point, bounding_diagonal, distance};

pub use adjacency::{ShapeFlags, closed_solids};

/// If the length of an edge and the distance of its ends are below this fraction of the diagonal, the edge is a point and joins
/// nothing.
const DEGENERATE: f64 = 1e-10;

/// The face graph of a B-Rep, and the counts of its irregular edges. `areas` has an entry for each face.
pub(crate) fn graph_with_areas(brep: &Brep, areas: &[f64]) -> (FaceGraph, ShapeFlags) {
    let (pairs, mut flags) = adjacency::shared_edges(brep);
    let positions: Vec<Point> = brep.vertices.iter().map(|vertex| vertex.point).collect();
    let shortest = DEGENERATE * bounding_diagonal(&positions);
    let dihedral = Dihedral::new(brep);
    let mut edges = Vec::with_capacity(pairs.len());
    let mut known = None;
    for pair in pairs {
        // The pairs of one non-manifold edge are consecutive, so its length is computed only once.
        let length = match known {
            Some((edge, length)) if edge == pair.edge => length,
            _ => edge_length(&brep.edges[pair.edge as usize], &brep.vertices),
        };
        known = Some((pair.edge, length));
        if length <= shortest && ends_meet(brep, pair.edge, shortest) {
            flags.degenerate_edges += 1;
            continue;
        }
        let phi = dihedral.phi(pair.edge, pair.faces);
        flags.undefined_angles += u64::from(phi.is_nan());
        edges.push(Edge {
            faces: pair.faces,
            phi,
            length,
        });
    }
    edges.sort_by_key(|edge| edge.faces);
    let faces = brep
        .faces
        .iter()
        .zip(areas)
        .map(|(face, &area)| carrier_face(brep, face, area))
        .collect();
    (FaceGraph { faces, edges }, flags)
}

/// The face graph of a B-Rep without areas: they are NaN. It suffices for labels and costs a fraction of a mesh.
#[must_use]
pub fn face_graph(brep: &Brep) -> (FaceGraph, ShapeFlags) {
    graph_with_areas(brep, &vec![f64::NAN; brep.faces.len()])
}

/// Whether the vertices of an edge coincide. If they do not, the edge counts even if it has no length on its curve.
fn ends_meet(brep: &Brep, edge: u32, tolerance: f64) -> bool {
    let edge = &brep.edges[edge as usize];
    let [start, end] = [edge.start, edge.end].map(|vertex| brep.vertices[vertex as usize].point);
    distance(start, end) <= tolerance
}

fn carrier_face(brep: &Brep, face: &BrepFace, area: f64) -> Face {
    let component = brep
        .components
        .get(brep.shells[face.shell as usize].component as usize);
    let style = component.and_then(|component| component.styles.first());
    Face {
        step_id: face.step_id,
        face_type: face.face_type,
        canonical_type: face.face_type,
        area,
        shell: face.shell,
        solid: brep.shells[face.shell as usize].solid,
        instance: brep.shells[face.shell as usize].component,
        name: face.name.clone(),
        color: face.color.or(style.and_then(|style| style.color)),
        layer: face
            .layer
            .clone()
            .or_else(|| style.and_then(|style| style.layer.clone())),
    }
}
