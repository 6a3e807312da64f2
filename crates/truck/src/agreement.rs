//! Compares two kernels' readings of one file by the `#` numbers of the faces.

use partprobe_shape::FaceGraph;
use std::collections::{BTreeMap, BTreeSet};

/// Areas agree within this fraction.
const AREA_TOLERANCE: f64 = 0.01;

/// What two readings of one file have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Agreement {
    /// The same `#` numbers are faces.
    pub faces: bool,
    /// And they have the same types.
    pub types: bool,
    /// The same pairs of faces share the same number of edges.
    pub adjacency: bool,
    /// The same faces share parts.
    pub partition: bool,
    /// Faces that both have.
    pub n_common_faces: usize,
    /// Those whose areas are within 1 % of each other.
    pub n_equal_areas: usize,
}

/// One kernel's reading of a file.
#[derive(Clone, Copy, Debug)]
pub struct Reading<'a> {
    /// The faces and their shared edges.
    pub graph: &'a FaceGraph,
    /// The part of each face of the graph.
    pub parts: &'a [u32],
}

impl Agreement {
    /// Compares two readings whose faces were grouped by the same rule.
    #[must_use]
    pub fn of(a: Reading<'_>, b: Reading<'_>) -> Self {
        let same_parts = parts(a) == parts(b);
        let (a, b) = (a.graph, b.graph);
        let types = |graph: &FaceGraph| -> BTreeSet<_> {
            graph
                .faces
                .iter()
                .map(|face| (face.step_id, face.face_type))
                .collect()
        };
        let (ids_a, ids_b) = (step_ids(a), step_ids(b));
        let areas: BTreeMap<u64, f64> = a
            .faces
            .iter()
            .map(|face| (face.step_id, face.area))
            .collect();
        let common = b
            .faces
            .iter()
            .filter_map(|face| Some((*areas.get(&face.step_id)?, face.area)));
        Self {
            faces: ids_a == ids_b,
            types: types(a) == types(b),
            adjacency: pairs(a) == pairs(b),
            partition: same_parts,
            n_common_faces: common.clone().count(),
            n_equal_areas: common
                .filter(|(a, b)| (a - b).abs() <= AREA_TOLERANCE * a.max(*b))
                .count(),
        }
    }

    /// Faces, types, adjacency and partition are all the same.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.faces && self.types && self.adjacency && self.partition
    }
}

fn step_ids(graph: &FaceGraph) -> Vec<u64> {
    let mut ids: Vec<u64> = graph.faces.iter().map(|face| face.step_id).collect();
    ids.sort_unstable();
    ids
}

fn pairs(graph: &FaceGraph) -> Vec<[u64; 2]> {
    let pair = |faces: [u32; 2]| {
        let mut ids = faces.map(|face| graph.faces[face as usize].step_id);
        ids.sort_unstable();
        ids
    };
    let mut pairs: Vec<[u64; 2]> = graph.edges.iter().map(|edge| pair(edge.faces)).collect();
    pairs.sort_unstable();
    pairs
}

/// The parts as sets of `#` numbers: independent of the order of faces.
fn parts(reading: Reading<'_>) -> BTreeSet<BTreeSet<u64>> {
    let mut parts: BTreeMap<u32, BTreeSet<u64>> = BTreeMap::new();
    for (face, &part) in reading.graph.faces.iter().zip(reading.parts) {
        parts.entry(part).or_default().insert(face.step_id);
    }
    parts.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::Partition;
    use partprobe_shape::{Edge, Face, FaceType};

    fn face(step_id: u64, face_type: FaceType, area: f64) -> Face {
        Face::new(step_id, face_type, area)
    }

    /// Three planes in a row, the first two smooth.
    fn graph() -> FaceGraph {
        let edge = |faces: [u32; 2], phi: f64| Edge {
            faces,
            phi,
            length: 1.0,
        };
        FaceGraph {
            faces: [7, 8, 9].map(|id| face(id, FaceType::Plane, 1.0)).into(),
            edges: vec![edge([0, 1], 0.0), edge([1, 2], 90.0)],
        }
    }

    #[track_caller]
    fn check(other: &FaceGraph, exact: [bool; 4], n_equal_areas: usize) {
        let graphs = [&graph(), other];
        let partitions = graphs.map(|graph| Partition::by_type_and_angle(graph, 8.0));
        let [a, b] = [0, 1].map(|idx| Reading {
            graph: graphs[idx],
            parts: partitions[idx].parts(),
        });
        let found = Agreement::of(a, b);
        assert_eq!(
            [found.faces, found.types, found.adjacency, found.partition],
            exact
        );
        assert_eq!(
            (found.n_equal_areas, found.is_exact()),
            (n_equal_areas, exact == [true; 4])
        );
    }

    #[test]
    fn each_difference_shows_where_it_belongs() {
        check(&graph(), [true; 4], 3);
        let mut turned = graph();
        turned.faces.reverse();
        turned.edges = vec![
            Edge {
                faces: [1, 2],
                ..turned.edges[0]
            },
            Edge {
                faces: [0, 1],
                ..turned.edges[1]
            },
        ];
        check(&turned, [true; 4], 3);
        let mut other = graph();
        other.faces[0].face_type = FaceType::Bspline;
        check(&other, [true, false, true, false], 3);
        let mut other = graph();
        other.edges[1].phi = 1.0;
        check(&other, [true, true, true, false], 3);
        let mut other = graph();
        other.edges.pop();
        other.faces[1].area = 1.02;
        check(&other, [true, true, false, true], 2);
        let mut other = graph();
        other.faces.pop();
        other.edges.pop();
        check(&other, [false, false, false, false], 2);
    }
}
