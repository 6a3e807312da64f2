//! Scores the predicted clusters of one shape against its reference parts.

use crate::confusion::{Confusion, ScoreError};
use crate::matching::match_clusters;

/// The scores of one shape, each from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeScores {
    /// The number of reference parts that have at least one point.
    pub k: usize,
    /// Mean IoU over those parts. A part without a matched cluster counts 0.
    pub miou: f64,
    /// Fraction of the points whose cluster is the one that is matched to their part.
    pub accuracy: f64,
}

/// Matches the clusters to the parts and scores the result. Points with a negative reference label are ignored.
///
/// # Errors
/// If the lists differ in length, or the reference ignores every point.
pub fn score_clusters(predicted: &[u32], reference: &[i32]) -> Result<ShapeScores, ScoreError> {
    let confusion = Confusion::new(predicted, reference)?;
    let matching = match_clusters(&confusion);
    Ok(shape_scores(&confusion, &matching.cluster_of_part))
}

/// Labels as clusters: all points with a negative label share one cluster, which no other label has.
#[must_use]
pub fn clusters_of_labels(labels: &[i32]) -> Vec<u32> {
    let cluster = |&label: &i32| u32::try_from(label).unwrap_or(u32::MAX);
    labels.iter().map(cluster).collect()
}

/// The scores under a given assignment of clusters to parts.
pub(crate) fn shape_scores(
    confusion: &Confusion,
    cluster_of_part: &[Option<usize>],
) -> ShapeScores {
    let mut agreeing = 0;
    let mut ious = 0.0;
    for (part, cluster) in cluster_of_part.iter().enumerate() {
        if let Some(cluster) = *cluster {
            agreeing += confusion.count(part, cluster);
            ious += confusion.iou(part, cluster);
        }
    }
    let k = cluster_of_part.len();
    ShapeScores {
        k,
        miou: ious / k as f64,
        accuracy: agreeing as f64 / confusion.n_points() as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(predicted: &[u32], reference: &[i32], k: usize, miou: f64, accuracy: f64) {
        let scores = score_clusters(predicted, reference).unwrap();
        assert_eq!(scores.k, k);
        assert!(
            (scores.miou - miou).abs() < 1e-12 && (scores.accuracy - accuracy).abs() < 1e-12,
            "{scores:?}"
        );
    }

    #[test]
    fn labels_of_any_size_are_clusters() {
        assert_eq!(
            clusters_of_labels(&[i32::MAX, -1, 0, i32::MIN]),
            [i32::MAX as u32, u32::MAX, 0, u32::MAX]
        );
    }

    #[test]
    fn planted_answers() {
        check(&[3, 3, 8], &[1, 1, 0], 2, 1.0, 1.0);
        // One cluster for two parts: one IoU is 2/3, the other part has none.
        check(&[0, 0, 0], &[0, 0, 1], 2, 1.0 / 3.0, 2.0 / 3.0);
        // Two clusters for one part.
        check(&[0, 0, 1], &[5, 5, 5], 1, 2.0 / 3.0, 2.0 / 3.0);
        check(&[0, 0, 1, 9], &[0, 0, 1, -1], 2, 1.0, 1.0);
        check(
            &[0, 0, 1, 1],
            &[0, 1, 1, 1],
            2,
            (0.5 + 2.0 / 3.0) / 2.0,
            0.75,
        );
    }

    proptest! {
        #[test]
        fn names_and_order_do_not_matter(points in proptest::collection::vec((0u32..6, -1i32..6), 1..60)) {
            prop_assume!(points.iter().any(|&(_, part)| part >= 0));
            let scores = |points: &[(u32, i32)]| {
                let (predicted, reference): (Vec<u32>, Vec<i32>) = points.iter().copied().unzip();
                score_clusters(&predicted, &reference).unwrap()
            };
            let renamed = points.iter().rev().map(|&(cluster, part)| (91 - 7 * cluster, if part < 0 { part } else { 50 - part }));
            let (a, b) = (scores(&points), scores(&renamed.collect::<Vec<_>>()));
            prop_assert_eq!(a.k, b.k);
            prop_assert!((a.miou - b.miou).abs() < 1e-8 && a.accuracy == b.accuracy);
            prop_assert!((0.0..=1.0).contains(&a.miou) && a.accuracy <= 1.0 && a.accuracy > 0.0);
        }
    }
}
