//! Describes which differences are more than chance: each primary endpoint, and the number of other differences.

use super::{DifferenceRow, Tables};
use crate::metric::Metric;
use crate::paired::{Difference, SIGNIFICANCE};
use std::fmt::Write as _;

/// The largest number of secondary differences that are named. Further ones are only counted.
const MAX_NAMED: usize = 10;

impl Tables {
    /// A Markdown section with the primary endpoints, and the secondary ones that are more than chance. It is empty if no difference
    /// has an interval.
    pub(super) fn decisions(&self) -> String {
        let primary = self.tested(true);
        let secondary = self.tested(false);
        if primary.is_empty() && secondary.is_empty() {
            return String::new();
        }
        let mut text = String::new();
        if !primary.is_empty() {
            text.push_str(
                "\nPrimary endpoints (`compare.primary`, or mIoU against the first reference if it is empty); p is corrected for their number (Holm):\n\n\
                 | endpoint | Δ | seeds | deviation between seeds | p |\n|---|---:|---:|---:|---:|\n",
            );
            for (row, metric, found) in &primary {
                push_endpoint(&mut text, row, *metric, found);
            }
        }
        push_secondary(&mut text, &secondary);
        let tested = primary.iter().chain(&secondary);
        match tested.map(|(_, _, found)| found.n_seeds).min() {
            Some(0 | 1) => text.push_str(
                "\nWith one seed, the intervals do not contain the variance between trainings. Train three seeds or more.\n",
            ),
            Some(2) => text.push_str(
                "\nTwo seeds tell little about the variance between trainings. Train three seeds or more.\n",
            ),
            _ => {}
        }
        text
    }

    /// The differences that have a p-value.
    fn tested(&self, is_primary: bool) -> Vec<(&DifferenceRow, Metric, &Difference)> {
        let mut tested = Vec::new();
        for row in &self.differences {
            for (&metric, found) in &row.differences {
                if found.adjusted_p.is_some() && row.primary.contains(&metric) == is_primary {
                    tested.push((row, metric, found));
                }
            }
        }
        tested
    }
}

fn push_endpoint(text: &mut String, row: &DifferenceRow, metric: Metric, found: &Difference) {
    let interval = found.interval.map_or_else(String::new, |interval| {
        format!(" [{:+.3}, {:+.3}]", interval.low, interval.high)
    });
    let deviation = found
        .seed_deviation
        .map_or_else(|| "–".to_owned(), |deviation| format!("{deviation:.3}"));
    let _ = writeln!(
        text,
        "| {} | {:+.3}{interval} | {} | {deviation} | {} |",
        name(row, metric),
        found.mean,
        found.n_seeds,
        p_text(found.adjusted_p.unwrap_or(1.0))
    );
}

fn push_secondary(text: &mut String, secondary: &[(&DifferenceRow, Metric, &Difference)]) {
    if secondary.is_empty() {
        return;
    }
    let is_found = |found: &Difference| found.adjusted_p.is_some_and(|p| p < SIGNIFICANCE);
    let mut found: Vec<String> = secondary
        .iter()
        .filter(|(_, _, found)| is_found(found))
        .map(|(row, metric, found)| format!("{} {:+.3}", name(row, *metric), found.mean))
        .collect();
    let n_found = found.len();
    if n_found > MAX_NAMED {
        found.truncate(MAX_NAMED);
        found.push(format!("and {} more", n_found - MAX_NAMED));
    }
    let _ = writeln!(
        text,
        "\n{n_found} of {} secondary differences have a corrected p below {SIGNIFICANCE}{}{}.",
        secondary.len(),
        if found.is_empty() { "" } else { ": " },
        found.join("; ")
    );
}

fn name(row: &DifferenceRow, metric: Metric) -> String {
    let [first, second] = &row.compared;
    format!(
        "`{first}` − `{second}` on `{}`, {} by {}",
        row.reference, metric.heading, row.clusterer
    )
}

fn p_text(p: f64) -> String {
    if p < 0.001 {
        "< 0.001".to_owned()
    } else {
        format!("{p:.3}")
    }
}

#[cfg(test)]
mod tests {
    use crate::tables::tests::{row, settings};
    use crate::tables::{Endpoint, tables};

    /// Three seeds of two supervisions on twenty files: the first is better by 0.1, give or take.
    fn example() -> Vec<crate::ScoreRow> {
        let mut rows = Vec::new();
        for n in 0..20u32 {
            for seed in 0..3 {
                let scatter = 0.01 * f64::from((n * 7 + seed * 3) % 11);
                let shape = format!("{n}__1");
                let miou = 0.4 + scatter;
                rows.push(row(
                    &shape,
                    "step-parts",
                    u64::from(seed),
                    7,
                    miou + 0.1 + scatter,
                ));
                rows.push(row(&shape, "brep-face", u64::from(seed), 7, miou));
            }
        }
        rows
    }

    #[test]
    fn primary_endpoints_are_listed_and_the_others_are_counted() {
        let mut settings = settings();
        settings.primary = vec![Endpoint::parse("step-parts.miou").unwrap()];
        let found = tables(&example(), &settings);
        assert_eq!(found.differences[0].primary.len(), 1);
        let text = found.decisions();
        for expected in [
            "| `step-parts` − `brep-face` on `step-parts`, mIoU by k-means | +0.150 [",
            " | 3 | 0.00",
            "1 of 3 secondary differences have a corrected p below 0.05: `step-parts` − `brep-face` on `step-parts`, accuracy",
        ] {
            assert!(text.contains(expected), "{text}");
        }
        assert!(!text.contains("one seed"), "{text}");
    }

    #[test]
    fn nothing_is_decided_without_an_interval() {
        let mut settings = settings();
        settings.bootstrap.draws = 0;
        assert_eq!(tables(&example(), &settings).decisions(), "");
    }

    #[test]
    fn one_seed_is_reported_as_too_few() {
        let rows: Vec<_> = example().into_iter().filter(|row| row.seed == 0).collect();
        assert!(
            tables(&rows, &settings())
                .decisions()
                .contains("With one seed")
        );
    }

    #[test]
    fn a_training_that_one_arm_lacks_is_not_counted_for_the_other() {
        let mut rows = example();
        rows.retain(|row| row.supervision == "step-parts" || row.seed != 2);
        let found = tables(&rows, &settings());
        assert!(
            found.differences[0]
                .differences
                .values()
                .all(|found| found.n_seeds == 2)
        );
    }
}
