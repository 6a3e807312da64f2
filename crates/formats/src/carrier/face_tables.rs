//! Writes the faces and edges of a carrier as tables of text, in the order of the file. Networks on B-Reps read such tables.

use partprobe_carrier::Carrier;
use std::fmt::Write;

/// CSV with the columns `face,step_id,type,part,area`, one line per face.
#[must_use]
pub fn faces_to_csv(carrier: &Carrier, part_of_face: &[i32]) -> String {
    let mut text = "face,step_id,type,part,area\n".to_owned();
    for (face, (row, part)) in carrier.graph().faces.iter().zip(part_of_face).enumerate() {
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{face},{},{},{part},{}",
            row.step_id, row.face_type, row.area
        );
    }
    text
}

/// CSV with the columns `face_a,face_b,step_id_a,step_id_b,phi,length`, one line per shared edge.
///
/// An undefined angle is empty.
#[must_use]
pub fn edges_to_csv(carrier: &Carrier) -> String {
    let faces = &carrier.graph().faces;
    let mut text = "face_a,face_b,step_id_a,step_id_b,phi,length\n".to_owned();
    for edge in &carrier.graph().edges {
        let [a, b] = edge.faces;
        let [id_a, id_b] = edge.faces.map(|face| faces[face as usize].step_id);
        let phi = if edge.phi.is_finite() {
            edge.phi.to_string()
        } else {
            String::new()
        };
        let _ = writeln!(text, "{a},{b},{id_a},{id_b},{phi},{}", edge.length);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::three_squares;

    #[test]
    fn rows_are_in_the_order_of_the_file() {
        let carrier = three_squares();
        let faces = faces_to_csv(&carrier, carrier.part_of_face());
        assert_eq!(faces.lines().last(), Some("2,102,cylinder,1,1"));
        let edges = edges_to_csv(&carrier);
        assert_eq!(
            edges.lines().skip(1).collect::<Vec<_>>(),
            ["0,1,100,101,2,1", "1,2,101,102,,1"]
        );
    }
}
