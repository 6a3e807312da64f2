//! Collects the dihedral angles of one shape, and the thresholds at which its partition changes.

use partprobe_carrier::{FaceGraph, FaceType};
use std::collections::BTreeMap;

/// The angles between faces of one primitive type, and the merges that they cause.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeAngles {
    /// Type and φ of every shared edge between two faces of one type. φ is NaN if it is undefined.
    pub edges: Vec<(FaceType, f64)>,
    /// Type and φ of every pair of such faces. φ is the smallest φ of their shared edges, which decides whether they are
    /// joined.
    pub pairs: Vec<(FaceType, f64)>,
    /// The thresholds at which two parts become one, ascending. At θ, a shape has as many parts as it has faces, minus the
    /// number of merges up to θ.
    pub merges: Vec<f64>,
}

/// Collects the angles of a face graph.
///
/// The merges are the edges of a minimum spanning forest, weighted by φ. The partition changes at no other threshold.
/// Cost: `O(E log E)`.
#[must_use]
pub fn shape_angles(graph: &FaceGraph) -> ShapeAngles {
    let face_type = |face: u32| graph.faces[face as usize].face_type;
    let mut smallest: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    let mut edges = Vec::new();
    for pair in graph.same_type_pairs() {
        edges.push((face_type(pair.faces[0]), pair.phi));
        let phi = smallest.entry(pair.faces).or_insert(f64::NAN);
        *phi = phi.min(pair.phi);
    }
    let pairs = smallest
        .iter()
        .map(|(faces, &phi)| (face_type(faces[0]), phi))
        .collect();
    ShapeAngles {
        edges,
        pairs,
        merges: merges(graph.faces.len(), &smallest),
    }
}

/// Kruskal's algorithm: visits the pairs by ascending φ. Each pair that joins two parts is a merge.
fn merges(n_faces: usize, pairs: &BTreeMap<[u32; 2], f64>) -> Vec<f64> {
    let mut by_angle: Vec<_> = pairs.iter().filter(|(_, phi)| !phi.is_nan()).collect();
    by_angle.sort_by(|(_, a), (_, b)| a.total_cmp(b));
    let mut roots: Vec<u32> = (0..).take(n_faces).collect();
    let mut merges = Vec::new();
    for (&[a, b], &phi) in by_angle {
        let (a, b) = (root(&mut roots, a), root(&mut roots, b));
        if a != b {
            roots[a.max(b) as usize] = a.min(b);
            merges.push(phi);
        }
    }
    merges
}

fn root(roots: &mut [u32], mut face: u32) -> u32 {
    while roots[face as usize] != face {
        roots[face as usize] = roots[roots[face as usize] as usize];
        face = roots[face as usize];
    }
    face
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use partprobe_carrier::{Edge, Face};
    use partprobe_sources::{ANGLE_TIE_DEG, partition_by_type_and_angle};
    use proptest::prelude::*;

    pub(crate) fn graph(types: &[FaceType], edges: &[(u32, u32, f64)]) -> FaceGraph {
        let face = |&face_type: &FaceType| Face::new(1, face_type, 1.0);
        let edges = edges
            .iter()
            .map(|&(a, b, phi)| Edge {
                faces: [a, b],
                phi,
                length: 1.0,
            })
            .collect();
        FaceGraph {
            faces: types.iter().map(face).collect(),
            edges,
        }
    }

    #[test]
    fn pairs_keep_their_smallest_angle_and_cycles_merge_once() {
        use FaceType::{Cylinder, Plane};
        let edges = [
            (0, 1, 90.0),
            (0, 1, 5.0),
            (1, 2, 3.0),
            (0, 2, 7.0),
            (2, 3, 0.0),
            (3, 4, f64::NAN),
        ];
        let found = shape_angles(&graph(&[Plane, Plane, Plane, Cylinder, Cylinder], &edges));
        assert_eq!(found.edges.len(), 5);
        assert_eq!(found.pairs[..3], [(Plane, 5.0), (Plane, 7.0), (Plane, 3.0)]);
        assert!(found.pairs[3].1.is_nan());
        assert_eq!(found.merges, [3.0, 5.0]);
    }

    proptest! {
        #[test]
        fn merges_count_the_parts_at_every_threshold(
            edges in proptest::collection::vec((0u32..12, 0u32..12, 0.0f64..180.0), 0..40),
            theta in 0.0f64..180.0,
        ) {
            let edges: Vec<_> = edges.into_iter().filter(|(a, b, _)| a < b).collect();
            let graph = graph(&[FaceType::Plane; 12], &edges);
            let n_merges = shape_angles(&graph).merges.iter().filter(|&&phi| phi <= theta + ANGLE_TIE_DEG).count();
            prop_assert_eq!(partition_by_type_and_angle(&graph, theta).n_parts() as usize, 12 - n_merges);
        }
    }
}
