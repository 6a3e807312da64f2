//! Which shapes train, which choose and which are held out.
//!
//! Near-duplicates count once, and related shapes (equal types and edge count, same file, same product)
//! stay on one side, so that no held-out shape has a twin among those that were learned.

use partprobe_carrier::{Family, Partition, Signature, keyed_rng};
use rand::Rng as _;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A shape that asks for its place.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitCandidate {
    /// The shape's id; no two candidates share one.
    pub id: String,
    /// The file that the shape came from.
    pub source_file: String,
    /// The product that the shape is, where the file names one.
    pub product: Option<String>,
    /// The shape's outline.
    pub signature: Signature,
}

/// How many shapes each side should get, as shares of any unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplitFractions {
    /// Share of the training shapes.
    pub train: f64,
    /// Share of the shapes that choose a checkpoint.
    pub valid: f64,
    /// Share of the held-out shapes.
    pub test: f64,
}

/// A shape that is left out because an equal one stays.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Duplicate {
    /// The shape that is left out.
    pub id: String,
    /// The shape that stays.
    pub of: String,
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
    /// The group of related shapes that a shape belongs to; none for a shape that is on no side.
    #[must_use]
    pub fn group_of(&self, id: &str) -> Option<&str> {
        self.groups.get(id).map(String::as_str)
    }
}

/// The fractions cannot divide anything.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "{train}, {valid} and {test} are no shares of a split; they must not be negative, and one must be positive"
)]
pub struct SplitError {
    /// Share of the training shapes.
    pub train: f64,
    /// Share of the shapes that choose a checkpoint.
    pub valid: f64,
    /// Share of the held-out shapes.
    pub test: f64,
}

/// Splits the shapes; the order in which they are given does not matter.
///
/// Groups come in an order that `seed` decides (groups that are larger than half the smallest side come first), and
/// each goes to the side that lacks most. No side with a positive share stays empty if there are groups enough.
///
/// # Errors
/// If a share is negative or no number, or none is positive.
pub fn split(
    shapes: &[SplitCandidate],
    fractions: &SplitFractions,
    seed: u64,
) -> Result<Split, SplitError> {
    let SplitFractions { train, valid, test } = *fractions;
    let shares = [train, valid, test];
    let total: f64 = shares.iter().sum();
    if shares.iter().any(|&share| share < 0.0) || !(total > 0.0 && total.is_finite()) {
        return Err(SplitError { train, valid, test });
    }
    let mut sorted: Vec<&SplitCandidate> = shapes.iter().collect();
    sorted.sort_by(|a, b| a.id.cmp(&b.id));
    let (kept, duplicates) = without_duplicates(&sorted);
    let groups = related_groups(&kept);
    let targets = shares.map(|share| share / total * kept.len() as f64);
    let mut found = Split {
        duplicates,
        ..Split::default()
    };
    for (side, group) in place_groups(groups, targets, seed) {
        let ids = [&mut found.train, &mut found.valid, &mut found.test];
        ids.into_iter()
            .nth(side)
            .into_iter()
            .for_each(|ids| ids.extend(group.iter().map(|shape| shape.id.clone())));
        found.groups.extend(
            group
                .iter()
                .map(|shape| (shape.id.clone(), group[0].id.clone())),
        );
    }
    for ids in [&mut found.train, &mut found.valid, &mut found.test] {
        ids.sort();
    }
    Ok(found)
}

/// The first of each set of equal shapes, and the others.
fn without_duplicates<'a>(
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

/// Tells shapes that are new from those that equal an earlier one.
#[derive(Clone, Debug, Default)]
pub struct DistinctShapes {
    of_family: BTreeMap<Family, Vec<(String, Signature)>>,
}

impl DistinctShapes {
    /// Adds a shape; if it equals one that was added before, says which, and does not add it.
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

/// The shape's place in a random order that depends on the seed and the id alone, not on which other shapes there are.
#[must_use]
pub fn seeded_rank(seed: u64, id: &str) -> u64 {
    keyed_rng(seed, &["select", id]).next_u64()
}

/// The groups that family, file or product tie together, in the order of their first ids.
fn related_groups<'a>(kept: &[&'a SplitCandidate]) -> Vec<Vec<&'a SplitCandidate>> {
    let mut first_with = [BTreeMap::new(), BTreeMap::new(), BTreeMap::new()];
    let mut ties = Vec::new();
    for (place, shape) in (0u32..).zip(kept) {
        let family = Some(format!("{:?}", shape.signature.family()));
        let keys = [
            family,
            Some(shape.source_file.clone()),
            shape.product.clone(),
        ];
        for (first_with, key) in first_with.iter_mut().zip(keys) {
            ties.extend(key.map(|key| [*first_with.entry(key).or_insert(place), place]));
        }
    }
    let partition = Partition::from_joined_pairs(kept.len(), ties);
    let mut groups = vec![Vec::new(); partition.n_parts() as usize];
    for (shape, &group) in kept.iter().zip(partition.parts()) {
        groups[group as usize].push(*shape);
    }
    groups
}

