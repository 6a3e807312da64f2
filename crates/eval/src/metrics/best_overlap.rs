//! Computes the mean over the parts of the best IoU with any cluster, without a matching.
//!
//! Several parts may have their best overlap with one cluster, so this is never below the mIoU of a matching. Publications on
//! part fields often print this number as mIoU.

use crate::confusion::Confusion;
use crate::metric::Metric;

/// Mean best IoU.
pub const BEST_OVERLAP_MIOU: Metric = Metric {
    name: "best_overlap_miou",
    heading: "best overlap",
    value: |shape| {
        let confusion = Confusion::new(shape.predicted, shape.reference).ok()?;
        Some(mean_best_iou(&confusion))
    },
};

fn mean_best_iou(confusion: &Confusion) -> f64 {
    let n_parts = confusion.reference_ids().len();
    let best = |part: usize| {
        let clusters = 0..confusion.predicted_ids().len();
        clusters
            .map(|cluster| confusion.iou(part, cluster))
            .fold(0.0, f64::max)
    };
    (0..n_parts).map(best).sum::<f64>() / n_parts as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_parts_may_have_one_best_cluster() {
        let found = |predicted: &[u32], reference: &[i32]| {
            mean_best_iou(&Confusion::new(predicted, reference).unwrap())
        };
        assert_eq!(found(&[4, 4, 2], &[0, 0, 1]), 1.0);
        // Both parts overlap the one cluster by a half.
        assert_eq!(found(&[4, 4, 4, 4], &[0, 0, 1, 1]), 0.5);
        assert_eq!(found(&[4, 4, 4, 7], &[0, 0, 1, 1]), (2.0 / 3.0 + 0.5) / 2.0);
    }
}
