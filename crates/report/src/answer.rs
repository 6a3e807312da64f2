//! Says in one sentence which labels train the better backbone, with what the comparison can resolve.

use crate::score_tables::difference_text;
use crate::shape_scores::MainTable;
use partprobe_eval::{Difference, DifferenceRow, MIOU, SIGNIFICANCE, Tables};

/// The answer of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Answer {
    /// The short answer.
    pub(crate) headline: String,
    /// The sentence with the numbers.
    pub(crate) sentence: String,
    /// What the comparison can resolve, and what limits it.
    pub(crate) power: String,
}

/// The answer that the main pair gives under the primary endpoints, or under the first table if there are none.
pub(crate) fn answer(tables: &Tables, trained: &[String]) -> Answer {
    let Some(main) = MainTable::of(tables) else {
        return Answer {
            headline: "Nothing was scored.".to_owned(),
            ..Answer::default()
        };
    };
    let is_main =
        |row: &&DifferenceRow| row.reference == main.reference && row.clusterer == main.clusterer;
    let Some(row) = tables.differences.iter().find(is_main) else {
        return alone(tables, main, trained);
    };
    let Some(found) = row.differences.get(&MIOU) else {
        return alone(tables, main, trained);
    };
    Answer {
        headline: headline(&outcomes(tables, row, found)),
        ..compared(row, found)
    }
}

/// The result of one endpoint for the pair.
struct Outcome<'a> {
    row: &'a DifferenceRow,
    /// The index of the source that is ahead by more than chance. It is `None` if the difference may be chance, or if there is no
    /// interval.
    winner: Option<usize>,
    has_interval: bool,
}

/// The outcomes of the primary endpoints, or that of the main table if no endpoint is primary.
fn outcomes<'a>(
    tables: &'a Tables,
    main: &'a DifferenceRow,
    found: &Difference,
) -> Vec<Outcome<'a>> {
    let of_pair = tables.differences.iter();
    let of_pair = of_pair.filter(|row| row.compared == main.compared);
    let primary: Vec<Outcome<'_>> = of_pair
        .flat_map(|row| row.primary.iter().map(move |metric| (row, metric)))
        .filter_map(|(row, metric)| Some(outcome(row, row.differences.get(metric)?)))
        .collect();
    if primary.is_empty() {
        vec![outcome(main, found)]
    } else {
        primary
    }
}

fn outcome<'a>(row: &'a DifferenceRow, found: &Difference) -> Outcome<'a> {
    let p = found.adjusted_p.or(found.p);
    let is_found = p.is_some_and(|p| p < SIGNIFICANCE);
    Outcome {
        row,
        winner: is_found.then(|| usize::from(found.mean < 0.0)),
        has_interval: found.interval.is_some(),
    }
}

