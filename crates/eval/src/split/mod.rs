//! Splits shapes into those that train, those that choose a checkpoint, and those that are held out.
//!
//! Equal shapes count once. The shapes of one collection, which is a file or a repository, are on one side. Collections are held
//! out at random in such a way that each bin of the number of parts K gets its fraction. Then all shapes that are nearly equal to
//! a held-out shape are removed from the other sides. They are removed and not grouped: groups of groups of similar shapes would
//! grow until one of them contained nearly all shapes.

mod collections;
mod duplicates;
mod manifest;
mod near;
mod sides;
#[cfg(test)]
mod tests;
mod train_share;

pub use duplicates::{DistinctShapes, Duplicate};
pub use manifest::{Manifest, ManifestError, ManifestLine, ShapeKey, SideName};
pub use near::NearShape;
pub use train_share::TrainShare;

use collections::collections;
use duplicates::without_duplicates;
use near::remove_near;
use partprobe_carrier::{Descriptor, Signature, keyed_rng};
use rand::Rng as _;
use serde::{Deserialize, Serialize};
use sides::{TEST, TRAIN, VALID, place_collections};
use std::collections::BTreeMap;

/// A shape that a split puts on one side.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitCandidate {
    /// The id of the shape. No two candidates have the same id.
    pub id: String,
    /// The file or the repository from which the shape came.
    pub collection: String,
    /// The number K of its parts, by the first reference.
    pub n_parts: usize,
    /// The signature of the shape, by which equal shapes are found.
    pub signature: Signature,
    /// How its surface fills space, by which nearly equal shapes are found. It is `None` if the shape has no extent.
    pub descriptor: Option<Descriptor>,
}

/// How shapes are split.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplitRule {
    /// The fractions of the shapes that each side should get.
    pub fractions: SplitFractions,
    /// A shape is removed from training if it differs from a held-out shape by at most this value. A value of 0 removes none.
    pub near_difference: f64,
    /// The fraction of the training shapes that are trained on.
    pub train_share: TrainShare,
    /// The seed of the random choice of held-out collections.
    pub seed: u64,
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

impl SplitFractions {
    /// The fractions of train, valid and test, divided by their sum.
    ///
    /// # Errors
    /// If one is negative or not a number, or none is positive.
    pub fn normalized(&self) -> Result<[f64; 3], SplitError> {
        let Self { train, valid, test } = *self;
        let fractions = [train, valid, test];
        let total: f64 = fractions.iter().sum();
        let is_negative = fractions.iter().any(|&fraction| fraction < 0.0);
        if is_negative || !(total > 0.0 && total.is_finite()) {
            return Err(SplitError::Fractions { train, valid, test });
        }
        Ok(fractions.map(|fraction| fraction / total))
    }
}

/// The three sides, each sorted by id.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Split {
    /// Shapes that backbones are trained on.
    pub train: Vec<String>,
    /// Shapes that choose a checkpoint.
    pub valid: Vec<String>,
    /// Shapes that are scored.
    pub test: Vec<String>,
    /// Shapes that are on no side, because an equal one is.
    pub duplicates: Vec<Duplicate>,
    /// Shapes that are on no side, because they are nearly equal to a test shape, or to a validation shape.
    pub near: Vec<NearShape>,
    /// Training shapes that are on no side, because only a fraction of them is trained on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub spared: Vec<String>,
    /// For each test shape, the training shape that is most like it.
    pub nearest_training: Vec<NearShape>,
    /// The collection of each shape on a side, named by its first id.
    pub groups: BTreeMap<String, String>,
}

impl Split {
    /// Returns the group of related shapes that a shape belongs to, or `None` for a shape that is on no side.
    #[must_use]
    pub fn group_of(&self, id: &str) -> Option<&str> {
        self.groups.get(id).map(String::as_str)
    }
}

/// The rule cannot split anything.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SplitError {
    /// The fractions are negative, not finite, or all 0.
    #[error(
        "{train}, {valid} and {test} are not the fractions of a split; they must not be negative, and one must be positive"
    )]
    Fractions {
        /// Fraction of the training shapes.
        train: f64,
        /// Fraction of the shapes that choose a checkpoint.
        valid: f64,
        /// Fraction of the held-out shapes.
        test: f64,
    },
    /// The difference up to which shapes are nearly equal is negative or not finite.
    #[error("split.near_difference is {0}; it must be 0 or positive")]
    NearDifference(f64),
    /// The fraction of the training shapes that are trained on is not positive, or above 1.
    #[error("split.train_share is {0}; it must be above 0 and at most 1")]
    TrainShare(f64),
}

