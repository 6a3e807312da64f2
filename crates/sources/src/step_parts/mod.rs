//! Computes the STEP-Parts rule: faces become parts by primitive type and dihedral angle, and small parts are absorbed.
//!
//! A face graph and a mesh go in. The part of each face comes out, before and after absorption (STEP-Parts, section 3).
//! [`StepParts`] is the rule with its two settings, [`rule`] groups the faces, and [`absorption`] removes small parts.
//! [`sources`] are the label sources that follow from the rule. Nothing here computes an angle or a triangle.

pub(crate) mod absorption;
pub(crate) mod rule;
pub(crate) mod sources;

use absorption::absorb_small_parts;
use partprobe_carrier::{
    Carrier, FaceGraph, LabelLayer, Mesh, Partition, STEP_PARTS, STEP_PARTS_RAW,
};
use rule::{partition_by_canonical_type_and_angle, partition_by_type_and_angle};

/// The STEP-Parts rule with its settings.
///
/// ```
/// use partprobe_carrier::{Edge, Face, FaceGraph, FaceType, Mesh};
/// use partprobe_sources::StepParts;
///
/// // Two planes that meet smoothly, and a cylinder at a right angle.
/// let types = [FaceType::Plane, FaceType::Plane, FaceType::Cylinder];
/// let graph = FaceGraph {
///     faces: types.map(|face_type| Face::new(1, face_type, 1.0)).into(),
///     edges: vec![
///         Edge { faces: [0, 1], phi: 0.5, length: 1.0 },
///         Edge { faces: [1, 2], phi: 90.0, length: 1.0 },
///     ],
/// };
/// let rule = StepParts { theta_deg: 8.0, tau_min: 0 };
/// assert_eq!(rule.parts(&Mesh::default(), &graph).parts(), [0, 0, 1]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepParts {
    /// θ: the largest angle between the normals of two faces of one part along their shared edge, in degrees.
    pub theta_deg: f64,
    /// τ_min: parts with fewer triangles than this on the refined carrier are absorbed by a neighbor. A value of 0 absorbs no
    /// part.
    pub tau_min: u32,
}

impl StepParts {
    /// The rule with the settings with which a carrier was labeled.
    #[must_use]
    pub fn of_carrier(carrier: &Carrier) -> Self {
        Self {
            theta_deg: carrier.meta().theta_deg,
            tau_min: carrier.meta().tau_min,
        }
    }

    /// The parts after small ones were absorbed. The mesh is only used to find which parts are small.
    #[must_use]
    pub fn parts(&self, mesh: &Mesh, graph: &FaceGraph) -> Partition {
        self.absorbed(
            mesh,
            graph,
            partition_by_type_and_angle(graph, self.theta_deg),
        )
    }

    /// The same with the types after recognition: a cylinder counts as a cylinder even if its file writes it as a B-spline.
    #[must_use]
    pub fn canonical_parts(&self, mesh: &Mesh, graph: &FaceGraph) -> Partition {
        let raw = partition_by_canonical_type_and_angle(graph, self.theta_deg);
        self.absorbed(mesh, graph, raw)
    }

    /// The two layers that every carrier has, by their names: the parts before and after small ones were absorbed.
    #[must_use]
    pub fn layers(&self, mesh: &Mesh, graph: &FaceGraph) -> [(&'static str, LabelLayer); 2] {
        let raw = partition_by_type_and_angle(graph, self.theta_deg);
        let raw_layer = LabelLayer::from(&raw);
        let parts = self.absorbed(mesh, graph, raw);
        [
            (STEP_PARTS_RAW, raw_layer),
            (STEP_PARTS, LabelLayer::from(&parts)),
        ]
    }

    fn absorbed(&self, mesh: &Mesh, graph: &FaceGraph, parts: Partition) -> Partition {
        match self.tau_min {
            0 => parts,
            tau_min => absorb_small_parts(mesh, graph, &parts, tau_min),
        }
    }
}
