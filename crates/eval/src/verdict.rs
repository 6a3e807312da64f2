//! Decides between two label sources while their backbones are still being trained, seed by seed.
//!
//! Scores of the seeds that are done go in, and a [`Look`] at them comes out. There are three looks. A difference that would be
//! more than chance in a single test may be chance if there are three looks, so the first looks have stricter limits. The limits
//! are those of O'Brien and Fleming (1979, "A multiple testing procedure for clinical trials") for an error of 5 % in total.

use crate::bootstrap::Bootstrap;
use crate::k_bin::KBin;
use crate::metric::Metric;
use crate::paired::{Difference, GroupOfSeeds, by_group_and_seed, paired_difference};
use crate::score_row::ScoreRow;
use partprobe_carrier::keyed_rng;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// The largest p-value at which each look decides.
pub const LOOK_LIMITS: [f64; 3] = [0.000_52, 0.014_11, 0.045_07];

/// The settings of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct VerdictSettings {
    /// The label source in question, and the one that it is compared with.
    pub compared: [String; 2],
    /// The label sources that clusters are scored against. The difference of a shape is its mean over them. If both sources are
    /// references, neither has a home advantage.
    pub references: Vec<String>,
    /// The clusterer.
    pub clusterer: String,
    /// The metric.
    pub metric: Metric,
    /// The standard deviation of a difference between two trainings that differ only in their seeds, from other trainings.
    pub seed_deviation: f64,
    /// How the interval is drawn.
    pub bootstrap: Bootstrap,
}

/// The result of the scores of the seeds so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The first source trains better backbones.
    Better,
    /// The first source trains worse backbones.
    Worse,
    /// The difference may be chance.
    CannotTell,
}

/// One look at the scores.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Look {
    /// The number of this look, counted from 1. It is also the number of seeds that are done.
    pub number: usize,
    /// The mean difference, the first source minus the second, with its interval.
    pub difference: Difference,
    /// The largest p-value at which this look decides.
    pub limit: f64,
    /// The verdict.
    pub verdict: Verdict,
    /// The number of shapes with 2 to 19 parts.
    pub n_shapes: usize,
    /// The number of groups of related shapes among them.
    pub n_groups: usize,
    /// The variance of the difference that more seeds cannot reduce, because it comes from the choice of the shapes.
    shape_variance: f64,
    /// The variance of the difference between seeds.
    seed_variance: f64,
}

/// The number of seeds or shapes that is needed to show the difference that a look has found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Needed {
    /// This number of seeds per source.
    Seeds(usize),
    /// No number of seeds is enough. This number of test shapes is needed, if they differ as much as these.
    Shapes(usize),
}

/// No verdict can be found.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VerdictError {
    /// No shape has scores of both sources.
    #[error("no shape has scores of both sources; the test shapes need 2 to 19 parts")]
    NoShapes,
    /// There are too few groups of related shapes.
    #[error(
        "the held-out shapes with 2 to 19 parts are from {found} files or repositories, and a verdict needs at least {needed}"
    )]
    FewGroups {
        /// The number of groups.
        found: usize,
        /// The smallest number that is enough.
        needed: usize,
    },
}

/// The smallest difference that is worth the training time.
const SMALLEST_OF_INTEREST: f64 = 0.01;

/// The number of standard errors that a difference must have at the last look.
const MIN_STANDARD_ERRORS: f64 = 2.004;

/// Looks at the scores of the seeds that are done. The number of the look is that of the seeds.
///
/// # Errors
/// If there are no shapes, or too few groups of related shapes for an interval.
pub fn look(rows: &[ScoreRow], settings: &VerdictSettings) -> Result<Look, VerdictError> {
    let values = Values::of(rows, settings);
    let groups = values.groups();
    let bootstrap = settings.bootstrap;
    let mut rng = keyed_rng(bootstrap.seed, &["verdict"]);
    let variance = settings.seed_deviation.powi(2);
    let difference = paired_difference(&groups, Some(variance), bootstrap, &mut rng)
        .ok_or(VerdictError::NoShapes)?;
    let (Some(p), Some(error)) = (difference.p, difference.standard_error) else {
        return Err(VerdictError::FewGroups {
            found: groups.len(),
            needed: bootstrap.least_groups,
        });
    };

    let number = difference.n_seeds;
    let limit = LOOK_LIMITS[number.clamp(1, LOOK_LIMITS.len()) - 1];
    let verdict = match p <= limit {
        true if difference.mean > 0.0 => Verdict::Better,
        true => Verdict::Worse,
        false => Verdict::CannotTell,
    };
    let observed = difference.seed_deviation.map_or(0.0, |sd| sd.powi(2));
    let seed_variance = variance.max(observed);
    let of_seeds = seed_variance / number.max(1) as f64;
    Ok(Look {
        number,
        difference,
        limit,
        verdict,
        n_shapes: values.n_shapes(),
        n_groups: groups.len(),
        shape_variance: (error.powi(2) - of_seeds).max(0.0),
        seed_variance,
    })
}

