//! Computes what a labeler should find: the dihedral angles and the partition, from normals in closed form.

use crate::geometry::angle_deg;
use crate::shell::Shell;
use partprobe_carrier::{Edge, Face, FaceGraph, Partition, distance};
use partprobe_sources::partition_by_type_and_angle;

/// The dihedral threshold, in degrees, of the parts that are counted.
pub(crate) const THETA_DEG: f64 = 8.0;

/// The part of each face at the threshold.
pub(crate) fn partition(shell: &Shell) -> Partition {
    partition_by_type_and_angle(&face_graph(shell), THETA_DEG)
}

/// The faces with their types, and the edges with their dihedral angles at the parametric midpoint.
fn face_graph(shell: &Shell) -> FaceGraph {
    let faces = shell.faces.iter().map(|face| {
        let area = face.area.unwrap_or(f64::NAN);
        Face::new(0, face.surface.face_type(), area)
    });
    let uses = shell.uses();
    let shared = uses
        .iter()
        .enumerate()
        .filter_map(|(edge, uses)| match uses[..] {
            [(a, _), (b, _)] if a != b => Some(edge_between(shell, edge, [a, b])),
            _ => None,
        });
    FaceGraph {
        faces: faces.collect(),
        edges: shared.collect(),
    }
}

fn edge_between(shell: &Shell, edge: usize, [a, b]: [usize; 2]) -> Edge {
    let edge = &shell.edges[edge];
    let (start, end) = (shell.vertices[edge.start], shell.vertices[edge.end]);
    let middle = edge.curve.middle(start, end);
    let normal = |face: usize| {
        let face = &shell.faces[face];
        let normal = face.surface.normal(middle);
        if face.same_sense {
            normal
        } else {
            normal.map(|x| -x)
        }
    };
    let phi = angle_deg(normal(a), normal(b));
    Edge {
        faces: [a.min(b) as u32, a.max(b) as u32],
        phi,
        length: distance(start, end),
    }
}
