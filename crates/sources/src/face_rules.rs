//! Sources that follow from the faces alone.

use crate::source::{LabelSource, SourceError, SourceLabels};
use carrier::{Carrier, Labels, Partition, TauMin, absorb_small_parts};

/// A rule that labels faces; each triangle takes its face's label.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FaceRule {
    /// The carrier's STEP-Parts labels, after small parts were absorbed.
    StepParts,
    /// The same by the types after recognition, so that a primitive written as a B-spline counts as what it is.
    Canonical,
    /// Each face is a label.
    BrepFace,
    /// Each primitive type is a label, wherever its faces lie.
    Primitive,
    /// Connected faces of one primitive type are a label, whatever their dihedral angle.
    PrimitiveConnected,
}

impl FaceRule {
    pub(crate) const ALL: [Self; 5] =
        [Self::StepParts, Self::Canonical, Self::BrepFace, Self::Primitive, Self::PrimitiveConnected];

    /// One line that says what the labels are.
    pub(crate) fn description(self) -> &'static str {
        match self {
            Self::StepParts => "faces of one primitive type joined across near-tangent edges, small parts absorbed",
            Self::Canonical => "step-parts with primitives recognised that the file writes as splines or sweeps",
            Self::BrepFace => "every face of the B-Rep",
            Self::Primitive => "the primitive type of the face: plane, cylinder, cone, …",
            Self::PrimitiveConnected => "connected faces of one primitive type, at any angle",
        }
    }

    fn label_of_face(self, carrier: &Carrier) -> Vec<i32> {
        let graph = carrier.graph();
        match self {
            Self::StepParts => carrier.face_label().to_vec(),
            Self::Canonical => canonical_labels(carrier),
            Self::BrepFace => (0..).take(graph.faces.len()).collect(),
            Self::Primitive => graph.faces.iter().map(|face| i32::from(face.face_type.code())).collect(),
            Self::PrimitiveConnected => {
                let pairs = graph.same_type_pairs().map(|pair| pair.faces);
                let groups = Partition::from_joined_pairs(graph.faces.len(), pairs);
                groups.parts().iter().map(|&part| part as i32).collect()
            }
        }
    }
}

/// θ and τ_min are those that the carrier was labelled with.
fn canonical_labels(carrier: &Carrier) -> Vec<i32> {
    let (graph, meta) = (carrier.graph(), carrier.meta());
    let parts = Partition::by_canonical_type_and_angle(graph, meta.theta_deg);
    let labels = match meta.tau_min {
        0 => parts,
        tau_min => absorb_small_parts(carrier.mesh(), graph, &parts, TauMin(tau_min)),
    };
    labels.parts().iter().map(|&part| part as i32).collect()
}

impl LabelSource for FaceRule {
    fn name(&self) -> &str {
        match self {
            Self::StepParts => "step-parts",
            Self::Canonical => "canonical",
            Self::BrepFace => "brep-face",
            Self::Primitive => "primitive",
            Self::PrimitiveConnected => "primitive-connected",
        }
    }

    fn labels(&self, carrier: &Carrier, _seed: u64) -> Result<SourceLabels, SourceError> {
        let labels = Labels::from_faces(&carrier.mesh().tri_face, &self.label_of_face(carrier));
        Ok(SourceLabels::on_plain(labels))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::tests::carrier_of;
    use carrier::FaceType::{Cylinder, Plane};
    use carrier::Mesh;

    /// Faces 0 and 1 are tangent planes, 2 a plane at a right angle to 1, 3 a cylinder, 4 a plane on its own.
    #[track_caller]
    fn check(rule: FaceRule, expected: &[i32]) {
        let mesh = Mesh {
            vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            vertex_face: vec![0; 3],
            triangles: vec![[0, 1, 2]; 6],
            tri_face: vec![0, 1, 2, 3, 4, 3],
            vertex_normal: Vec::new(),
        };
        let edges = [(0, 1, 0.0), (1, 2, 90.0), (2, 3, 0.0)];
        let carrier = carrier_of(mesh, &[Plane, Plane, Plane, Cylinder, Plane], &edges);
        assert_eq!(rule.labels(&carrier, 0).unwrap().of_triangles().of_triangle(), expected);
    }

    #[test]
    fn each_rule_groups_faces_in_its_own_way() {
        check(FaceRule::StepParts, &[0, 0, 1, 2, 3, 2]);
        check(FaceRule::Canonical, &[0, 0, 1, 2, 3, 2]);
        check(FaceRule::BrepFace, &[0, 1, 2, 3, 4, 3]);
        check(FaceRule::Primitive, &[0, 0, 0, 1, 0, 1]);
        check(FaceRule::PrimitiveConnected, &[0, 0, 0, 1, 2, 1]);
    }
}
