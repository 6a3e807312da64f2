//! Says in one sentence which labels train the better backbone, with what the comparison can resolve.

use crate::score_tables::difference_text;
use crate::shape_scores::MainTable;
use partprobe_eval::{Difference, DifferenceRow, MIOU, Tables};

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

/// The answer that the first table gives.
pub(crate) fn answer(tables: &Tables, trained: &[String]) -> Answer {
    let Some(main) = MainTable::of(tables) else {
        return Answer {
            headline: "Nothing was scored.".to_owned(),
            ..Answer::default()
        };
    };
    let difference = tables
        .differences
        .iter()
        .find(|row| row.reference == main.reference && row.clusterer == main.clusterer)
        .and_then(|row| Some((row, row.differences.get(&MIOU)?)));
    match difference {
        Some((row, found)) => compared(row, found),
        None => alone(tables, main, trained),
    }
}

fn compared(row: &DifferenceRow, found: &Difference) -> Answer {
    let [first, second] = &row.compared;
    let (better, worse) = if found.mean < 0.0 {
        (second, first)
    } else {
        (first, second)
    };
    let verdict = match found.interval {
        Some(interval) if interval.low > 0.0 || interval.high < 0.0 => {
            format!("Labels of {better} train the better backbone than labels of {worse}.")
        }
        Some(_) => format!("Cannot tell whether {first} or {second} trains the better backbone."),
        None => format!("Too few groups of shapes to tell {first} from {second}."),
    };
    let mut power = row.resolution();
    if [first, second].contains(&&row.reference) {
        power.push_str(&format!(
            " The reference is one of the two: a backbone is favored by the reference that it was trained on ({}).",
            row.reference
        ));
    }
    Answer {
        headline: verdict,
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
    let beside = match without.as_slice() {
        [] => String::new(),
        rows => format!("; it is {}", rows.join(" and ")),
    };
    Answer {
        headline: format!("A backbone trained on labels of {name} reaches an mIoU of {miou:.3}."),
        sentence: format!(
            "This is the mean over {n_shapes} test shapes, scored against {} with clusters by {}{beside}.",
            main.reference, main.clusterer
        ),
        power:
            "The run compares no pair of label sources, so it has no difference with an interval."
                .to_owned(),
    }
}
