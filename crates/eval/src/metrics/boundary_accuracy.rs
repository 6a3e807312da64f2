//! Computes the accuracy of the points near a boundary between two reference parts, under the matching.

use crate::confusion::Confusion;
use crate::matching::match_clusters;
use crate::metric::{Metric, ScoredShape};

/// Accuracy of the points of which a point of another part is at most [`BOUNDARY_RADIUS`](crate::BOUNDARY_RADIUS) away.
pub const BOUNDARY_ACCURACY: Metric = Metric {
    name: "boundary_accuracy",
    heading: "boundary accuracy",
    value: boundary_accuracy,
};

fn boundary_accuracy(shape: &ScoredShape<'_>) -> Option<f64> {
    let near = shape.near_boundary?;
    let confusion = Confusion::new(shape.predicted, shape.reference).ok()?;
    let matching = match_clusters(&confusion);
    let cluster_of_label = |label: i32| {
        let part = confusion.reference_ids().binary_search(&label).ok()?;
        let cluster = matching.cluster_of_part[part]?;
        Some(confusion.predicted_ids()[cluster])
    };
    let own_cluster: Vec<(i32, Option<u32>)> = confusion
        .reference_ids()
        .iter()
        .map(|&label| (label, cluster_of_label(label)))
        .collect();

    let (mut n_near, mut n_agreeing) = (0usize, 0usize);
    let points = shape.predicted.iter().zip(shape.reference).zip(near);
    for ((&cluster, label), _) in points.filter(|(_, is_near)| **is_near) {
        let Ok(part) = own_cluster.binary_search_by_key(label, |&(label, _)| label) else {
            continue;
        };
        n_near += 1;
        n_agreeing += usize::from(own_cluster[part].1 == Some(cluster));
    }
    (n_near > 0).then(|| n_agreeing as f64 / n_near as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scores::score_clusters;
    use partprobe_carrier::Embeddings;

    #[test]
    fn only_points_near_a_boundary_count() {
        let check = |predicted: &[u32], reference: &[i32], near: &[bool], expected: Option<f64>| {
            let none = Embeddings::from_rows([[0.0]; 0]);
            let matched = score_clusters(predicted, reference).unwrap();
            let shape = ScoredShape {
                near_boundary: Some(near),
                ..ScoredShape::of_clusters(predicted, reference, &[], &none, matched)
            };
            assert_eq!(boundary_accuracy(&shape), expected);
        };
        let reference = [3, 3, 3, 5, 5, 5];
        check(
            &[9, 9, 2, 2, 2, 2],
            &reference,
            &[false, true, true, true, false, false],
            Some(2.0 / 3.0),
        );
        check(&[9, 9, 9, 2, 2, 2], &reference, &[true; 6], Some(1.0));
        check(&[9, 9, 9, 2, 2, 2], &reference, &[false; 6], None);
        check(
            &[9, 9, 9, 2, 2, 2],
            &[3, 3, -1, 5, 5, 5],
            &[false, false, true, false, false, false],
            None,
        );
    }
}