/// The side of each group: 0 train, 1 valid, 2 test.
fn place_groups(
    mut groups: Vec<Vec<&SplitCandidate>>,
    targets: [f64; 3],
    seed: u64,
) -> Vec<(usize, Vec<&SplitCandidate>)> {
    shuffle(&mut groups, seed);
    // A large group that came late would have to overfill a side.
    let smallest = targets
        .into_iter()
        .filter(|&target| target > 0.0)
        .fold(f64::INFINITY, f64::min);
    let is_large = |group: &Vec<&SplitCandidate>| 2.0 * group.len() as f64 > smallest.max(2.0);
    groups.sort_by_key(|group| std::cmp::Reverse(if is_large(group) { group.len() } else { 0 }));
    let mut lacking = targets;
    let mut is_empty = targets.map(|target| target > 0.0);
    let n_groups = groups.len();
    let mut placed = Vec::with_capacity(n_groups);
    for (place, group) in groups.into_iter().enumerate() {
        let n_empty = is_empty.iter().filter(|&&empty| empty).count();
        let must_fill = n_groups - place <= n_empty;
        let may_take = |side: usize| targets[side] > 0.0 && (is_empty[side] || !must_fill);
        let lacks_more = |best: usize, side: usize| {
            if lacking[best] < lacking[side] {
                side
            } else {
                best
            }
        };
        let Some(side) = (0..3).filter(|&side| may_take(side)).reduce(lacks_more) else {
            break;
        };
        lacking[side] -= group.len() as f64;
        is_empty[side] = false;
        placed.push((side, group));
    }
    placed
}

