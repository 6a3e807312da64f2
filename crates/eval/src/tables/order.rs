//! Defines the order of the rows of a run's tables.

use super::TableSettings;
use crate::score_row::ScoreRow;

/// Supervisions without a training, in the order in which they close a table.
const WITHOUT_TRAINING: [&str; 2] = ["untrained", "no-network"];

/// The key by which rows are sorted: the reference of the bins first, then the default clusterer, then the compared
/// supervisions, then the others, and last those without a training.
pub(super) fn cell_order<'a>(row: &'a ScoreRow, settings: &TableSettings) -> impl Ord + use<'a> {
    let names = (
        row.reference.as_str(),
        row.clusterer != settings.clusterer,
        row.clusterer.as_str(),
        rank(&row.supervision, settings),
        row.supervision.as_str(),
    );
    (row.reference != settings.bin_reference, names)
}

/// The rank of a supervision in its table.
fn rank(supervision: &str, settings: &TableSettings) -> usize {
    let compared = settings.compared.iter().flatten();
    if let Some(index) = compared.into_iter().position(|name| name == supervision) {
        return index;
    }
    match WITHOUT_TRAINING
        .iter()
        .position(|name| *name == supervision)
    {
        Some(index) => 3 + index,
        None => 2,
    }
}
