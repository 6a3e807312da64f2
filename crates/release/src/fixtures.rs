//! Labels of a small shape for tests.

use partprobe_carrier::FaceType;
use partprobe_tables::ShapeLabels;

/// Two planes that meet at a right angle.
pub(crate) fn two_faces() -> ShapeLabels {
    ShapeLabels {
        step_id: vec![10, 20],
        instance: vec![0, 0],
        face_type: vec![FaceType::Plane; 2],
        canonical_type: vec![FaceType::Plane; 2],
        part: vec![0, 1],
        label: vec![0, 1],
        layers: [("smooth-12".to_owned(), vec![0, 0])].into(),
        edge_faces: vec![[0, 1]],
        phi_deg: vec![Some(90.0)],
    }
}
