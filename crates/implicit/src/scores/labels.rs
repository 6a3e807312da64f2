//! Scores labels with the same numbers as the reference, so no matching is needed.

/// The scores of predicted labels, each from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelScores {
    /// The mean IoU over the labels that the reference has.
    pub miou: f64,
    /// The fraction of points with the reference's label.
    pub accuracy: f64,
}

/// Compares labels point by point. Points with a negative reference label are ignored. Returns `None` if no point is labeled.
#[must_use]
pub fn shared_label_scores(predicted: &[u32], reference: &[i32]) -> Option<LabelScores> {
    let most = reference.iter().copied().max().filter(|&most| most >= 0)?;
    let n_labels = usize::try_from(most).ok()? + 1;
    let (mut common, mut of_reference, mut of_prediction) = (
        vec![0u64; n_labels],
        vec![0u64; n_labels],
        vec![0u64; n_labels],
    );
    for (&predicted, &reference) in predicted.iter().zip(reference) {
        let Ok(reference) = usize::try_from(reference) else {
            continue;
        };
        of_reference[reference] += 1;
        if let Some(count) = of_prediction.get_mut(predicted as usize) {
            *count += 1;
        }
        common[reference] += u64::from(predicted as usize == reference);
    }
    let (mut ious, mut n_present) = (0.0, 0u32);
    for label in (0..n_labels).filter(|&label| of_reference[label] > 0) {
        let union = of_reference[label] + of_prediction[label] - common[label];
        ious += common[label] as f64 / union as f64;
        n_present += 1;
    }
    let n_points: u64 = of_reference.iter().sum();
    Some(LabelScores {
        miou: ious / f64::from(n_present),
        accuracy: common.iter().sum::<u64>() as f64 / n_points as f64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(predicted: &[u32], reference: &[i32], miou: f64, accuracy: f64) {
        let found = shared_label_scores(predicted, reference).unwrap();
        assert!(
            (found.miou - miou).abs() < 1e-12 && (found.accuracy - accuracy).abs() < 1e-12,
            "{found:?}"
        );
    }

    #[test]
    fn planted_answers() {
        check(&[0, 1, 1], &[0, 1, 1], 1.0, 1.0);
        check(&[1, 0], &[0, 1], 0.0, 0.0);
        check(&[0, 0, 1, 9], &[0, 1, 1, -1], 0.5, 2.0 / 3.0);
        // Label 1 is not in the reference.
        check(&[0, 2, 1], &[0, 2, 2], (1.0 + 0.5) / 2.0, 2.0 / 3.0);
        assert_eq!(shared_label_scores(&[0], &[-1]), None);
    }
}
