//! Makes the tables of a run from the records of its fits.
//!
//! A shape counts if all of its fits have scores, so every row is about the same shapes. A row is a mean over shapes. The value
//! of a shape is the mean of its seeds.

use super::CONTROL;
use super::metrics::{ProbeMetric, named};
use super::record::{FitRecord, Outcome};
use super::settings::ImplicitConfig;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// The input of the tables.
pub(super) struct TableInput<'a> {
    pub(super) records: &'a [FitRecord],
    pub(super) arms: &'a [String],
    pub(super) seeds: &'a [u64],
    /// The source against which all arms are scored.
    pub(super) reference: &'a str,
    pub(super) settings: &'a ImplicitConfig,
    pub(super) shapes: &'a [String],
}

/// The tables in two forms.
pub(super) struct ProbeTables {
    pub(super) markdown: String,
    pub(super) json: Value,
}

/// Metrics of the surface, whose differences between arms are compared with those between seeds.
const SURFACE: [&str; 3] = ["cdl1", "f1", "nc"];

pub(super) fn tables(input: &TableInput<'_>) -> ProbeTables {
    let scores = ShapeScores::new(input);
    let mut blocks = vec![introduction(input, &scores)];
    blocks.extend(failures(input));
    if scores.shapes.is_empty() {
        blocks.push("No shape has scores for all labels and seeds.".to_owned());
    } else {
        let main = [
            "cdl1",
            "f1",
            "nc",
            "miou_own",
            "accuracy_own",
            "miou_step",
            "accuracy_step",
            "cons_knn",
            "cons_normal",
        ];
        blocks.push(means(input, &scores, &main));
        blocks.push(
            "From points to points, as published code computes it. The floor is what two samples of the reference itself score."
                .to_owned(),
        );
        blocks.push(point_table(input, &scores));
        blocks.push(
            "The labels at points of the reference, and the labels themselves, without a network."
                .to_owned(),
        );
        let at_reference = [
            "miou_own_reference",
            "accuracy_own_reference",
            "miou_step_reference",
            "accuracy_step_reference",
            "labels_miou_step",
            "labels_accuracy_step",
            "n_labels",
        ];
        blocks.push(means(input, &scores, &at_reference));
        blocks.push(
            "Differences of the surface: between two seeds of one row of the first table, and between two rows with one seed. Each is the mean \
             absolute difference over shapes. The last column is the difference with its sign and its standard error over shapes."
                .to_owned(),
        );
        blocks.push(differences(input, &scores));
    }
    ProbeTables {
        markdown: blocks.join("\n\n") + "\n",
        json: json!({
            "shapes": scores.shapes,
            "arms": input.arms,
            "seeds": input.seeds,
            "reference": input.reference,
            "records": input.records,
        }),
    }
}

fn introduction(input: &TableInput<'_>, scores: &ShapeScores<'_>) -> String {
    let settings = input.settings;
    format!(
        "{} of {} shapes, {} seeds, {} with {} iterations, mode {}, gradient of the segmentation loss: {}. Means and standard deviations over \
         shapes. `step` is the agreement with `{}` after the labels are matched.",
        scores.shapes.len(),
        input.shapes.len(),
        input.seeds.len(),
        settings.trunk,
        settings.iterations,
        word(&settings.mode),
        word(&settings.seg_grad),
        input.reference,
    )
}

/// The word of a setting in the config.
fn word(setting: &impl serde::Serialize) -> String {
    let value = serde_json::to_value(setting).ok();
    value
        .as_ref()
        .and_then(Value::as_str)
        .unwrap_or_default()
        .to_owned()
}

/// One line per shape that does not count, with its first reason.
fn failures(input: &TableInput<'_>) -> Option<String> {
    let mut reasons: BTreeMap<&str, &str> = BTreeMap::new();
    for record in input.records {
        if let Outcome::Failed { reason } = &record.outcome {
            reasons.entry(&record.shape).or_insert(reason);
        }
    }
    let lines: Vec<String> = reasons
        .iter()
        .map(|(shape, reason)| format!("- {shape}: {reason}"))
        .collect();
    (!lines.is_empty()).then(|| format!("Left out:\n\n{}", lines.join("\n")))
}

/// The scores of the shapes that count.
struct ShapeScores<'a> {
    shapes: Vec<&'a str>,
    records: BTreeMap<(&'a str, &'a str, u64), &'a FitRecord>,
    seeds: &'a [u64],
}

