//! Checks whether two sets of points belong to one shape in the same position.

use crate::import::JoinProblem;
use partprobe_carrier::{Point, bounding_box, distance};

/// Refuses positions that were moved, rotated or scaled relative to those of the carrier, because the nearest elements would be
/// wrong.
///
/// # Errors
/// If corners of the bounding boxes are farther apart than `max_offset`, in millimeters.
pub(crate) fn ensure_same_position(
    carrier: &[Point],
    positions: &[Point],
    max_offset: f64,
) -> Result<(), JoinProblem> {
    let boxes = bounding_box(carrier).zip(bounding_box(positions));
    let offset = boxes.map_or(f64::INFINITY, |(own, other)| {
        distance(own[0], other[0]).max(distance(own[1], other[1]))
    });
    if offset <= max_offset {
        return Ok(());
    }
    Err(JoinProblem::Refused(format!(
        "the bounding boxes of the shape and of its labels are {offset:.3} mm apart, so the labels were moved, rotated or \
         scaled; give them in the position of the STEP file, in millimeters"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moved_or_scaled_shape_is_refused() {
        let own = [[0.0; 3], [4.0, 3.0, 0.0]];
        assert!(ensure_same_position(&own, &[[0.1, 0.0, 0.0], [3.9, 3.0, 0.0]], 0.2).is_ok());
        let scaled = ensure_same_position(&own, &[[0.0; 3], [40.0, 30.0, 0.0]], 0.2);
        let reason = scaled.unwrap_err().to_string();
        assert!(reason.contains("45.000 mm apart"), "{reason}");
        assert!(ensure_same_position(&own, &[], 0.2).is_err());
    }
}
