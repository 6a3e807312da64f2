//! Holds the face adjacency graph: which faces share an edge, and at which dihedral angle.

use crate::face::Face;
use crate::face_type::FaceType;

/// A shared topological edge of two different faces.
///
/// Seams and degenerate edges are left out. An edge with more than two faces gives one `Edge` per pair of faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Indices of the two faces, the lower first.
    pub faces: [u32; 2],
    /// Dihedral angle between the oriented normals, in degrees from 0 (smooth) to 180 (folded back). It is NaN if it is
    /// undefined.
    pub phi: f64,
    /// Length of the edge, in millimeters.
    pub length: f64,
}

/// A pair of faces of one primitive type that share an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SameTypePair {
    /// Indices of the two faces, the lower first.
    pub faces: [u32; 2],
    /// Dihedral angle in degrees. It is NaN if it is undefined.
    pub phi: f64,
}

/// The faces of one shape and the edges between them.
///
/// Invariant: every face index of an edge is below `faces.len()`, and its two faces differ.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FaceGraph {
    /// The faces, in the order of the file's shells.
    pub faces: Vec<Face>,
    /// The shared edges, sorted by face pair. Several edges of one pair are separate entries.
    pub edges: Vec<Edge>,
}

impl FaceGraph {
    /// The edges whose two faces have the same primitive type, one entry per edge.
    pub fn same_type_pairs(&self) -> impl Iterator<Item = SameTypePair> + '_ {
        self.pairs_of_equal(|face| face.face_type)
    }

    /// The edges whose two faces have the same type after recognition, one entry per edge.
    pub fn same_canonical_type_pairs(&self) -> impl Iterator<Item = SameTypePair> + '_ {
        self.pairs_of_equal(|face| face.canonical_type)
    }

    fn pairs_of_equal(
        &self,
        face_type: fn(&Face) -> FaceType,
    ) -> impl Iterator<Item = SameTypePair> + '_ {
        self.edges.iter().filter_map(move |edge| {
            let [a, b] = edge.faces.map(|face| face_type(&self.faces[face as usize]));
            (a == b).then_some(SameTypePair {
                faces: edge.faces,
                phi: edge.phi,
            })
        })
    }

    /// Total length of the edges between each pair of groups, in millimeters, as `(lower group, higher group, length)`.
    ///
    /// `group_of_face` has one entry per face. Pairs are sorted. Edges inside a group are left out.
    #[must_use]
    pub fn boundary_lengths(&self, group_of_face: &[u32]) -> Vec<(u32, u32, f64)> {
        let mut lengths = std::collections::BTreeMap::new();
        for edge in &self.edges {
            let [a, b] = edge.faces.map(|face| group_of_face[face as usize]);
            if a != b {
                *lengths.entry((a.min(b), a.max(b))).or_insert(0.0) += edge.length;
            }
        }
        lengths
            .into_iter()
            .map(|((a, b), length)| (a, b, length))
            .collect()
    }
}