/// One sentence over all endpoints: who is ahead, and against which labels.
fn headline(outcomes: &[Outcome<'_>]) -> String {
    let Some(Outcome { row, .. }) = outcomes.first() else {
        return String::new();
    };
    let [first, second] = &row.compared;
    if outcomes.iter().all(|outcome| !outcome.has_interval) {
        return format!("Too few groups of shapes to tell {first} from {second}.");
    }
    let ahead = |winner: usize| -> Vec<&str> {
        let won = outcomes
            .iter()
            .filter(|outcome| outcome.winner == Some(winner));
        won.map(|outcome| outcome.row.reference.as_str()).collect()
    };
    match (ahead(0).as_slice(), ahead(1).as_slice()) {
        ([], []) => format!("Cannot tell whether {first} or {second} trains a better backbone."),
        (won, []) if won.len() == outcomes.len() => better(first, second),
        ([], won) if won.len() == outcomes.len() => better(second, first),
        (won, []) => partly(first, won, second),
        ([], won) => partly(second, won, first),
        (by_first, by_second) => format!(
            "Each source is ahead somewhere: {first} against the labels of {}, and {second} against those of {}.",
            by_first.join(" and "),
            by_second.join(" and ")
        ),
    }
}

fn better(better: &str, worse: &str) -> String {
    format!("Labels of {better} train a better backbone than labels of {worse}.")
}

/// A lead under some of the endpoints.
fn partly(ahead: &str, references: &[&str], behind: &str) -> String {
    format!(
        "Labels of {ahead} train a better backbone than labels of {behind} against the labels of {}. Elsewhere the difference may be chance.",
        references.join(" and ")
    )
}

fn compared(row: &DifferenceRow, found: &Difference) -> Answer {
    let [first, second] = &row.compared;
    let mut power = row.resolution();
    if found.n_seeds < 2 {
        power.push_str(
            " With one seed, the interval does not contain the variance between trainings.",
        );
    }
    if [first, second].contains(&&row.reference) {
        power.push_str(&format!(
            " The reference is one of the two: a backbone is favored by the reference that it was trained on ({}).",
            row.reference
        ));
    }
    Answer {
        headline: String::new(),
        sentence: format!(
            "The difference of mIoU, {first} minus {second}, is {} over {} test shapes, scored against {} with clusters by {}.",
            difference_text(found),
            row.n_shapes,
            row.reference,
            row.clusterer
        ),
        power,
    }
}

/// A run without a pair to compare.
fn alone(tables: &Tables, main: MainTable<'_>, trained: &[String]) -> Answer {
    let mean = |name: &str| {
        let row = tables.row(name, main.reference, main.clusterer)?;
        Some((*row.means.get(&MIOU)?, row.n_shapes))
    };
    let best = trained
        .iter()
        .filter_map(|name| Some((name, mean(name)?)))
        .max_by(|a, b| a.1.0.total_cmp(&b.1.0));
    let Some((name, (miou, n_shapes))) = best else {
        return Answer {
            headline: "No trained backbone was scored.".to_owned(),
            ..Answer::default()
        };
    };
    let without = ["untrained", "no-network"]
        .iter()
        .filter_map(|row| Some(format!("{:.3} for {row}", mean(row)?.0)));
    let without: Vec<String> = without.collect();
    let untrained_text = match without.as_slice() {
        [] => String::new(),
        rows => format!("; it is {}", rows.join(" and ")),
    };
    Answer {
        headline: format!("A backbone trained on labels of {name} reaches an mIoU of {miou:.3}."),
        sentence: format!(
            "This is the mean over {n_shapes} test shapes, scored against {} with clusters by {}{untrained_text}.",
            main.reference, main.clusterer
        ),
        power:
            "The run compares no pair of label sources, so it has no difference with an interval."
                .to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_eval::Interval;
    use std::collections::BTreeMap;

    /// The pair a and b under a reference: the difference, and p if there is an interval.
    fn row(reference: &str, mean: f64, p: Option<f64>, is_primary: bool) -> DifferenceRow {
        let difference = Difference {
            mean,
            n_seeds: 3,
            seed_deviation: None,
            standard_error: None,
            interval: p.map(|_| Interval {
                low: mean - 0.01,
                high: mean + 0.01,
            }),
            p,
            adjusted_p: p,
        };
        DifferenceRow {
            reference: reference.to_owned(),
            clusterer: "k-means".to_owned(),
            compared: ["a".to_owned(), "b".to_owned()],
            n_shapes: 50,
            n_groups: 20,
            effective_groups: 20.0,
            differences: BTreeMap::from([(MIOU, difference)]),
            primary: if is_primary { vec![MIOU] } else { Vec::new() },
        }
    }

    #[track_caller]
    fn check(rows: &[DifferenceRow], expected: &str) {
        let outcomes: Vec<Outcome<'_>> = rows
            .iter()
            .map(|row| outcome(row, &row.differences[&MIOU]))
            .collect();
        assert_eq!(headline(&outcomes), expected);
    }

    #[test]
    fn the_headline_considers_all_endpoints() {
        let won = |reference| row(reference, 0.06, Some(0.001), true);
        let lost = |reference| row(reference, -0.06, Some(0.02), true);
        let open = |reference| row(reference, -0.06, Some(0.06), true);
        let unknown = |reference| row(reference, 0.06, None, true);
        let a_over_b = "Labels of a train a better backbone than labels of b";
        check(&[won("a"), won("b")], &format!("{a_over_b}."));
        check(
            &[lost("a")],
            "Labels of b train a better backbone than labels of a.",
        );
        check(
            &[won("a"), open("b")],
            &format!("{a_over_b} against the labels of a. Elsewhere the difference may be chance."),
        );
        check(
            &[won("a"), lost("b")],
            "Each source is ahead somewhere: a against the labels of a, and b against those of b.",
        );
        check(
            &[open("a")],
            "Cannot tell whether a or b trains a better backbone.",
        );
        check(
            &[unknown("a")],
            "Too few groups of shapes to tell a from b.",
        );
    }
}