impl Look {
    /// Whether no further seed is needed, because this look has decided or is the last one.
    #[must_use]
    pub fn is_last(&self) -> bool {
        self.verdict != Verdict::CannotTell || self.number >= LOOK_LIMITS.len()
    }

    /// The number of seeds or shapes that is needed to show a difference as large as the one that was found, or of 0.01 if that
    /// is larger.
    #[must_use]
    pub fn needed(&self) -> Needed {
        let difference = self.difference.mean.abs().max(SMALLEST_OF_INTEREST);
        let allowed = (difference / MIN_STANDARD_ERRORS).powi(2);
        let left = allowed - self.shape_variance;
        if left > 0.0 {
            let n_seeds = (self.seed_variance / left).ceil() as usize;
            return Needed::Seeds(n_seeds.max(self.number + 1));
        }
        // The variance is inversely proportional to the number of shapes. Half of it is reserved for the seeds.
        let factor = self.shape_variance / (0.5 * allowed);
        Needed::Shapes((self.n_shapes as f64 * factor).ceil() as usize)
    }
}

/// The differences of each shape, by seed.
struct Values<'a> {
    of_shape: BTreeMap<&'a str, ShapeValues<'a>>,
    seeds: BTreeSet<u64>,
}

struct ShapeValues<'a> {
    group: &'a str,
    of_seed: BTreeMap<u64, f64>,
}

impl<'a> Values<'a> {
    fn of(rows: &'a [ScoreRow], settings: &VerdictSettings) -> Self {
        let mut scores: BTreeMap<(&str, u64), Scores<'a>> = BTreeMap::new();
        for row in rows
            .iter()
            .filter(|row| row.clusterer == settings.clusterer)
        {
            let scored = scores.entry((&row.shape, row.seed)).or_default();
            scored.add(row, settings);
        }
        let mut values = Self {
            of_shape: BTreeMap::new(),
            seeds: BTreeSet::new(),
        };
        for ((shape, seed), scored) in scores {
            if let Some(difference) = scored.difference(settings) {
                let of_shape = values.of_shape.entry(shape).or_insert(ShapeValues {
                    group: scored.group,
                    of_seed: BTreeMap::new(),
                });
                of_shape.of_seed.insert(seed, difference);
                values.seeds.insert(seed);
            }
        }
        values
    }

    fn n_shapes(&self) -> usize {
        self.of_shape.len()
    }

    fn groups(&'a self) -> Vec<GroupOfSeeds> {
        let of_shape = |shape: &'a ShapeValues<'a>| {
            let of_seed = |(position, seed)| {
                let difference = shape.of_seed.get(seed)?;
                Some((shape.group, position, *difference))
            };
            self.seeds.iter().enumerate().filter_map(of_seed)
        };
        by_group_and_seed(self.seeds.len(), self.of_shape.values().flat_map(of_shape))
    }
}

/// The scores of one shape and seed.
#[derive(Default)]
struct Scores<'a> {
    group: &'a str,
    /// By source and reference.
    of: BTreeMap<(usize, usize), f64>,
    is_in_mean: bool,
}

impl<'a> Scores<'a> {
    fn add(&mut self, row: &'a ScoreRow, settings: &VerdictSettings) {
        let position = |names: &[String], name: &str| names.iter().position(|known| known == name);
        let source = position(&settings.compared, &row.supervision);
        let reference = position(&settings.references, &row.reference);
        let (Some(source), Some(reference)) = (source, reference) else {
            return;
        };
        self.group = &row.group;
        // The first reference determines whether the shape has few enough parts.
        self.is_in_mean |= reference == 0 && KBin::of(row.k).is_in_mean();
        if let Some(value) = settings.metric.of(row) {
            self.of.insert((source, reference), value);
        }
    }