/// Puts the groups in a random order that depends on the seed alone (Fisher and Yates).
fn shuffle<T>(groups: &mut [T], seed: u64) {
    let mut rng = keyed_rng(seed, &["split"]);
    for last in (1..groups.len()).rev() {
        let other = (u128::from(rng.next_u64()) * (last as u128 + 1)) >> 64;
        groups.swap(last, other as usize);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FRACTIONS: SplitFractions = SplitFractions {
        train: 0.7,
        valid: 0.1,
        test: 0.2,
    };

    /// A shape in a family of its own number, with a large face of this share.
    fn candidate(
        id: &str,
        file: &str,
        product: Option<&str>,
        family: usize,
        share: f64,
    ) -> SplitCandidate {
        let signature = Signature {
            type_histogram: [0; 11],
            n_edges: family,
            relative_areas: vec![share, 1.0 - share],
            form: None,
        };
        SplitCandidate {
            id: id.to_owned(),
            source_file: file.to_owned(),
            product: product.map(str::to_owned),
            signature,
        }
    }

    fn unrelated(n: usize) -> Vec<SplitCandidate> {
        (0..n)
            .map(|n| candidate(&format!("{n:04}"), &format!("f{n}"), None, n, 0.5))
            .collect()
    }

    #[test]
    fn unrelated_shapes_meet_the_fractions() {
        let found = split(&unrelated(1000), &FRACTIONS, 3).unwrap();
        assert_eq!(
            [found.train.len(), found.valid.len(), found.test.len()],
            [700, 100, 200]
        );
        assert_ne!(
            found.test,
            split(&unrelated(1000), &FRACTIONS, 4).unwrap().test
        );
    }

    #[test]
    fn no_side_stays_empty_and_a_share_of_0_gets_nothing() {
        let found = split(&unrelated(3), &FRACTIONS, 0).unwrap();
        assert_eq!(
            [found.train.len(), found.valid.len(), found.test.len()],
            [1, 1, 1]
        );
        let found = split(
            &unrelated(9),
            &SplitFractions {
                valid: 0.0,
                ..FRACTIONS
            },
            0,
        )
        .unwrap();
        assert_eq!(
            [found.train.len(), found.valid.len(), found.test.len()],
            [7, 0, 2]
        );
        assert_eq!(split(&[], &FRACTIONS, 0), Ok(Split::default()));
    }

    #[test]
    fn twins_count_once_and_relatives_stay_together() {
        let shapes = [
            candidate("b", "f1", None, 1, 0.6),
            candidate("a", "f2", None, 1, 0.6005),
            candidate("c", "f3", Some("bolt"), 1, 0.8),
            candidate("d", "f4", Some("bolt"), 2, 0.5),
            candidate("e", "f4", None, 3, 0.5),
            candidate("f", "f5", None, 4, 0.5),
        ];
        let found = split(&shapes, &FRACTIONS, 0).unwrap();
        assert_eq!(
            found.duplicates,
            [Duplicate {
                id: "b".to_owned(),
                of: "a".to_owned()
            }]
        );
        let groups: Vec<(&str, &str)> = found
            .groups
            .iter()
            .map(|(id, group)| (id.as_str(), group.as_str()))
            .collect();
        assert_eq!(
            groups,
            [("a", "a"), ("c", "a"), ("d", "a"), ("e", "a"), ("f", "f")]
        );
    }

    #[test]
    fn an_equal_shape_is_told_by_the_one_that_came_first() {
        let mut distinct = DistinctShapes::default();
        let mut add = |id: &str, family, share| {
            let shape = candidate(id, "f", None, family, share);
            distinct
                .add(id, &shape.signature)
                .map(|duplicate| duplicate.of)
        };
        assert_eq!(add("c", 1, 0.6), None);
        assert_eq!(add("a", 1, 0.6005), Some("c".to_owned()));
        // Not added, so that nothing is compared with it.
        assert_eq!(add("b", 1, 0.6015), None);
        assert_eq!(add("d", 2, 0.6), None);
    }

    #[test]
    fn a_rank_is_of_the_seed_and_the_id() {
        assert_eq!(seeded_rank(1, "a"), seeded_rank(1, "a"));
        assert_ne!(seeded_rank(1, "a"), seeded_rank(2, "a"));
        assert_ne!(seeded_rank(1, "a"), seeded_rank(1, "b"));
    }

    #[test]
    fn shares_that_divide_nothing_are_refused() {
        for train in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(split(&[], &SplitFractions { train, ..FRACTIONS }, 0).is_err());
        }
        let nothing = SplitFractions {
            train: 0.0,
            valid: 0.0,
            test: 0.0,
        };
        assert!(
            split(&[], &nothing, 0)
                .unwrap_err()
                .to_string()
                .contains("one must be positive")
        );
    }

    fn any_shapes() -> impl Strategy<Value = Vec<SplitCandidate>> {
        let shape = (
            0usize..30,
            0usize..40,
            proptest::option::of(0usize..40),
            2u32..8,
        );
        proptest::collection::vec(shape, 0..60).prop_map(|shapes| {
            let named = |(n, (family, file, product, share)): (
                usize,
                (usize, usize, Option<usize>, u32),
            )| {
                let product = product.map(|product| format!("p{product}"));
                candidate(
                    &format!("{n:03}"),
                    &format!("f{file}"),
                    product.as_deref(),
                    family,
                    f64::from(share) / 10.0,
                )
            };
            shapes.into_iter().enumerate().map(named).collect()
        })
    }

    proptest! {
        #[test]
        fn every_shape_has_one_place_and_no_tie_crosses(shapes in any_shapes(), seed in 0u64..5) {
            let found = split(&shapes, &FRACTIONS, seed).unwrap();
            let sides = [&found.train, &found.valid, &found.test];
            let mut all: Vec<&String> = sides.into_iter().flatten().chain(found.duplicates.iter().map(|twin| &twin.id)).collect();
            all.sort();
            prop_assert_eq!(all, shapes.iter().map(|shape| &shape.id).collect::<Vec<_>>());
            let side_of = |id: &String| sides.iter().position(|side| side.contains(id));
            for a in &shapes {
                for b in &shapes {
                    let related = a.signature.family() == b.signature.family()
                        || a.source_file == b.source_file
                        || (a.product.is_some() && a.product == b.product);
                    if let (true, Some(x), Some(y)) = (related, side_of(&a.id), side_of(&b.id)) {
                        prop_assert_eq!(x, y);
                        prop_assert_eq!(&found.groups[&a.id], &found.groups[&b.id]);
                    }
                }
            }
        }

        #[test]
        fn the_order_of_shapes_does_not_matter(shapes in any_shapes()) {
            let backward: Vec<SplitCandidate> = shapes.iter().rev().cloned().collect();
            prop_assert_eq!(split(&shapes, &FRACTIONS, 1), split(&backward, &FRACTIONS, 1));
        }
    }
}
