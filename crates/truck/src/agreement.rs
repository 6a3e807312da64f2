//! Compares two kernels' readings of one file. Faces are matched by their `#` numbers.

use partprobe_shape::{FaceGraph, FaceType};
use std::collections::{BTreeMap, BTreeSet};

/// Two areas agree if they differ by at most this fraction of the larger one.
const AREA_TOLERANCE: f64 = 0.01;

/// What two readings of one file have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KernelAgreement {
    /// Whether both readings have faces with the same `#` numbers.
    pub faces: bool,
    /// Whether the faces also have the same types.
    pub types: bool,
    /// Whether the same pairs of faces share the same number of edges.
    pub adjacency: bool,
    /// Whether the same sets of faces form the parts.
    pub partition: bool,
    /// The number of faces that both readings have.
    pub n_common_faces: usize,
    /// The number of these faces whose areas are within 1 % of each other.
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

impl KernelAgreement {
    /// Compares two readings whose faces were grouped by the same rule.
    #[must_use]
    pub fn of(a: Reading<'_>, b: Reading<'_>) -> Self {
        let areas = common_areas(a.graph, b.graph);
        Self {
            faces: step_ids(a.graph) == step_ids(b.graph),
            types: types(a.graph) == types(b.graph),
            adjacency: pairs(a.graph) == pairs(b.graph),
            partition: parts(a) == parts(b),
            n_common_faces: areas.len(),
            n_equal_areas: areas.iter().filter(|areas| are_equal(**areas)).count(),
        }
    }

    /// Whether faces, types, adjacency and partition are all the same.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.faces && self.types && self.adjacency && self.partition
    }
}

/// The two areas of each face that both graphs have.
fn common_areas(a: &FaceGraph, b: &FaceGraph) -> Vec<[f64; 2]> {
    let of_a: BTreeMap<u64, f64> = a
        .faces
        .iter()
        .map(|face| (face.step_id, face.area))
        .collect();
    let mut areas = Vec::new();
    for face in &b.faces {
        if let Some(&area) = of_a.get(&face.step_id) {
            areas.push([area, face.area]);
        }
    }
    areas
}

fn are_equal([a, b]: [f64; 2]) -> bool {
    (a - b).abs() <= AREA_TOLERANCE * a.max(b)
}

fn types(graph: &FaceGraph) -> BTreeSet<(u64, FaceType)> {
    graph
        .faces
        .iter()
        .map(|face| (face.step_id, face.face_type))
        .collect()
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

/// The parts as sets of `#` numbers, so that the order of the faces does not matter.
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
    use partprobe_shape::{Edge, Face};
    use partprobe_sources::partition_by_type_and_angle;

    fn face(step_id: u64, face_type: FaceType, area: f64) -> Face {
        Face::new(step_id, face_type, area)
    }

    /// Three planes in a row. The edge between the first two is smooth.
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
        let partitions = graphs.map(|graph| partition_by_type_and_angle(graph, 8.0));
        let [a, b] = [0, 1].map(|idx| Reading {
            graph: graphs[idx],
            parts: partitions[idx].parts(),
        });
        let found = KernelAgreement::of(a, b);
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
        let mut reversed = graph();
        reversed.faces.reverse();
        reversed.edges = vec![
            Edge {
                faces: [1, 2],
                ..reversed.edges[0]
            },
            Edge {
                faces: [0, 1],
                ..reversed.edges[1]
            },
        ];
        check(&reversed, [true; 4], 3);
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
