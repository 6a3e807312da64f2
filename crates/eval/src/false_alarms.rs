//! Counts how often a verdict finds a difference although there is none, namely between trainings on the same label source.
//!
//! Scores of many trainings that differ only in their seeds go in. They are divided into two arms, as if they belonged to two
//! sources. Each comparison of the arms that finds a difference is a false alarm (an A/A test). These trainings are real, so the
//! count includes all causes of differences between trainings.

use crate::score_row::ScoreRow;
use crate::verdict::{LOOK_LIMITS, Verdict, VerdictSettings, look};
use partprobe_carrier::keyed_rng;
use rand::Rng as _;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The number of verdicts between three random seeds and three others.
const N_VERDICTS: usize = 200;

/// A single comparison is an alarm if its p-value is below this.
const ERROR: f64 = 0.05;

/// The number of times that trainings on one label source seemed to differ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FalseAlarms {
    /// The label source.
    pub supervision: String,
    /// The number of trainings.
    pub n_seeds: usize,
    /// The number of pairs of single trainings. Each training is in one pair.
    pub n_pairs: usize,
    /// Pairs that differ with p below 0.05.
    pub n_false_pairs: usize,
    /// Verdicts with up to three seeds in each arm. Their trainings overlap, so they are not independent.
    pub n_verdicts: usize,
    /// Verdicts that found one of the arms better.
    pub n_false_verdicts: usize,
    /// The standard deviation of the difference between two trainings.
    pub seed_deviation: f64,
}

/// Counts the false alarms among the trainings of one label source. Returns `None` for fewer than six seeds, or if there are too few
/// groups of shapes for an interval.
///
/// Only scores against the first reference are used. The seed deviation is computed from these trainings, and that of the
/// settings is not used.
#[must_use]
pub fn false_alarms(
    rows: &[ScoreRow],
    supervision: &str,
    settings: &VerdictSettings,
) -> Option<FalseAlarms> {
    let reference = settings.references.first()?;
    let by_seed = scores_by_seed(rows, supervision, reference, &settings.clusterer);
    let seeds: Vec<u64> = by_seed.keys().copied().collect();
    if seeds.len() < 2 * LOOK_LIMITS.len() {
        return None;
    }
    let settings = VerdictSettings {
        compared: ["first".to_owned(), "second".to_owned()],
        references: vec![reference.clone()],
        seed_deviation: deviation_of_differences(&by_seed, settings),
        ..settings.clone()
    };
    let arms = Arms {
        by_seed: &by_seed,
        settings: &settings,
    };
    let mut n_false_pairs = 0;
    for pair in seeds.chunks_exact(2) {
        n_false_pairs += usize::from(arms.p(&pair[..1], &pair[1..])? < ERROR);
    }
    let mut n_false_verdicts = 0;
    for number in 0..N_VERDICTS {
        let drawn = shuffled(&seeds, number as u64);
        let n = LOOK_LIMITS.len();
        n_false_verdicts += usize::from(arms.finds_difference(&drawn[..n], &drawn[n..2 * n])?);
    }
    Some(FalseAlarms {
        supervision: supervision.to_owned(),
        n_seeds: seeds.len(),
        n_pairs: seeds.len() / 2,
        n_false_pairs,
        n_verdicts: N_VERDICTS,
        n_false_verdicts,
        seed_deviation: settings.seed_deviation,
    })
}

/// The rows of each training.
type BySeed<'a> = BTreeMap<u64, Vec<&'a ScoreRow>>;

fn scores_by_seed<'a>(
    rows: &'a [ScoreRow],
    supervision: &str,
    reference: &str,
    clusterer: &str,
) -> BySeed<'a> {
    let mut by_seed = BySeed::new();
    for row in rows {
        if row.supervision == supervision
            && row.reference == reference
            && row.clusterer == clusterer
        {
            by_seed.entry(row.seed).or_default().push(row);
        }
    }
    by_seed
}

