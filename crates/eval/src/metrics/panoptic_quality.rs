//! Computes the panoptic quality at IoU 0.5 (Kirillov et al. 2019), for instances of one class.
//!
//! A part is found if a cluster has an IoU above 0.5 with it. At most one cluster can have this. The sum of these IoUs is divided
//! by the number of found parts, plus half of the parts that were not found, plus half of the clusters that found none.

use crate::confusion::Confusion;
use crate::metric::Metric;

/// Panoptic quality.
pub const PANOPTIC_QUALITY: Metric = Metric {
    name: "pq",
    heading: "PQ",
    value: |shape| {
        let confusion = Confusion::new(shape.predicted, shape.reference).ok()?;
        Some(panoptic_quality(&confusion))
    },
};

/// A part is found above this IoU.
const LEAST_IOU: f64 = 0.5;

fn panoptic_quality(confusion: &Confusion) -> f64 {
    let n_parts = confusion.reference_ids().len();
    let n_clusters = confusion.predicted_ids().len();
    let pairs = (0..n_parts).flat_map(|part| (0..n_clusters).map(move |cluster| [part, cluster]));
    let found: Vec<f64> = pairs
        .map(|[part, cluster]| confusion.iou(part, cluster))
        .filter(|&iou| iou > LEAST_IOU)
        .collect();
    // Found parts, and half of all parts and clusters that are left.
    let n_all = 0.5 * (n_parts + n_clusters) as f64;
    // The sum of no numbers is -0 in Rust.
    found.iter().fold(0.0, |sum, iou| sum + iou) / n_all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(predicted: &[u32], reference: &[i32], expected: f64) {
        let confusion = Confusion::new(predicted, reference).unwrap();
        let found = panoptic_quality(&confusion);
        assert!((found - expected).abs() < 1e-12, "{found}");
    }

    #[test]
    fn missed_parts_and_unmatched_clusters_lower_the_score() {
        check(&[3, 3, 8], &[1, 1, 0], 1.0);
        // One part is found with 2/3, the other is not, and no cluster is left over.
        check(&[0, 0, 0], &[0, 0, 1], (2.0 / 3.0) / 1.5);
        // One part is found with 2/3, and one cluster found none.
        check(&[0, 0, 1], &[5, 5, 5], (2.0 / 3.0) / 1.5);
        // An IoU of exactly 0.5 finds nothing.
        check(&[0, 0, 1, 1], &[5, 5, 5, 5], 0.0);
        let nothing = Confusion::new(&[0, 0, 1, 1], &[5, 5, 5, 5]).unwrap();
        assert!(panoptic_quality(&nothing).is_sign_positive());
    }
}
