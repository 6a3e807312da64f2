//! Computes the mean IoU over the parts that have enough points, under the matching of all parts.

use crate::confusion::Confusion;
use crate::matching::match_clusters;
use crate::metric::Metric;

/// Mean IoU of the parts with at least 20 points. The clusters and their matching are those of the mIoU of all parts.
pub const MIOU_LARGE: Metric = Metric {
    name: "miou_large",
    heading: "mIoU, parts ≥ 20 points",
    value: |shape| {
        let confusion = Confusion::new(shape.predicted, shape.reference).ok()?;
        miou_of_large(&confusion)
    },
};

/// A part with fewer points is smaller than what a point sample resolves.
const LEAST_POINTS: u64 = 20;

fn miou_of_large(confusion: &Confusion) -> Option<f64> {
    let matching = match_clusters(confusion);
    let parts = (0..).zip(&matching.cluster_of_part);
    let ious: Vec<f64> = parts
        .filter(|&(part, _)| confusion.n_of_part(part) >= LEAST_POINTS)
        .map(|(part, cluster)| cluster.map_or(0.0, |cluster| confusion.iou(part, cluster)))
        .collect();
    (!ious.is_empty()).then(|| ious.iter().sum::<f64>() / ious.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_fewer_than_20_points_are_left_out() {
        let of = |predicted: &[u32], reference: &[i32]| {
            miou_of_large(&Confusion::new(predicted, reference).unwrap())
        };
        // Part 0 has 20 points. Part 1 has 19 and is left out.
        let reference: Vec<i32> = (0..39).map(|point| i32::from(point >= 20)).collect();
        assert_eq!(of(&[4; 39], &reference), Some(20.0 / 39.0));
        assert_eq!(of(&[4; 19], &reference[20..]), None);
    }
}