impl<'a> ShapeScores<'a> {
    fn new(input: &TableInput<'a>) -> Self {
        let failed: BTreeSet<&str> = input
            .records
            .iter()
            .filter(|record| matches!(record.outcome, Outcome::Failed { .. }))
            .map(|record| record.shape.as_str())
            .collect();
        let key = |record: &'a FitRecord| (record.shape.as_str(), record.arm.as_str(), record.seed);
        Self {
            shapes: input
                .shapes
                .iter()
                .map(String::as_str)
                .filter(|shape| !failed.contains(shape))
                .collect(),
            records: input
                .records
                .iter()
                .map(|record| (key(record), record))
                .collect(),
            seeds: input.seeds,
        }
    }

    fn score(&self, shape: &str, arm: &str, seed: u64, metric: &str) -> Option<f64> {
        self.records.get(&(shape, arm, seed))?.score(metric)
    }

    /// The mean over the seeds, per shape.
    fn of_shapes(&self, arm: &str, metric: &str) -> Vec<f64> {
        let of_shape = |shape: &&str| {
            let scores: Option<Vec<f64>> = self
                .seeds
                .iter()
                .map(|&seed| self.score(shape, arm, seed, metric))
                .collect();
            scores.map(|scores| mean(&scores))
        };
        self.shapes.iter().filter_map(of_shape).collect()
    }

    /// The absolute differences between all pairs of seeds, of all shapes and arms.
    fn between_seeds(&self, arms: &[String], metric: &str) -> Vec<f64> {
        let mut differences = Vec::new();
        for shape in &self.shapes {
            for arm in arms {
                for (idx, &first) in self.seeds.iter().enumerate() {
                    for &second in &self.seeds[idx + 1..] {
                        let pair = [first, second].map(|seed| self.score(shape, arm, seed, metric));
                        if let [Some(a), Some(b)] = pair {
                            differences.push((a - b).abs());
                        }
                    }
                }
            }
        }
        differences
    }

    /// The absolute differences between two arms with the same seed, of all shapes and seeds.
    fn between_arms(&self, arms: [&str; 2], metric: &str) -> Vec<f64> {
        let mut differences = Vec::new();
        for shape in &self.shapes {
            for &seed in self.seeds {
                if let [Some(a), Some(b)] = arms.map(|arm| self.score(shape, arm, seed, metric)) {
                    differences.push((a - b).abs());
                }
            }
        }
        differences
    }
}

fn means(input: &TableInput<'_>, scores: &ShapeScores<'_>, metrics: &[&str]) -> String {
    let metrics: Vec<&ProbeMetric> = metrics.iter().filter_map(|name| named(name)).collect();
    let rows = input.arms.iter().map(|arm| {
        let cells = metrics
            .iter()
            .map(|metric| cell(&scores.of_shapes(arm, metric.name), metric.scale));
        let n = scores.shapes.len().to_string();
        [format!("`{arm}`"), n]
            .into_iter()
            .chain(cells)
            .collect::<Vec<String>>()
    });
    let headings = ["supervision", "N"]
        .into_iter()
        .chain(metrics.iter().map(|metric| metric.heading));
    markdown(&headings.collect::<Vec<_>>(), rows)
}

fn point_table(input: &TableInput<'_>, scores: &ShapeScores<'_>) -> String {
    let row = |name: String, arm: &str, metrics: [&str; 3]| -> Vec<String> {
        let cells = metrics.iter().filter_map(|metric| named(metric));
        let cells = cells.map(|metric| cell(&scores.of_shapes(arm, metric.name), metric.scale));
        std::iter::once(name).chain(cells).collect()
    };
    let arms = input.arms.iter();
    let mut rows: Vec<Vec<String>> = arms
        .map(|arm| row(format!("`{arm}`"), arm, ["cdl1_pp", "f1_pp", "nc_pp"]))
        .collect();
    if let Some(first) = input.arms.first() {
        rows.push(row(
            "sampling floor".to_owned(),
            first,
            ["cdl1_floor", "f1_floor", "nc_floor"],
        ));
    }
    markdown(&["supervision", "CDL1_pp ×10²", "F1_pp", "NC_pp"], rows)
}

