//! Finds the shapes that equal an earlier one.

use super::SplitCandidate;
use partprobe_carrier::{Family, Signature};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A shape that is left out because an equal one is kept.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Duplicate {
    /// The shape that is left out.
    pub id: String,
    /// The shape that is kept.
    pub of: String,
}

impl Duplicate {
    /// The reason why the shape is left out, for messages.
    pub const REASON: &str = "the same shape as another";
}

/// Separates new shapes from those that equal an earlier one.
#[derive(Clone, Debug, Default)]
pub struct DistinctShapes {
    of_family: BTreeMap<Family, Vec<(String, Signature)>>,
}

impl DistinctShapes {
    /// Adds a shape. If it equals a shape that was added before, returns that one and does not add it.
    pub fn add(&mut self, id: &str, signature: &Signature) -> Option<Duplicate> {
        let family = self.of_family.entry(signature.family()).or_default();
        if let Some((twin, _)) = family
            .iter()
            .find(|(_, other)| signature.is_duplicate_of(other))
        {
            return Some(Duplicate {
                id: id.to_owned(),
                of: twin.clone(),
            });
        }
        family.push((id.to_owned(), signature.clone()));
        None
    }
}

/// The first of each set of equal shapes, and the others.
pub(super) fn without_duplicates<'a>(
    sorted: &[&'a SplitCandidate],
) -> (Vec<&'a SplitCandidate>, Vec<Duplicate>) {
    let mut distinct = DistinctShapes::default();
    let mut kept: Vec<&SplitCandidate> = Vec::new();
    let mut duplicates = Vec::new();
    for &shape in sorted {
        match distinct.add(&shape.id, &shape.signature) {
            Some(duplicate) => duplicates.push(duplicate),
            None => kept.push(shape),
        }
    }
    (kept, duplicates)
}
