//! Labels triangles by rules that use only the faces. Each triangle takes the label of its face.
//!
//! The face graph of a carrier goes in, and one label per face comes out. The mesh has no influence.

use crate::factory::SourceFactory;
use crate::source::SourceLabels;
use crate::step_parts::rule::ANGLE_TIE_DEG;
use partprobe_carrier::{Partition, ShapeKind};

/// Each face is a label.
pub(crate) const BREP_FACE: SourceFactory =
    SourceFactory::rule("brep-face", "every face of the B-Rep", |carrier, _| {
        let labels: Vec<i32> = (0..).take(carrier.graph().faces.len()).collect();
        Ok(SourceLabels::on_faces(carrier.mesh(), &labels))
    })
    .labeling_faces()
    .needing(ShapeKind::Brep);

/// Each primitive type is a label, and the positions of its faces do not matter.
pub(crate) const PRIMITIVE: SourceFactory = SourceFactory::rule(
    "primitive",
    "the primitive type of the face: plane, cylinder, cone, …",
    |carrier, _| {
        let faces = carrier.graph().faces.iter();
        let labels: Vec<i32> = faces.map(|face| i32::from(face.face_type.code())).collect();
        Ok(SourceLabels::on_faces(carrier.mesh(), &labels))
    },
)
.labeling_faces()
.needing(ShapeKind::Brep);

/// Connected faces of one primitive type are a label, with any dihedral angle between them.
pub(crate) const PRIMITIVE_CONNECTED: SourceFactory = SourceFactory::rule(
    "primitive-connected",
    "connected faces of one primitive type, at any angle",
    |carrier, _| {
        let graph = carrier.graph();
        let pairs = graph.same_type_pairs().map(|pair| pair.faces);
        let parts = Partition::from_joined_pairs(graph.faces.len(), pairs);
        Ok(SourceLabels::on_partition(carrier.mesh(), &parts))
    },
)
.labeling_faces()
.needing(ShapeKind::Brep);

/// Connected faces are a label if the dihedral angle at each shared edge is at most DEG degrees. The types do not matter.
///
/// The difference to `step-parts` at the same angle shows the effect of the condition on types.
pub(crate) const SMOOTH: SourceFactory = SourceFactory::numbered_rule(
    "smooth-<DEG>",
    "faces joined across edges with a dihedral angle of at most DEG degrees; their types do not matter",
    0..=180,
    |carrier, degrees, _| {
        let graph = carrier.graph();
        // An undefined angle is NaN, and joins nothing.
        let smooth = graph
            .edges
            .iter()
            .filter(|edge| edge.phi <= f64::from(degrees) + ANGLE_TIE_DEG);
        let parts = Partition::from_joined_pairs(graph.faces.len(), smooth.map(|edge| edge.faces));
        Ok(SourceLabels::on_partition(carrier.mesh(), &parts))
    },
)
.labeling_faces()
.needing(ShapeKind::Brep);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::factory::SourceContext;
    use crate::registry::tests::carrier_of;
    use crate::step_parts;
    use partprobe_carrier::FaceType::{Cylinder, Plane};
    use partprobe_carrier::Mesh;

    /// Faces 0 and 1 are tangent planes, 2 a plane at a right angle to 1, 3 a cylinder, 4 a plane on its own.
    #[track_caller]
    fn check(factory: &SourceFactory, expected: &[i32]) {
        check_named(factory.pattern(), factory, expected);
    }

    #[track_caller]
    fn check_named(name: &str, factory: &SourceFactory, expected: &[i32]) {
        let mesh = Mesh {
            vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            vertex_face: vec![0; 3],
            triangles: vec![[0, 1, 2]; 6],
            tri_face: vec![0, 1, 2, 3, 4, 3],
            vertex_normal: Vec::new(),
        };
        let edges = [(0, 1, 0.0), (1, 2, 90.0), (2, 3, 0.0)];
        let carrier = carrier_of(mesh, &[Plane, Plane, Plane, Cylinder, Plane], &edges);
        let source = factory
            .make(name, &SourceContext::default())
            .unwrap()
            .unwrap();
        assert_eq!(
            source
                .labels(&carrier, 0)
                .unwrap()
                .of_triangles()
                .of_triangle(),
            expected
        );
    }

    #[test]
    fn smooth_depends_only_on_the_angle() {
        check_named("smooth-0", &SMOOTH, &[0, 0, 1, 1, 2, 1]);
        check_named("smooth-89", &SMOOTH, &[0, 0, 1, 1, 2, 1]);
        check_named("smooth-90", &SMOOTH, &[0, 0, 0, 0, 1, 0]);
    }

    #[test]
    fn each_rule_groups_faces_in_its_own_way() {
        check(&step_parts::sources::STEP_PARTS, &[0, 0, 1, 2, 3, 2]);
        check(&step_parts::sources::STEP_PARTS_RAW, &[0, 0, 1, 2, 3, 2]);
        check(&step_parts::sources::CANONICAL, &[0, 0, 1, 2, 3, 2]);
        check(&BREP_FACE, &[0, 1, 2, 3, 4, 3]);
        check(&PRIMITIVE, &[0, 0, 0, 1, 0, 1]);
        check(&PRIMITIVE_CONNECTED, &[0, 0, 0, 1, 2, 1]);
    }
}
