//! Groups faces of one primitive type across near-tangent edges (STEP-Parts, section 3.2).
//!
//! A face graph and the threshold θ go in, and the part of each face comes out. The mesh is not used.

use partprobe_carrier::{FaceGraph, Partition, SameTypePair};

/// Slack on the angle threshold, in degrees: drafts of exactly 8° occur in real files.
pub const ANGLE_TIE_DEG: f64 = 1e-6;

/// Groups adjacent faces of one primitive type whose dihedral angle at a shared edge is at most `theta_deg`.
///
/// An undefined angle joins nothing. Faces that share several edges join if any of the edges passes.
#[must_use]
pub fn partition_by_type_and_angle(graph: &FaceGraph, theta_deg: f64) -> Partition {
    joined_below(theta_deg, graph.faces.len(), graph.same_type_pairs())
}

/// The same with the types after recognition: a cylinder counts as a cylinder even if its file writes it as a B-spline.
#[must_use]
pub fn partition_by_canonical_type_and_angle(graph: &FaceGraph, theta_deg: f64) -> Partition {
    let pairs = graph.same_canonical_type_pairs();
    joined_below(theta_deg, graph.faces.len(), pairs)
}

fn joined_below(
    theta_deg: f64,
    n_faces: usize,
    pairs: impl Iterator<Item = SameTypePair>,
) -> Partition {
    let joined = pairs.filter(|pair| pair.phi <= theta_deg + ANGLE_TIE_DEG);
    Partition::from_joined_pairs(n_faces, joined.map(|pair| pair.faces))
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::{Edge, Face, FaceType};

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
        assert_eq!(partition_by_type_and_angle(&graph, 8.0).parts(), expected);
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
            partition_by_canonical_type_and_angle(&graph, 8.0).parts(),
            [0, 1, 1]
        );
        graph.faces[1].canonical_type = FaceType::Cylinder;
        assert_eq!(
            partition_by_canonical_type_and_angle(&graph, 8.0).parts(),
            [0, 0, 1]
        );
        assert_eq!(partition_by_type_and_angle(&graph, 8.0).parts(), [0, 1, 1]);
    }
}