    /// The mean over all references, or `None` if a score is missing.
    fn difference(&self, settings: &VerdictSettings) -> Option<f64> {
        if !self.is_in_mean {
            return None;
        }
        let mut sum = 0.0;
        for reference in 0..settings.references.len() {
            sum += self.of.get(&(0, reference))? - self.of.get(&(1, reference))?;
        }
        Some(sum / settings.references.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::MIOU;
    use crate::tables::tests::row;
    use partprobe_carrier::unit_interval;

    fn settings(references: &[&str]) -> VerdictSettings {
        VerdictSettings {
            compared: ["mine".to_owned(), "step-parts".to_owned()],
            references: references.iter().map(|name| (*name).to_owned()).collect(),
            clusterer: "k-means".to_owned(),
            metric: MIOU,
            seed_deviation: 0.006,
            bootstrap: Bootstrap {
                draws: 4000,
                seed: 0,
                least_groups: 10,
            },
        }
    }

    /// Scores on `n_files` files: the first source is better by `better` at home and by `away` elsewhere.
    fn scores(n_files: usize, n_seeds: u64, [better, away]: [f64; 2]) -> Vec<ScoreRow> {
        let mut rng = keyed_rng(3, &["scores"]);
        let mut rows = Vec::new();
        for n in 0..n_files {
            let shape = format!("{n}__1");
            let hardness = 0.3 + 0.4 * unit_interval(&mut rng);
            for seed in 0..n_seeds {
                let mut scatter = || 0.04 * (unit_interval(&mut rng) - 0.5);
                for (reference, better) in [("mine", better), ("step-parts", away)] {
                    for (source, bonus) in [("mine", better), ("step-parts", 0.0)] {
                        rows.push(ScoreRow {
                            reference: reference.to_owned(),
                            ..row(&shape, source, seed, 7, hardness + bonus + scatter())
                        });
                    }
                }
            }
        }
        rows
    }

    #[test]
    fn a_large_difference_is_found_at_once_and_no_difference_never() {
        let both = settings(&["mine", "step-parts"]);
        for (differences, n_seeds, expected) in [
            ([0.2, 0.2], 1, Verdict::Better),
            ([-0.2, -0.2], 1, Verdict::Worse),
            ([0.0, 0.0], 3, Verdict::CannotTell),
            // Each source wins at home by the same amount, so there is no verdict.
            ([0.1, -0.1], 3, Verdict::CannotTell),
        ] {
            let found = look(&scores(40, n_seeds, differences), &both).unwrap();
            assert_eq!(found.verdict, expected, "{differences:?}: {found:?}");
            assert_eq!(found.number, n_seeds as usize);
            assert_eq!((found.n_shapes, found.n_groups), (40, 40));
        }
        let at_home = look(&scores(40, 3, [0.1, -0.1]), &settings(&["mine"])).unwrap();
        assert_eq!(at_home.verdict, Verdict::Better);
    }

    #[test]
    fn the_last_look_ends_the_trainings() {
        let both = settings(&["mine", "step-parts"]);
        for (n_seeds, expected) in [(1, false), (2, false), (3, true)] {
            let found = look(&scores(40, n_seeds, [0.0, 0.0]), &both).unwrap();
            assert_eq!(found.is_last(), expected);
        }
        assert!(look(&scores(40, 1, [0.2, 0.2]), &both).unwrap().is_last());
    }

    #[test]
    fn what_is_needed_is_seeds_or_shapes() {
        let found = look(
            &scores(40, 3, [0.0, 0.0]),
            &settings(&["mine", "step-parts"]),
        )
        .unwrap();
        let with = |shape_variance: f64, seed_variance: f64| {
            Look {
                shape_variance,
                seed_variance,
                ..found.clone()
            }
            .needed()
        };
        // 0.01 must be 2.004 standard errors: the variance may be 2.49e-5.
        assert_eq!(with(1e-5, 1e-4), Needed::Seeds(7));
        assert_eq!(with(1e-5, 1e-6), Needed::Seeds(4));
        assert_eq!(with(1e-4, 1e-6), Needed::Shapes(322));
    }

    #[test]
    fn too_few_files_are_refused() {
        let both = settings(&["mine", "step-parts"]);
        assert_eq!(
            look(&scores(9, 3, [0.0, 0.0]), &both),
            Err(VerdictError::FewGroups {
                found: 9,
                needed: 10
            })
        );
        assert_eq!(look(&[], &both), Err(VerdictError::NoShapes));
    }
}
