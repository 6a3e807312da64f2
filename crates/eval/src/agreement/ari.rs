//! Computes the adjusted Rand index of two labelings (Hubert and Arabie 1985).

use crate::confusion::Confusion;

/// The adjusted Rand index over the points that both sources label: 1 for equal partitions, about 0 for unrelated ones.
///
/// It can be negative, down to −0.5. Two partitions that both have one part only, or one part per point, are equal and give 1.
#[must_use]
pub fn adjusted_rand_index(confusion: &Confusion) -> f64 {
    let n_parts = confusion.reference_ids().len();
    let n_clusters = confusion.predicted_ids().len();
    let mut of_part = vec![0; n_parts];
    let mut of_cluster = vec![0; n_clusters];
    let mut together = 0.0;
    for (part, part_sum) in of_part.iter_mut().enumerate() {
        for (cluster, cluster_sum) in of_cluster.iter_mut().enumerate() {
            let count = confusion.count(part, cluster);
            *part_sum += count;
            *cluster_sum += count;
            together += pairs(count);
        }
    }

    let all = pairs(of_cluster.iter().sum());
    let in_parts: f64 = of_part.iter().map(|&n| pairs(n)).sum();
    let in_clusters: f64 = of_cluster.iter().map(|&n| pairs(n)).sum();
    index_of_pair_counts(together, in_parts, in_clusters, all)
}

/// The index from the numbers of pairs of points: pairs in the same part and the same cluster, in the same part, in the same
/// cluster, and all pairs.
pub(crate) fn index_of_pair_counts(
    together: f64,
    in_parts: f64,
    in_clusters: f64,
    all: f64,
) -> f64 {
    if all == 0.0 {
        return 1.0;
    }
    let expected = in_parts * in_clusters / all;
    let largest = 0.5 * (in_parts + in_clusters);
    if largest == expected {
        1.0
    } else {
        (together - expected) / (largest - expected)
    }
}

/// The number of pairs of `n` points.
fn pairs(n: u64) -> f64 {
    let n = n as f64;
    0.5 * n * (n - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ari(a: &[i32], b: &[i32]) -> f64 {
        adjusted_rand_index(&Confusion::of_labels(a, b).unwrap())
    }

    #[track_caller]
    fn check(a: &[i32], b: &[i32], expected: f64) {
        let found = ari(a, b);
        assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
    }

    #[test]
    fn values_computed_by_hand() {
        check(&[0, 0, 1, 1], &[5, 5, 3, 3], 1.0);
        // 6 pairs: 1 is together in both, 2 in the first, 2 in the second; (1 - 4/6) / (2 - 4/6).
        check(&[0, 0, 1, 2], &[0, 0, 1, 1], 0.571_428_571_428_571_4);
        check(&[0, 0, 1, 1], &[0, 1, 0, 1], -0.5);
        check(&[0, 0, 0], &[0, 0, 0], 1.0);
        check(&[0, 1, 2], &[2, 1, 0], 1.0);
        check(&[0, 0, 0, 0], &[0, 0, 1, 1], 0.0);
        // The third point has no label in one of the labelings.
        check(&[0, 0, -1, 1, 1], &[5, 5, 5, 3, 3], 1.0);
        check(&[-1, -1], &[0, 1], 1.0);
    }

    proptest! {
        #[test]
        fn the_index_is_symmetric_and_names_do_not_matter(
            points in proptest::collection::vec((0i32..4, 0i32..4), 2..40)
        ) {
            let (a, b): (Vec<i32>, Vec<i32>) = points.into_iter().unzip();
            let renamed: Vec<i32> = a.iter().map(|label| 40 - 3 * label).collect();
            prop_assert!((ari(&a, &b) - ari(&b, &a)).abs() < 1e-12);
            prop_assert!((ari(&a, &b) - ari(&renamed, &b)).abs() < 1e-12);
            prop_assert!((ari(&a, &a) - 1.0).abs() < 1e-12);
        }
    }
}