fn differences(input: &TableInput<'_>, scores: &ShapeScores<'_>) -> String {
    let mut rows = Vec::new();
    for metric in SURFACE.iter().filter_map(|name| named(name)) {
        let seeds = scores.between_seeds(input.arms, metric.name);
        let text = |values: &[f64]| match values {
            [] => "–".to_owned(),
            values => format!("{:.4}", metric.scale * mean(values)),
        };
        rows.push(vec![
            metric.heading.to_owned(),
            "two seeds".to_owned(),
            text(&seeds),
            String::new(),
        ]);
        for pair in pairs(input.arms) {
            let gap = scores.between_arms(pair, metric.name);
            let [a, b] = pair.map(|arm| scores.of_shapes(arm, metric.name));
            let signed: Vec<f64> = a
                .iter()
                .zip(&b)
                .map(|(a, b)| metric.scale * (a - b))
                .collect();
            let error = deviation(&signed) / (signed.len().max(1) as f64).sqrt();
            rows.push(vec![
                metric.heading.to_owned(),
                format!("`{}` − `{}`", pair[0], pair[1]),
                text(&gap),
                format!("{:+.4} ± {error:.4}", mean(&signed)),
            ]);
        }
    }
    markdown(
        &[
            "metric",
            "between",
            "mean absolute difference",
            "difference ± standard error",
        ],
        rows,
    )
}

/// The pairs of each source with the control, and of the first source with the others.
fn pairs(arms: &[String]) -> Vec<[&str; 2]> {
    let sources: Vec<&str> = arms
        .iter()
        .map(String::as_str)
        .filter(|arm| *arm != CONTROL)
        .collect();
    let has_control = sources.len() < arms.len();
    let with_control = sources
        .iter()
        .filter(|_| has_control)
        .map(|source| [*source, CONTROL]);
    let with_first = sources.iter().skip(1).map(|source| [sources[0], *source]);
    with_control.chain(with_first).collect()
}

fn cell(values: &[f64], scale: f64) -> String {
    if values.is_empty() {
        return "–".to_owned();
    }
    format!(
        "{:.3} ± {:.3}",
        scale * mean(values),
        scale * deviation(values)
    )
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The standard deviation of a sample. It is 0 for a single value.
fn deviation(values: &[f64]) -> f64 {
    let middle = mean(values);
    let squares: f64 = values.iter().map(|value| (value - middle).powi(2)).sum();
    (squares / values.len().saturating_sub(1).max(1) as f64).sqrt()
}

fn markdown(headings: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let line = |cells: &[String]| format!("| {} |", cells.join(" | "));
    let headings: Vec<String> = headings.iter().map(|&heading| heading.to_owned()).collect();
    let rule = format!("|{}", "---|".repeat(headings.len()));
    let rows: Vec<String> = rows.into_iter().map(|row| line(&row)).collect();
    [line(&headings), rule]
        .into_iter()
        .chain(rows)
        .collect::<Vec<_>>()
        .join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::load;

    fn record(shape: &str, arm: &str, seed: u64, cdl1: f64) -> FitRecord {
        let scores = BTreeMap::from([
            ("cdl1".to_owned(), cdl1),
            ("f1".to_owned(), 1.0),
            ("nc".to_owned(), 1.0),
        ]);
        FitRecord {
            shape: shape.to_owned(),
            arm: arm.to_owned(),
            seed,
            outcome: Outcome::Scores(scores),
        }
    }

    #[test]
    fn means_and_differences_are_those_of_the_records() {
        let config = load("implicit", &[]).unwrap().config;
        let settings = config.implicit.unwrap();
        let mut records = Vec::new();
        for (shape, base) in [("a", 0.01), ("b", 0.03)] {
            for (seed, by_seed) in [(0, 0.0), (1, 0.002)] {
                for (arm, by_arm) in [("step-parts", 0.0005), (CONTROL, 0.0)] {
                    records.push(record(shape, arm, seed, base + by_seed + by_arm));
                }
            }
        }
        records.push(FitRecord {
            outcome: Outcome::Failed {
                reason: "it is open".to_owned(),
            },
            ..record("c", "step-parts", 0, 0.0)
        });
        let input = TableInput {
            records: &records,
            arms: &["step-parts".to_owned(), CONTROL.to_owned()],
            seeds: &[0, 1],
            reference: "step-parts",
            settings: &settings,
            shapes: &["a", "b", "c"].map(str::to_owned),
        };
        let text = tables(&input).markdown;
        for expected in [
            "2 of 3 shapes, 2 seeds",
            "- c: it is open",
            "| `control` | 2 | 2.100 ± 1.414 | 1.000 ± 0.000 |",
            "| CDL1 ×10² | two seeds | 0.2000 |",
            "| CDL1 ×10² | `step-parts` − `control` | 0.0500 | +0.0500 ± 0.0000 |",
        ] {
            assert!(text.contains(expected), "{expected} in\n{text}");
        }
    }
}
