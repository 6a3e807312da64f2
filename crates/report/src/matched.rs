//! Matches the clusters of one prediction to the reference parts, and finds the main loss of each part.

use partprobe_eval::{Confusion, match_clusters};

/// The main cause of the loss of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Loss {
    /// Nothing was lost.
    Nothing,
    /// Most wrong points are points of the part in the cluster of another part.
    MergedInto(usize),
    /// Most wrong points are points of another part in the cluster of the part.
    TakesIn(usize),
    /// Most wrong points are points of the part in a cluster that belongs to no part.
    Split,
}

/// A prediction whose clusters are numbered by the parts to which they were matched.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MatchedPrediction {
    /// For each point, the index of the part to which its cluster was matched. The indices of clusters without a part begin at
    /// the number of parts.
    pub(crate) part_of_point: Vec<u32>,
    /// The IoU of each part with its cluster. It is 0 without a cluster.
    pub(crate) iou: Vec<f64>,
    /// The loss of each part.
    pub(crate) loss: Vec<Loss>,
}

impl MatchedPrediction {
    /// Matches in the same way as the scores (paper section 4.8). Returns `None` if the labels cannot be scored.
    ///
    /// Parts are the labels of the reference that have a point, in ascending order.
    pub(crate) fn of(clusters: &[i32], reference: &[i32]) -> Option<Self> {
        let clusters: Vec<u32> = clusters
            .iter()
            .map(|&cluster| cluster.max(0) as u32)
            .collect();
        let confusion = Confusion::new(&clusters, reference).ok()?;
        let cluster_of_part = match_clusters(&confusion).cluster_of_part;
        let n_parts = cluster_of_part.len();

        let mut part_of_cluster = vec![None; confusion.predicted_ids().len()];
        for (part, cluster) in cluster_of_part.iter().enumerate() {
            if let Some(cluster) = cluster {
                part_of_cluster[*cluster] = Some(part);
            }
        }
        let mut n_free = 0;
        let number: Vec<u32> = part_of_cluster
            .iter()
            .map(|part| match part {
                Some(part) => *part as u32,
                None => {
                    n_free += 1;
                    (n_parts + n_free - 1) as u32
                }
            })
            .collect();
        // A cluster with only points without a reference label is in no list. It does not belong to a part either.
        let last = (n_parts + n_free) as u32;
        let numbered = |cluster: &u32| {
            let found = confusion.predicted_ids().binary_search(cluster);
            found.map_or(last, |idx| number[idx])
        };
        let iou = |(part, cluster): (usize, &Option<usize>)| {
            cluster.map_or(0.0, |cluster| confusion.iou(part, cluster))
        };
        Some(Self {
            part_of_point: clusters.iter().map(numbered).collect(),
            iou: cluster_of_part.iter().enumerate().map(iou).collect(),
            loss: (0..n_parts)
                .map(|part| loss_of(&confusion, part, cluster_of_part[part], &part_of_cluster))
                .collect(),
        })
    }

    /// The mean IoU over the parts.
    pub(crate) fn miou(&self) -> f64 {
        self.iou.iter().sum::<f64>() / self.iou.len().max(1) as f64
    }
}

fn loss_of(
    confusion: &Confusion,
    part: usize,
    own: Option<usize>,
    part_of_cluster: &[Option<usize>],
) -> Loss {
    let n_clusters = confusion.predicted_ids().len();
    let elsewhere = (0..n_clusters).filter(|&cluster| Some(cluster) != own);
    let largest = elsewhere
        .map(|cluster| (confusion.count(part, cluster), cluster))
        .max_by_key(|&(count, cluster)| (count, std::cmp::Reverse(cluster)));
    let n_parts = confusion.reference_ids().len();
    let guests = own.and_then(|own| {
        let others = (0..n_parts).filter(|&other| other != part);
        others
            .map(|other| (confusion.count(other, own), other))
            .max_by_key(|&(count, other)| (count, std::cmp::Reverse(other)))
    });
    let n_inside = own.map_or(0, |own| confusion.count(part, own));
    let n_missing = confusion.n_of_part(part) - n_inside;
    let n_extra = own.map_or(0, |own| confusion.n_of_cluster(own) - n_inside);
    match (largest, guests) {
        _ if n_missing == 0 && n_extra == 0 => Loss::Nothing,
        (_, Some((_, other))) if n_extra > n_missing => Loss::TakesIn(other),
        (Some((_, cluster)), _) => part_of_cluster[cluster].map_or(Loss::Split, Loss::MergedInto),
        _ => Loss::Split,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(clusters: &[i32], reference: &[i32], parts: &[u32], iou: &[f64], loss: &[Loss]) {
        let found = MatchedPrediction::of(clusters, reference).unwrap();
        assert_eq!((&found.part_of_point[..], &found.iou[..]), (parts, iou));
        assert_eq!(found.loss, loss);
    }

    #[test]
    fn clusters_take_the_numbers_of_their_parts() {
        use Loss::{MergedInto, Nothing, Split, TakesIn};
        check(
            &[7, 7, 2],
            &[4, 4, 9],
            &[0, 0, 1],
            &[1.0, 1.0],
            &[Nothing; 2],
        );
        // One cluster for both parts.
        check(
            &[5, 5, 5],
            &[0, 0, 1],
            &[0, 0, 0],
            &[2.0 / 3.0, 0.0],
            &[TakesIn(1), MergedInto(0)],
        );
        // Two clusters for one part, and a point that the reference does not label.
        check(
            &[0, 0, 1, 3],
            &[0, 0, 0, -1],
            &[0, 0, 1, 2],
            &[2.0 / 3.0],
            &[Split],
        );
        assert_eq!(MatchedPrediction::of(&[0], &[-1]), None);
        assert_eq!(MatchedPrediction::of(&[0], &[0, 1]), None);
    }
}
