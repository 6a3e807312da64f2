//! Finds the shapes that are nearly equal to another one.

use super::SplitCandidate;
use serde::{Deserialize, Serialize};

/// A shape, the other shape that is most like it, and how far they differ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NearShape {
    /// The shape.
    pub id: String,
    /// The shape that is most like it.
    pub of: String,
    /// The difference of the two, see [`Descriptor::difference`](partprobe_carrier::Descriptor::difference).
    pub difference: f64,
}

impl NearShape {
    /// The reason why a shape that is similar to a held-out one is left out, for messages.
    pub const REASON: &str = "nearly equal to a held-out shape";

    /// The candidate that is most like a shape. Returns `None` if the shape has no descriptor, or none of the candidates has one.
    #[must_use]
    pub fn nearest(shape: &SplitCandidate, others: &[&SplitCandidate]) -> Option<Self> {
        let descriptor = shape.descriptor.as_ref()?;
        let mut nearest: Option<(f64, &SplitCandidate)> = None;
        for &other in others {
            let Some(of_other) = &other.descriptor else {
                continue;
            };
            let difference = descriptor.difference(of_other);
            if nearest.is_none_or(|(least, _)| difference < least) {
                nearest = Some((difference, other));
            }
        }
        nearest.map(|(difference, of)| Self {
            id: shape.id.clone(),
            of: of.id.clone(),
            difference,
        })
    }
}

/// Removes the shapes that differ from one of `held_out` by at most `limit`, and returns them.
pub(super) fn remove_near(
    shapes: &mut Vec<&SplitCandidate>,
    held_out: &[&SplitCandidate],
    limit: f64,
) -> Vec<NearShape> {
    let mut removed = Vec::new();
    shapes.retain(|shape| match NearShape::nearest(shape, held_out) {
        Some(near) if near.difference <= limit => {
            removed.push(near);
            false
        }
        _ => true,
    });
    removed
}
