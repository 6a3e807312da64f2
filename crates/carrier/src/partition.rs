//! STEP-Parts: faces of one primitive type, joined across near-tangent edges (paper §3.2).

use partprobe_shape::{FaceGraph, SameTypePair};

/// Slack on the angle threshold, in degrees: drafts of exactly 8° occur in real files.
pub const ANGLE_TIE_DEG: f64 = 1e-6;

/// The part that each face belongs to.
///
/// Invariant: part ids are 0..n_parts, numbered by each part's lowest face index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Partition {
    parts: Vec<u32>,
    n_parts: u32,
}

impl Partition {
    /// Groups adjacent faces of one primitive type whose dihedral angle at a shared edge is at most `theta_deg`.
    ///
    /// An undefined angle joins nothing, and faces that share several edges join if any of them passes.
    #[must_use]
    pub fn by_type_and_angle(graph: &FaceGraph, theta_deg: f64) -> Self {
        Self::from_near_tangent_pairs(graph.faces.len(), graph.same_type_pairs(), theta_deg)
    }

    /// The same by the types after recognition: a cylinder counts as one even if its file writes it as a B-spline.
    #[must_use]
    pub fn by_canonical_type_and_angle(graph: &FaceGraph, theta_deg: f64) -> Self {
        Self::from_near_tangent_pairs(
            graph.faces.len(),
            graph.same_canonical_type_pairs(),
            theta_deg,
        )
    }

    fn from_near_tangent_pairs(
        n_faces: usize,
        pairs: impl Iterator<Item = SameTypePair>,
        theta_deg: f64,
    ) -> Self {
        let joins = pairs.filter(|pair| pair.phi <= theta_deg + ANGLE_TIE_DEG);
        Self::from_joined_pairs(n_faces, joins.map(|pair| pair.faces))
    }

    /// Groups faces that a chain of the given pairs connects.
    #[must_use]
    pub fn from_joined_pairs(n_faces: usize, pairs: impl IntoIterator<Item = [u32; 2]>) -> Self {
        let mut roots: Vec<u32> = (0..).take(n_faces).collect();
        for [a, b] in pairs {
            let (a, b) = (find_root(&mut roots, a), find_root(&mut roots, b));
            roots[a.max(b) as usize] = a.min(b);
        }
        let keys: Vec<u32> = (0..)
            .take(n_faces)
            .map(|face| find_root(&mut roots, face))
            .collect();
        Self::from_keys(&keys)
    }

    /// Groups faces with equal keys, one key for each face.
    #[must_use]
    pub fn from_keys<K: Ord>(keys: &[K]) -> Self {
        let mut ids = std::collections::BTreeMap::new();
        let mut parts = Vec::with_capacity(keys.len());
        for key in keys {
            let next = u32::try_from(ids.len()).unwrap_or(u32::MAX);
            parts.push(*ids.entry(key).or_insert(next));
        }
        let n_parts = u32::try_from(ids.len()).unwrap_or(u32::MAX);
        Self { parts, n_parts }
    }

    /// The part of each face.
    #[must_use]
    pub fn parts(&self) -> &[u32] {
        &self.parts
    }

    /// How many parts there are.
    #[must_use]
    pub fn n_parts(&self) -> u32 {
        self.n_parts
    }
}

/// The representative of `face`'s group; halves the path on its way.
fn find_root(roots: &mut [u32], mut face: u32) -> u32 {
    while roots[face as usize] != face {
        let grandparent = roots[roots[face as usize] as usize];
        roots[face as usize] = grandparent;
        face = grandparent;
    }
    face
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_shape::{Edge, Face, FaceType};
    use proptest::prelude::*;

    fn face(face_type: FaceType) -> Face {
        Face::new(1, face_type, 1.0)
    }

    #[track_caller]
    fn check(types: &[FaceType], edges: &[(u32, u32, f64)], expected: &[u32]) {
        let edges = edges
            .iter()
            .map(|&(a, b, phi)| Edge {
                faces: [a, b],
                phi,
                length: 1.0,
            })
            .collect();
        let graph = FaceGraph {
            faces: types.iter().copied().map(face).collect(),
            edges,
        };
        assert_eq!(Partition::by_type_and_angle(&graph, 8.0).parts(), expected);
    }

    #[test]
    fn the_predicate_asks_type_and_angle() {
        use FaceType::{Cylinder, Plane};
        check(&[], &[], &[]);
        check(&[Plane, Plane], &[(0, 1, 0.0)], &[0, 0]);
        check(&[Plane, Cylinder], &[(0, 1, 0.0)], &[0, 1]);
        check(&[Plane, Plane], &[(0, 1, 90.0)], &[0, 1]);
        check(&[Plane, Plane], &[(0, 1, 8.0 + 5e-7)], &[0, 0]);
        check(&[Plane, Plane], &[(0, 1, 8.00001)], &[0, 1]);
        check(&[Plane, Plane], &[(0, 1, f64::NAN)], &[0, 1]);
        check(&[Plane, Plane], &[(0, 1, 90.0), (0, 1, 1.0)], &[0, 0]);
        check(
            &[Plane, Cylinder, Plane, Plane],
            &[(2, 3, 0.0), (0, 3, 0.0)],
            &[0, 1, 0, 0],
        );
    }

    #[test]
    fn a_recognized_cylinder_joins_a_written_one() {
        let mut graph = FaceGraph {
            faces: [FaceType::Cylinder, FaceType::Bspline, FaceType::Bspline]
                .map(face)
                .into(),
            edges: vec![
                Edge {
                    faces: [0, 1],
                    phi: 0.0,
                    length: 1.0,
                },
                Edge {
                    faces: [1, 2],
                    phi: 0.0,
                    length: 1.0,
                },
            ],
        };
        assert_eq!(
            Partition::by_canonical_type_and_angle(&graph, 8.0).parts(),
            [0, 1, 1]
        );
        graph.faces[1].canonical_type = FaceType::Cylinder;
        assert_eq!(
            Partition::by_canonical_type_and_angle(&graph, 8.0).parts(),
            [0, 0, 1]
        );
        assert_eq!(Partition::by_type_and_angle(&graph, 8.0).parts(), [0, 1, 1]);
    }

    proptest! {
        #[test]
        fn the_order_of_pairs_does_not_matter(pairs in proptest::collection::vec((0u32..20, 0u32..20), 0..40)) {
            let forward = Partition::from_joined_pairs(20, pairs.iter().map(|&(a, b)| [a, b]));
            let backward = Partition::from_joined_pairs(20, pairs.iter().rev().map(|&(a, b)| [b, a]));
            prop_assert_eq!(&forward, &backward);
            for (a, b) in pairs {
                prop_assert_eq!(forward.parts()[a as usize], forward.parts()[b as usize]);
            }
        }
    }
}
