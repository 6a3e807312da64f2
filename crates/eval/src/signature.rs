//! What a shape looks like to somebody who looks for its twins.

use carrier::{FaceGraph, FaceType};
use serde::{Deserialize, Serialize};

/// Relative face areas that differ by no more than this are equal.
const AREA_TOLERANCE: f64 = 1e-3;

/// The outline of a shape: what stays when it is moved, scaled or renumbered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Signature {
    /// How many faces of each primitive type there are, by type code.
    pub type_histogram: [u32; FaceType::ALL.len()],
    /// How many shared edges there are.
    pub n_edges: usize,
    /// The faces' shares of the whole area, largest first.
    pub relative_areas: Vec<f64>,
}

/// What related shapes have in common.
pub(crate) type Family = ([u32; FaceType::ALL.len()], usize);

/// The outline of a face graph.
#[must_use]
pub fn signature(graph: &FaceGraph) -> Signature {
    let mut type_histogram = [0; FaceType::ALL.len()];
    for face in &graph.faces {
        type_histogram[usize::from(face.face_type.code())] += 1;
    }
    let total: f64 = graph.faces.iter().map(|face| face.area).sum();
    let share = |area: f64| if total > 0.0 && area.is_finite() { area / total } else { 0.0 };
    let mut relative_areas: Vec<f64> = graph.faces.iter().map(|face| share(face.area)).collect();
    relative_areas.sort_by(|a, b| b.total_cmp(a));
    Signature { type_histogram, n_edges: graph.edges.len(), relative_areas }
}

impl Signature {
    /// What related shapes have in common: they never stand on both sides of a split.
    pub(crate) fn family(&self) -> Family {
        (self.type_histogram, self.n_edges)
    }

    /// Whether the two shapes count as one.
    #[must_use]
    pub fn is_duplicate_of(&self, other: &Self) -> bool {
        let areas = || self.relative_areas.iter().zip(&other.relative_areas);
        self.family() == other.family()
            && self.relative_areas.len() == other.relative_areas.len()
            && areas().all(|(a, b)| (a - b).abs() <= AREA_TOLERANCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use carrier::{Edge, Face};

    fn graph(faces: &[(FaceType, f64)], n_edges: usize) -> FaceGraph {
        let face = |&(face_type, area)| Face {
            step_id: 1,
            face_type,
            canonical_type: face_type,
            area,
            shell: 0,
            solid: None,
            instance: 0,
            name: None,
            color: None,
            layer: None,
        };
        let edge = Edge { faces: [0, 1], phi: 90.0, length: 1.0 };
        FaceGraph { faces: faces.iter().map(face).collect(), edges: vec![edge; n_edges] }
    }

    #[test]
    fn order_and_scale_do_not_matter() {
        use FaceType::{Plane, Torus};
        let a = signature(&graph(&[(Plane, 1.0), (Torus, 3.0)], 2));
        let b = signature(&graph(&[(Torus, 30.0), (Plane, 10.0)], 2));
        assert_eq!(a, b);
        assert_eq!(a.type_histogram, [1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0]);
        assert_eq!((a.n_edges, a.relative_areas.as_slice()), (2, &[0.75, 0.25][..]));
    }

    #[test]
    fn duplicates_agree_in_types_edges_and_areas() {
        use FaceType::{Cone, Plane};
        let base = signature(&graph(&[(Plane, 0.5), (Cone, 0.5)], 2));
        let is_duplicate =
            |faces: &[(FaceType, f64)], n_edges| signature(&graph(faces, n_edges)).is_duplicate_of(&base);
        assert!(is_duplicate(&[(Plane, 0.5009), (Cone, 0.4991)], 2));
        assert!(!is_duplicate(&[(Plane, 0.5011), (Cone, 0.4989)], 2));
        assert!(!is_duplicate(&[(Plane, 0.5), (Cone, 0.5)], 3));
        assert!(!is_duplicate(&[(Plane, 0.5), (Plane, 0.5)], 2));
    }

    #[test]
    fn shapes_without_area_have_a_signature_too() {
        assert_eq!(signature(&graph(&[], 0)).relative_areas, [0.0; 0]);
        assert_eq!(signature(&graph(&[(FaceType::Plane, 0.0)], 0)).relative_areas, [0.0]);
        assert_eq!(signature(&graph(&[(FaceType::Plane, f64::NAN)], 0)).relative_areas, [0.0]);
    }
}
