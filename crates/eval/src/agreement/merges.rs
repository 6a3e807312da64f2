//! Counts how often one label covers several reference parts, and how often several labels share one part.

use crate::confusion::Confusion;

/// The number of merges: for each label of the source, the number of reference parts that have more than half of their points
/// under it, minus one.
///
/// The result is the sum over all labels. It counts the parts that the labels do not distinguish from another part.
#[must_use]
pub fn n_merges(confusion: &Confusion) -> u64 {
    let mut under = vec![0; confusion.predicted_ids().len()];
    for part in 0..confusion.reference_ids().len() {
        let n_points = confusion.n_of_part(part);
        let cover = (0..under.len()).find(|&label| n_points < 2 * confusion.count(part, label));
        if let Some(label) = cover {
            under[label] += 1;
        }
    }
    beyond_the_first(&under)
}

/// The number of splits: for each reference part, the number of labels that have more than half of their points in it, minus one.
///
/// The result is the sum over all parts. It counts the labels that cover only a fraction of a part which another label also
/// covers.
#[must_use]
pub fn n_splits(confusion: &Confusion) -> u64 {
    let mut inside = vec![0; confusion.reference_ids().len()];
    for label in 0..confusion.predicted_ids().len() {
        let n_points = confusion.n_of_cluster(label);
        let home = (0..inside.len()).find(|&part| n_points < 2 * confusion.count(part, label));
        if let Some(part) = home {
            inside[part] += 1;
        }
    }
    beyond_the_first(&inside)
}

fn beyond_the_first(counts: &[u64]) -> u64 {
    counts.iter().map(|n| n.saturating_sub(1)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(predicted: &[i32], reference: &[i32], merges: u64, splits: u64) {
        let confusion = Confusion::of_labels(predicted, reference).unwrap();
        assert_eq!(
            (n_merges(&confusion), n_splits(&confusion)),
            (merges, splits)
        );
    }

    #[test]
    fn parts_under_one_label_and_labels_in_one_part_are_counted() {
        check(&[0, 0, 1, 1], &[4, 4, 2, 2], 0, 0);
        check(&[0, 0, 0, 0, 0], &[4, 4, 2, 2, 1], 2, 0);
        check(&[0, 1, 2, 3, 3], &[4, 4, 4, 2, 2], 0, 2);
        // Each label has exactly half of each part: nothing is merged, nothing is split.
        check(&[0, 1, 0, 1], &[4, 4, 2, 2], 0, 0);
        // Unlabeled points count in their part: one point of three is not a majority.
        check(&[0, -1, -1, 0, 0], &[4, 4, 4, 2, 2], 0, 0);
    }
}
