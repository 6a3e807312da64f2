//! Defines the order of the rows of a run's tables.

use super::TableSettings;
use crate::score_row::ScoreRow;

/// Rows without a training, in their order at the end of a table. The rows of the labels of sources come before them.
const WITHOUT_TRAINING: [&str; 9] = [
    "untrained",
    "random-fourier",
    "no-network",
    "shuffled-labels",
    "growing-10",
    "growing-20",
    "growing-30",
    "token-ceiling",
    "perfect-embeddings",
];

/// The prefix of the name of a row that scores the labels of a source themselves.
const LABELS: &str = "labels-of-";

/// The name of the row that scores the labels of a source themselves, as if they were clusters.
#[must_use]
pub fn labels_row(source: &str) -> String {
    format!("{LABELS}{source}")
}

/// Whether a row is that of a backbone that was trained.
pub(super) fn is_trained(supervision: &str) -> bool {
    !WITHOUT_TRAINING.contains(&supervision) && !supervision.starts_with(LABELS)
}

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

/// The rank of a supervision in its table, by kind and then within the kind.
fn rank(supervision: &str, settings: &TableSettings) -> [usize; 2] {
    let mut compared = settings.compared.iter().flatten();
    if let Some(index) = compared.position(|name| name == supervision) {
        return [0, index];
    }
    let mut known = WITHOUT_TRAINING.iter();
    match known.position(|name| *name == supervision) {
        Some(index) => [3, index],
        None if supervision.starts_with(LABELS) => [2, 0],
        None => [1, 0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bootstrap::Bootstrap;

    #[test]
    fn rows_without_a_training_close_a_table() {
        let settings = TableSettings {
            bin_reference: "step-parts".to_owned(),
            clusterer: "k-means".to_owned(),
            compared: vec![["b".to_owned(), "a".to_owned()]],
            primary: Vec::new(),
            seed_deviation: None,
            bootstrap: Bootstrap {
                draws: 0,
                seed: 0,
                least_groups: 2,
            },
            footer: Vec::new(),
        };
        let labels = labels_row("a");
        let names = [
            "b",
            "a",
            "c",
            &labels,
            "untrained",
            "growing-20",
            "token-ceiling",
        ];
        let ranks = names.map(|name| rank(name, &settings));
        assert!(ranks.is_sorted_by(|a, b| a < b), "{ranks:?}");
    }
}
