//! Computes the achievable segmentation accuracy (Liu et al. 2011, "Entropy rate superpixel segmentation"): the accuracy if
//! each cluster were given the part that most of its points have.
//!
//! Several clusters may belong to one part, so it does not penalize splitting. It rises with the number of clusters, so it is
//! only comparable between equal numbers.

use crate::confusion::Confusion;
use crate::metric::Metric;

/// Achievable segmentation accuracy.
pub const ASA: Metric = Metric {
    name: "asa",
    heading: "ASA",
    value: |shape| {
        let confusion = Confusion::new(shape.predicted, shape.reference).ok()?;
        Some(achievable_accuracy(&confusion))
    },
};

fn achievable_accuracy(confusion: &Confusion) -> f64 {
    let n_parts = confusion.reference_ids().len();
    let most = |cluster: usize| {
        let counts = (0..n_parts).map(|part| confusion.count(part, cluster));
        counts.max().unwrap_or(0)
    };
    let n_right: u64 = (0..confusion.predicted_ids().len()).map(most).sum();
    n_right as f64 / confusion.n_points() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cluster_is_worth_its_largest_part() {
        let of = |predicted: &[u32], reference: &[i32]| {
            achievable_accuracy(&Confusion::new(predicted, reference).unwrap())
        };
        assert_eq!(of(&[1, 1, 1, 2], &[0, 0, 3, 3]), 0.75);
        // Two pieces of one part cost nothing.
        assert_eq!(of(&[1, 2, 3, 3], &[0, 0, 3, 3]), 1.0);
        assert_eq!(of(&[1, 1], &[0, -1]), 1.0);
    }
}
