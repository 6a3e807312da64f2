//! Splits shapes into those that train, those that choose a checkpoint, and those that are held out.
//!
//! Equal shapes count once. Related shapes (equal types and edge count, same file, same product) stay on one side, so
//! that no held-out shape has a near-duplicate among the training shapes.

mod duplicates;
mod groups;
mod sides;
#[cfg(test)]
mod tests;

pub use duplicates::{DistinctShapes, Duplicate};

use duplicates::without_duplicates;
use groups::related_groups;
use partprobe_carrier::{Signature, keyed_rng};
use rand::Rng as _;
use serde::{Deserialize, Serialize};
use sides::{Side, place_groups};
use std::collections::BTreeMap;

/// A shape that a split puts on one side.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitCandidate {
    /// The id of the shape; no two candidates have the same id.
    pub id: String,
    /// The file that the shape came from.
    pub source_file: String,
    /// The product that the shape belongs to, if the file names one.
    pub product: Option<String>,
    /// The signature of the shape, by which equal shapes are found.
    pub signature: Signature,
}

/// The fractions of the shapes that each side should get. Only their ratios count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplitFractions {
    /// Fraction of the training shapes.
    pub train: f64,
    /// Fraction of the shapes that choose a checkpoint.
    pub valid: f64,
    /// Fraction of the held-out shapes.
    pub test: f64,
}

/// The three sides, each sorted by id.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Split {
    /// Shapes that backbones are trained on.
    pub train: Vec<String>,
    /// Shapes that choose a checkpoint.
    pub valid: Vec<String>,
    /// Shapes that are scored.
    pub test: Vec<String>,
    /// Shapes that are on no side, because an equal one is.
    pub duplicates: Vec<Duplicate>,
    /// The group of related shapes that each shape on a side belongs to, named by the group's first id.
    pub groups: BTreeMap<String, String>,
}

impl Split {
    /// Returns the group of related shapes that a shape belongs to, or `None` for a shape that is on no side.
    #[must_use]
    pub fn group_of(&self, id: &str) -> Option<&str> {
        self.groups.get(id).map(String::as_str)
    }

    fn side_mut(&mut self, side: Side) -> &mut Vec<String> {
        match side {
            0 => &mut self.train,
            1 => &mut self.valid,
            _ => &mut self.test,
        }
    }
}

/// The fractions are negative, not finite, or all 0.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "{train}, {valid} and {test} are not the fractions of a split; they must not be negative, and one must be positive"
)]
pub struct SplitError {
    /// Fraction of the training shapes.
    pub train: f64,
    /// Fraction of the shapes that choose a checkpoint.
    pub valid: f64,
    /// Fraction of the held-out shapes.
    pub test: f64,
}

/// Splits the shapes; the order in which they are given does not matter.
///
/// `seed` decides the order of the groups, except that groups larger than half the smallest side come first. Each group
/// goes to the side that lacks most shapes. A side with a positive fraction does not stay empty if there are enough
/// groups.
///
/// # Errors
/// If a fraction is negative or not a number, or none is positive.
pub fn split(
    shapes: &[SplitCandidate],
    fractions: &SplitFractions,
    seed: u64,
) -> Result<Split, SplitError> {
    let fractions = normalized(fractions)?;
    let mut sorted: Vec<&SplitCandidate> = shapes.iter().collect();
    sorted.sort_by(|a, b| a.id.cmp(&b.id));

    let (kept, duplicates) = without_duplicates(&sorted);
    let groups = related_groups(&kept);
    let targets = fractions.map(|fraction| fraction * kept.len() as f64);

    let mut found = Split {
        duplicates,
        ..Split::default()
    };
    for (side, group) in place_groups(groups, targets, seed) {
        for shape in &group {
            found.side_mut(side).push(shape.id.clone());
            found.groups.insert(shape.id.clone(), group[0].id.clone());
        }
    }
    for side in 0..3 {
        found.side_mut(side).sort();
    }
    Ok(found)
}

/// The fractions of train, valid and test, divided by their sum.
fn normalized(fractions: &SplitFractions) -> Result<[f64; 3], SplitError> {
    let SplitFractions { train, valid, test } = *fractions;
    let fractions = [train, valid, test];
    let total: f64 = fractions.iter().sum();
    let is_negative = fractions.iter().any(|&fraction| fraction < 0.0);
    if is_negative || !(total > 0.0 && total.is_finite()) {
        return Err(SplitError { train, valid, test });
    }
    Ok(fractions.map(|fraction| fraction / total))
}

/// The rank of a shape in a random order that depends on the seed and the id alone, not on which other shapes there are.
#[must_use]
pub fn seeded_rank(seed: u64, id: &str) -> u64 {
    keyed_rng(seed, &["select", id]).next_u64()
}