/// Splits the shapes. The order in which they are given does not matter.
///
/// A held-out side takes small collections first, in random order, and larger ones by their size if they bring the K bins nearer to
/// their fractions. So it gets many collections, on which intervals depend. A side
/// with a positive fraction does not stay empty if there are enough collections, unless all of its shapes are nearly equal to
/// a held-out one.
///
/// # Errors
/// If a fraction or the difference is negative or not a number, no fraction is positive, or the share of the training shapes is
/// not one.
pub fn split(shapes: &[SplitCandidate], rule: &SplitRule) -> Result<Split, SplitError> {
    let fractions = rule.fractions.normalized()?;
    if !(rule.near_difference >= 0.0 && rule.near_difference.is_finite()) {
        return Err(SplitError::NearDifference(rule.near_difference));
    }
    let mut sorted: Vec<&SplitCandidate> = shapes.iter().collect();
    sorted.sort_by(|a, b| a.id.cmp(&b.id));
    let (kept, duplicates) = without_duplicates(&sorted);

    let mut sides: [Vec<&SplitCandidate>; 3] = Default::default();
    for (side, collection) in place_collections(collections(&kept), fractions, rule.seed) {
        sides[side].extend(collection.shapes);
    }
    for side in &mut sides {
        side.sort_by(|a, b| a.id.cmp(&b.id));
    }
    let near = decontaminate(&mut sides, rule.near_difference);
    let spared = rule.train_share.spare(&mut sides[TRAIN])?;
    Ok(Split {
        duplicates,
        near,
        spared,
        ..named(&sides)
    })
}

/// The split of a manifest. Shapes that it does not name are on no side.
///
/// # Errors
/// If the share of the training shapes is not one.
pub fn split_by_manifest(
    shapes: &[(ShapeKey, SplitCandidate)],
    manifest: &Manifest,
    train_share: TrainShare,
) -> Result<Split, SplitError> {
    let mut sorted: Vec<(&ShapeKey, &SplitCandidate)> =
        shapes.iter().map(|(key, shape)| (key, shape)).collect();
    sorted.sort_by(|a, b| a.1.id.cmp(&b.1.id));
    let named_shapes: Vec<_> = sorted
        .into_iter()
        .filter_map(|(key, shape)| Some((manifest.side_of(key)?, shape)))
        .collect();
    let candidates: Vec<&SplitCandidate> = named_shapes.iter().map(|&(_, shape)| shape).collect();
    let (kept, duplicates) = without_duplicates(&candidates);

    // The kept shapes are in the order of all shapes.
    let mut kept = kept.into_iter().peekable();
    let mut sides: [Vec<&SplitCandidate>; 3] = Default::default();
    for (side, shape) in named_shapes {
        if kept.next_if(|next| next.id == shape.id).is_some() {
            sides[side.index()].push(shape);
        }
    }
    let spared = train_share.spare(&mut sides[TRAIN])?;
    Ok(Split {
        duplicates,
        spared,
        ..named(&sides)
    })
}

/// Removes validation shapes that are nearly equal to a test shape, then training shapes that are nearly equal to either.
fn decontaminate(sides: &mut [Vec<&SplitCandidate>; 3], limit: f64) -> Vec<NearShape> {
    if limit == 0.0 {
        return Vec::new();
    }
    let [train, valid, test] = sides;
    let mut near = remove_near(valid, test, limit);
    let held_out: Vec<&SplitCandidate> = test.iter().chain(valid.iter()).copied().collect();
    near.extend(remove_near(train, &held_out, limit));
    near.sort_by(|a, b| a.id.cmp(&b.id));
    near
}

/// The sides by ids.
fn named(sides: &[Vec<&SplitCandidate>; 3]) -> Split {
    let ids = |side: usize| sides[side].iter().map(|shape| shape.id.clone()).collect();
    let on_a_side: Vec<&SplitCandidate> = sides.iter().flatten().copied().collect();
    let mut groups = BTreeMap::new();
    for collection in collections(&on_a_side) {
        let first = collection.shapes.iter().map(|shape| &shape.id).min();
        for shape in &collection.shapes {
            groups.insert(shape.id.clone(), first.unwrap_or(&shape.id).clone());
        }
    }
    let nearest_training = sides[TEST]
        .iter()
        .filter_map(|shape| NearShape::nearest(shape, &sides[TRAIN]));
    Split {
        train: ids(TRAIN),
        valid: ids(VALID),
        test: ids(TEST),
        nearest_training: nearest_training.collect(),
        groups,
        ..Split::default()
    }
}

/// The rank of a shape in a random order that depends only on the seed and the id, and not on the other shapes.
#[must_use]
pub fn seeded_rank(seed: u64, id: &str) -> u64 {
    keyed_rng(seed, &["select", id]).next_u64()
}
