//! Matches predicted clusters to reference parts so that as many points as possible agree (paper §4.8).
//!
//! This is the assignment problem. The Hungarian algorithm solves it (Kuhn 1955, "The Hungarian method for the
//! assignment problem"; Munkres 1957, "Algorithms for the assignment and transportation problems"). The crate
//! pathfinding has the implementation.

use crate::confusion::Confusion;
use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;

/// The number of steps into which an IoU is divided. The IoU decides between matchings with the same number of points.
const IOU_STEPS: i128 = 1 << 30;

/// A one-to-one assignment of clusters to parts, by their indices in a [`Confusion`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Matching {
    /// The cluster of each part, or `None` if no cluster is left that shares a point with it.
    pub cluster_of_part: Vec<Option<usize>>,
}

/// Matches clusters to parts so that as many points as possible agree.
///
/// If several matchings are equal, the sum of the IoUs decides (each to 2⁻³⁰). If that is equal too, low ids are matched to low
/// ids.
#[must_use]
pub fn match_clusters(confusion: &Confusion) -> Matching {
    let mut cluster_of_part = best_assignment(confusion);
    for (part, cluster) in cluster_of_part.iter_mut().enumerate() {
        *cluster = cluster.filter(|&cluster| confusion.count(part, cluster) > 0);
    }
    Matching { cluster_of_part }
}

/// The assignment with the largest sum of weights, pairs without a common point included.
fn best_assignment(confusion: &Confusion) -> Vec<Option<usize>> {
    let n_parts = confusion.reference_ids().len();
    let n_clusters = confusion.predicted_ids().len();
    let mut cluster_of_part = vec![None; n_parts];
    if n_clusters == 0 {
        return cluster_of_part;
    }

    // The algorithm needs at least as many columns as rows.
    if n_parts <= n_clusters {
        let weights = Matrix::from_fn(n_parts, n_clusters, |(part, cluster)| {
            pair_weight(confusion, part, cluster)
        });
        let (_, clusters) = kuhn_munkres(&weights);
        for (part, cluster) in clusters.into_iter().enumerate() {
            cluster_of_part[part] = Some(cluster);
        }
    } else {
        let weights = Matrix::from_fn(n_clusters, n_parts, |(cluster, part)| {
            pair_weight(confusion, part, cluster)
        });
        let (_, parts) = kuhn_munkres(&weights);
        for (cluster, part) in parts.into_iter().enumerate() {
            cluster_of_part[part] = Some(cluster);
        }
    }
    cluster_of_part
}

/// Count, IoU and ids in one integer. A sum of lower terms cannot outweigh one unit of a higher term.
fn pair_weight(confusion: &Confusion, part: usize, cluster: usize) -> i128 {
    let common = i128::from(confusion.count(part, cluster));
    if common == 0 {
        return 0;
    }
    let n_parts = confusion.reference_ids().len() as i128;
    let n_clusters = confusion.predicted_ids().len() as i128;
    let n_pairs = n_parts.min(n_clusters);

    let iou = common * IOU_STEPS / i128::from(confusion.union(part, cluster));
    // The sum of products of reversed ids is largest if low ids meet low ids.
    let low_ids = (n_parts - part as i128) * (n_clusters - cluster as i128);

    let one_iou_step = n_pairs * n_parts * n_clusters + 1;
    let one_point = n_pairs * IOU_STEPS * one_iou_step + one_iou_step;
    common * one_point + iou * one_iou_step + low_ids
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn confusion(counts: &[&[u64]]) -> Confusion {
        let (mut predicted, mut reference) = (Vec::new(), Vec::new());
        for (part, row) in (0..).zip(counts) {
            for (cluster, &count) in (0..).zip(*row) {
                predicted.extend((0..count).map(|_| cluster));
                reference.extend((0..count).map(|_| part));
            }
        }
        Confusion::new(&predicted, &reference).unwrap()
    }

    #[track_caller]
    fn check(counts: &[&[u64]], expected: &[Option<usize>]) {
        assert_eq!(match_clusters(&confusion(counts)).cluster_of_part, expected);
    }

    #[test]
    fn the_most_points_agree() {
        check(&[&[5]], &[Some(0)]);
        check(&[&[1, 4], &[5, 0]], &[Some(1), Some(0)]);
        // Taking the largest entry first would leave 9 + 0 points; 8 + 8 is more.
        check(&[&[9, 8], &[8, 0]], &[Some(1), Some(0)]);
        check(&[&[3], &[4], &[2]], &[None, Some(0), None]);
        check(&[&[3, 4, 2]], &[Some(1)]);
        // The second part shares no point with the cluster that is left.
        check(&[&[5, 0], &[3, 0], &[0, 2]], &[Some(0), None, Some(1)]);
    }

    #[test]
    fn ties_are_broken_by_iou_and_then_by_low_ids() {
        // Cluster 0 or 1 gives part 0 four points; cluster 1 has no point of another part.
        check(&[&[4, 4, 0], &[3, 0, 7]], &[Some(1), Some(2)]);
        check(&[&[2, 2]], &[Some(0)]);
        check(&[&[2], &[2]], &[Some(0), None]);
        check(&[&[4, 4], &[4, 4]], &[Some(0), Some(1)]);
        check(&[&[3, 2, 3], &[0, 6, 0]], &[Some(0), Some(1)]);
    }

    /// The best of all assignments: most points, then the largest sum of IoUs.
    fn by_brute_force(confusion: &Confusion) -> (u64, f64) {
        fn extend(confusion: &Confusion, part: usize, taken: &mut Vec<bool>) -> (u64, f64) {
            if part == confusion.reference_ids().len() {
                return (0, 0.0);
            }
            let mut best = extend(confusion, part + 1, taken);
            for cluster in 0..taken.len() {
                if std::mem::replace(&mut taken[cluster], true) {
                    continue;
                }
                let (points, ious) = extend(confusion, part + 1, taken);
                taken[cluster] = false;
                let (common, union) = (
                    confusion.count(part, cluster),
                    confusion.union(part, cluster),
                );
                let (points, ious) = (points + common, ious + common as f64 / union as f64);
                if best.0 < points || (best.0 == points && best.1 < ious) {
                    best = (points, ious);
                }
            }
            best
        }
        extend(
            confusion,
            0,
            &mut vec![false; confusion.predicted_ids().len()],
        )
    }

    proptest! {
        #[test]
        fn no_assignment_is_better(points in proptest::collection::vec((0u32..5, 0i32..5), 1..40)) {
            let (predicted, reference): (Vec<u32>, Vec<i32>) = points.into_iter().unzip();
            let confusion = Confusion::new(&predicted, &reference).unwrap();
            let matching = match_clusters(&confusion);
            let pairs = matching.cluster_of_part.iter().enumerate().filter_map(|(part, &cluster)| Some((part, cluster?)));
            let (mut points, mut ious) = (0, 0.0);
            for (part, cluster) in pairs {
                points += confusion.count(part, cluster);
                ious += confusion.count(part, cluster) as f64 / confusion.union(part, cluster) as f64;
            }
            let best = by_brute_force(&confusion);
            prop_assert_eq!(points, best.0);
            prop_assert!((ious - best.1).abs() < 1e-8);
        }
    }
}
