//! Measures how evenly the area of a shape is spread over its labels.

/// The entropy −Σ a·ln a of the labels' fractions of the labeled area, in nats.
///
/// `labels` and `areas` have one entry per triangle; negative labels are left out. The entropy is 0 for one label and
/// ln n for n labels of equal area.
#[must_use]
pub fn size_entropy(labels: &[i32], areas: &[f64]) -> f64 {
    let n_labels = labels
        .iter()
        .max()
        .map_or(0, |&max| usize::try_from(max + 1).unwrap_or(0));
    let mut area_of_label = vec![0.0; n_labels];
    for (&label, &area) in labels.iter().zip(areas) {
        if let Ok(label) = usize::try_from(label) {
            area_of_label[label] += area;
        }
    }
    let total: f64 = area_of_label.iter().sum();
    let term = |&area: &f64| {
        let fraction = area / total;
        if fraction > 0.0 {
            -fraction * fraction.ln()
        } else {
            0.0
        }
    };
    area_of_label.iter().map(term).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(labels: &[i32], areas: &[f64], expected: f64) {
        assert!((size_entropy(labels, areas) - expected).abs() < 1e-12);
    }

    #[test]
    fn equal_areas_give_the_logarithm_of_their_number() {
        check(&[0, 0, 1], &[1.0, 1.0, 2.0], 2f64.ln());
        check(&[0, 0], &[1.0, 3.0], 0.0);
        check(&[0, 2, -1, 5, 7], &[1.0, 1.0, 9.0, 1.0, 1.0], 4f64.ln());
        check(&[-1], &[1.0], 0.0);
        check(&[0], &[0.0], 0.0);
        check(&[], &[], 0.0);
    }
}
