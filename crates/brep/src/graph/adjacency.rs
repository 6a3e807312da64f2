//! Finds the faces that use each edge, and counts irregular uses.

use crate::model::{Brep, Loop};

/// Counts of irregular edges of a shape. None of them prevents labeling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShapeFlags {
    /// Edges that more than two faces use. Each pair of these faces counts as adjacent.
    pub non_manifold_edges: u64,
    /// Edges that two faces walk in the same direction, because one of the faces is reversed.
    pub twice_same_direction: u64,
    /// Edges whose faces belong to different shells.
    pub edges_across_shells: u64,
    /// Edges that one face uses on both sides: seams and slits. They join nothing.
    pub seams: u64,
    /// Edges that only one face uses, once.
    pub free_edges: u64,
    /// Shared edges without a length. They join nothing.
    pub degenerate_edges: u64,
    /// Shared edges at which no dihedral angle is defined.
    pub undefined_angles: u64,
}

/// Two different faces that share an edge. The face with the lower index comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SharedEdge {
    pub(super) edge: u32,
    pub(super) faces: [u32; 2],
}

/// One walk of a face along an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Coedge {
    edge: u32,
    face: u32,
    /// Whether the walk runs from the edge's start to its end, seen from outside the shell.
    forward: bool,
}

/// Every pair of faces that share an edge, in the order of the edges.
pub(super) fn shared_edges(brep: &Brep) -> (Vec<SharedEdge>, ShapeFlags) {
    let mut walks = walks(brep);
    walks.sort_unstable();
    let mut flags = ShapeFlags::default();
    let mut shared = Vec::with_capacity(walks.len() / 2);
    for walks in walks.chunk_by(|a, b| a.edge == b.edge) {
        let mut faces: Vec<u32> = walks.iter().map(|walk| walk.face).collect();
        faces.dedup();
        count_oddities(brep, walks, &faces, &mut flags);
        for (i, &a) in faces.iter().enumerate() {
            shared.extend(faces[i + 1..].iter().map(|&b| SharedEdge {
                edge: walks[0].edge,
                faces: [a, b],
            }));
        }
    }
    (shared, flags)
}

/// Whether each solid is closed in the file. It is closed if each of its edges is used equally often in both directions.
///
/// A solid with a lost face is open.
#[must_use]
pub fn closed_solids(brep: &Brep) -> Vec<bool> {
    let mut is_closed = vec![false; brep.solids.len()];
    let solid_of = |walk: &Coedge| brep.shells[brep.faces[walk.face as usize].shell as usize].solid;
    let mut walks: Vec<(Option<u32>, Coedge)> = walks(brep)
        .into_iter()
        .map(|walk| (solid_of(&walk), walk))
        .collect();
    for solid in brep
        .faces
        .iter()
        .filter_map(|face| brep.shells[face.shell as usize].solid)
    {
        is_closed[solid as usize] = true;
    }
    walks.sort_unstable();
    for walks in walks.chunk_by(|a, b| (a.0, a.1.edge) == (b.0, b.1.edge)) {
        let n_forward = walks.iter().filter(|(_, walk)| walk.forward).count();
        if let Some(solid) = walks[0].0.filter(|_| 2 * n_forward != walks.len()) {
            is_closed[solid as usize] = false;
        }
    }
    is_closed
}

fn walks(brep: &Brep) -> Vec<Coedge> {
    let mut walks = Vec::with_capacity(2 * brep.edges.len());
    for (index, face) in (0..).zip(&brep.faces) {
        let edge_loops = face.loops.iter().filter_map(|boundary| match boundary {
            Loop::Edges(uses) => Some(uses),
            Loop::Vertex(_) => None,
        });
        for edge_use in edge_loops.flatten() {
            walks.push(Coedge {
                edge: edge_use.edge,
                face: index,
                forward: edge_use.forward != face.flipped,
            });
        }
    }
    walks
}

fn count_oddities(brep: &Brep, walks: &[Coedge], faces: &[u32], flags: &mut ShapeFlags) {
    let shell = |face: u32| brep.faces[face as usize].shell;
    match (faces, walks) {
        ([_], [_]) => flags.free_edges += 1,
        ([_], _) => flags.seams += 1,
        ([_, _], [a, b]) if a.forward == b.forward => flags.twice_same_direction += 1,
        ([_, _], _) => {}
        _ => flags.non_manifold_edges += 1,
    }
    if faces.iter().any(|&face| shell(face) != shell(faces[0])) {
        flags.edges_across_shells += 1;
    }
}