/// √2 times the standard deviation of the mean score of a training.
fn deviation_of_differences(by_seed: &BySeed<'_>, settings: &VerdictSettings) -> f64 {
    let mean = |rows: &Vec<&ScoreRow>| {
        let values: Vec<f64> = rows
            .iter()
            .filter_map(|row| settings.metric.of(row))
            .collect();
        values.iter().sum::<f64>() / values.len().max(1) as f64
    };
    let means: Vec<f64> = by_seed.values().map(mean).collect();
    let n = means.len() as f64;
    let center = means.iter().sum::<f64>() / n;
    let squares: f64 = means.iter().map(|mean| (mean - center).powi(2)).sum();
    (2.0 * squares / (n - 1.0)).sqrt()
}

/// Compares trainings as if they belonged to two label sources.
struct Arms<'a> {
    by_seed: &'a BySeed<'a>,
    settings: &'a VerdictSettings,
}

impl Arms<'_> {
    /// The rows of both arms, with the seeds counted from 0 in each.
    fn rows(&self, first: &[u64], second: &[u64]) -> Vec<ScoreRow> {
        let mut rows = Vec::new();
        for (arm, seeds) in self.settings.compared.iter().zip([first, second]) {
            for (number, seed) in (0..).zip(seeds) {
                let of_seed = self.by_seed.get(seed).into_iter().flatten();
                rows.extend(of_seed.map(|row| ScoreRow {
                    supervision: arm.clone(),
                    seed: number,
                    ..(*row).clone()
                }));
            }
        }
        rows
    }

    fn p(&self, first: &[u64], second: &[u64]) -> Option<f64> {
        let found = look(&self.rows(first, second), self.settings).ok()?;
        found.difference.p
    }

    /// Whether one of the looks finds an arm better.
    fn finds_difference(&self, first: &[u64], second: &[u64]) -> Option<bool> {
        for n in 1..=first.len() {
            let found = look(&self.rows(&first[..n], &second[..n]), self.settings).ok()?;
            if found.verdict != Verdict::CannotTell {
                return Some(true);
            }
        }
        Some(false)
    }
}

/// The seeds in a random order that depends on the number of the draw.
fn shuffled(seeds: &[u64], number: u64) -> Vec<u64> {
    let mut rng = keyed_rng(number, &["false alarms"]);
    let keyed: BTreeSet<(u64, u64)> = seeds.iter().map(|&seed| (rng.next_u64(), seed)).collect();
    keyed.into_iter().map(|(_, seed)| seed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bootstrap::Bootstrap;
    use crate::metrics::MIOU;
    use crate::tables::tests::row;
    use partprobe_carrier::unit_interval;

    /// Trainings whose scores scatter around the difficulty of a shape. Every training also has its own deviation.
    fn trainings(n_seeds: u64, of_training: f64) -> Vec<ScoreRow> {
        let mut rng = keyed_rng(3, &["trainings"]);
        let mut rows = Vec::new();
        for seed in 0..n_seeds {
            let shift = of_training * (unit_interval(&mut rng) - 0.5);
            for n in 0..24 {
                let miou = 0.3 + 0.01 * f64::from(n) + shift + 0.05 * unit_interval(&mut rng);
                rows.push(row(&format!("{n}__1"), "step-parts", seed, 7, miou));
            }
        }
        rows
    }

    fn settings() -> VerdictSettings {
        VerdictSettings {
            compared: [String::new(), String::new()],
            references: vec!["step-parts".to_owned()],
            clusterer: "k-means".to_owned(),
            metric: MIOU,
            seed_deviation: 0.0,
            bootstrap: Bootstrap {
                draws: 400,
                seed: 0,
                least_groups: 10,
            },
        }
    }

    #[test]
    fn equal_trainings_give_few_alarms() {
        for of_training in [0.0, 0.05] {
            let found = false_alarms(&trainings(24, of_training), "step-parts", &settings());
            let found = found.unwrap();
            assert_eq!(
                (found.n_seeds, found.n_pairs, found.n_verdicts),
                (24, 12, 200)
            );
            assert!(found.n_false_pairs <= 3, "{found:?}");
            assert!(found.n_false_verdicts <= 30, "{found:?}");
        }
    }

    #[test]
    fn too_few_trainings_give_no_result() {
        let rows = trainings(5, 0.0);
        assert_eq!(false_alarms(&rows, "step-parts", &settings()), None);
        assert_eq!(false_alarms(&rows, "brep-face", &settings()), None);
    }
}
