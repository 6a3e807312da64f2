//! Holds all measures of the comparison of one source's labels of a shape with those of the reference.

use super::ari::adjusted_rand_index;
use super::curve::{AgreementBin, DISTANCE_LIMITS, THICKNESS_LIMITS, binned};
use super::merges::{n_merges, n_splits};
use crate::confusion::{Confusion, ScoreError};
use crate::matching::{Matching, match_clusters};
use crate::scores::shape_scores;
use serde::{Deserialize, Serialize};

/// The half-widths of the bands around reference borders, as fractions of the bounding box's diagonal.
pub const BANDS: [f64; 4] = [0.0025, 0.005, 0.01, 0.02];

/// The positions of the points of a shape. Each list has one value per point.
#[derive(Clone, Copy, Debug)]
pub struct PointPositions<'a> {
    /// Distance to the nearest border of the reference, as a fraction of the diagonal. It is NaN if there is no border.
    pub border_distance: &'a [f64],
    /// Distance to the opposite wall, as a fraction of the diagonal. It is NaN if there is no such wall.
    pub thickness: &'a [f64],
}

/// How well the labels of one source agree with those of the reference on one shape.
///
/// Labels are matched one to one so that as many points as possible agree. Scores are from 0 to 1. Only the adjusted Rand index
/// may be negative.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShapeAgreement {
    /// Reference parts that have a point.
    pub n_reference: usize,
    /// Labels of the source that have a point.
    pub n_labels: usize,
    /// Fraction of the points whose label is the one that is matched to their part.
    pub accuracy: f64,
    /// Mean IoU over the reference parts. A part without a matched label counts 0.
    pub miou: f64,
    /// The adjusted Rand index.
    pub ari: f64,
    /// The accuracy in each of [`BANDS`] around the reference borders. A value is `None` if the band has no point.
    pub boundary: [Option<f64>; 4],
    /// See [`super::n_merges`].
    pub n_merges: u64,
    /// See [`super::n_splits`].
    pub n_splits: u64,
    /// Points by their distance to the nearest reference border, in the bins of [`DISTANCE_LIMITS`].
    pub by_distance: Vec<AgreementBin>,
    /// Points by the local thickness, in the bins of [`THICKNESS_LIMITS`].
    pub by_thickness: Vec<AgreementBin>,
}

/// Compares the labels of the same points by a source and by the reference.
///
/// Points with a negative reference label do not count. Points with a negative label of the source agree with no part.
///
/// # Errors
/// If the lists differ in length, or the reference ignores every point.
pub fn agreement(
    labels: &[i32],
    reference: &[i32],
    positions: PointPositions<'_>,
) -> Result<ShapeAgreement, ScoreError> {
    let confusion = Confusion::of_labels(labels, reference)?;
    let matching = match_clusters(&confusion);
    let scores = shape_scores(&confusion, &matching.cluster_of_part);
    let agrees = agreeing(labels, reference, &confusion, &matching);
    let band = |half_width: f64| {
        let [inside, _] = &binned(
            positions.border_distance,
            &agrees,
            &[half_width, f64::INFINITY],
        )[..] else {
            return None;
        };
        inside.accuracy()
    };
    Ok(ShapeAgreement {
        n_reference: scores.k,
        n_labels: confusion.predicted_ids().len(),
        accuracy: scores.accuracy,
        miou: scores.miou,
        ari: adjusted_rand_index(&confusion),
        boundary: BANDS.map(band),
        n_merges: n_merges(&confusion),
        n_splits: n_splits(&confusion),
        by_distance: binned(positions.border_distance, &agrees, &DISTANCE_LIMITS),
        by_thickness: binned(positions.thickness, &agrees, &THICKNESS_LIMITS),
    })
}

/// Whether each point has the label that is matched to its part, or `None` if the reference ignores the point.
fn agreeing(
    labels: &[i32],
    reference: &[i32],
    confusion: &Confusion,
    matching: &Matching,
) -> Vec<Option<bool>> {
    let matched = |part: i32| {
        let row = confusion.reference_ids().binary_search(&part).ok()?;
        let column = matching.cluster_of_part[row]?;
        Some(confusion.predicted_ids()[column])
    };
    let agrees = |(&label, &part): (&i32, &i32)| {
        let is_matched = || u32::try_from(label).is_ok_and(|label| matched(part) == Some(label));
        (part >= 0).then(is_matched)
    };
    labels.iter().zip(reference).map(agrees).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn measured(labels: &[i32], reference: &[i32], distance: &[f64]) -> ShapeAgreement {
        let positions = PointPositions {
            border_distance: distance,
            thickness: distance,
        };
        agreement(labels, reference, positions).unwrap()
    }

    #[test]
    fn equal_labels_agree_everywhere() {
        let found = measured(&[7, 7, 3, 3], &[0, 0, 1, 1], &[0.3, 0.001, 0.002, 0.3]);
        assert_eq!((found.accuracy, found.miou, found.ari), (1.0, 1.0, 1.0));
        assert_eq!((found.n_merges, found.n_splits), (0, 0));
        assert_eq!(found.boundary, [Some(1.0); 4]);
    }

    #[test]
    fn a_wrong_point_counts_in_its_bands_and_bins() {
        // Label 1 has three points of part 0 and the only one of part 1 that is labeled 0 lies near the border.
        let labels = [1, 1, 1, 0, 0, -1, 4];
        let reference = [0, 0, 0, 0, 1, 1, -1];
        let distance = [0.1, 0.1, 0.1, 0.003, 0.001, 0.015, 0.0];
        let found = measured(&labels, &reference, &distance);
        assert_eq!((found.n_reference, found.n_labels), (2, 2));
        assert!((found.accuracy - 4.0 / 6.0).abs() < 1e-12);
        assert!((found.miou - 0.5 * (3.0 / 4.0 + 1.0 / 3.0)).abs() < 1e-12);
        assert_eq!(
            found.boundary,
            [Some(1.0), Some(0.5), Some(0.5), Some(1.0 / 3.0)]
        );
        let counts: Vec<[u64; 2]> = found
            .by_distance
            .iter()
            .map(|bin| [bin.n_points, bin.n_agreeing])
            .collect();
        assert_eq!(
            counts,
            [
                [1, 1],
                [1, 0],
                [0, 0],
                [1, 0],
                [0, 0],
                [0, 0],
                [3, 3],
                [0, 0]
            ]
        );
    }

    #[test]
    fn without_a_border_there_is_no_band() {
        let found = measured(&[0, 0], &[0, 0], &[f64::NAN; 2]);
        assert_eq!(found.boundary, [None; 4]);
        assert!(found.by_distance.iter().all(|bin| bin.n_points == 0));
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let positions = PointPositions {
            border_distance: &[],
            thickness: &[],
        };
        assert_eq!(
            agreement(&[0], &[-1], positions),
            Err(ScoreError::NothingLabeled)
        );
        assert!(agreement(&[0, 1], &[0], positions).is_err());
    }
}
