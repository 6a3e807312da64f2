//! Counts the points that each reference part and each predicted cluster have in common.

/// The reason why labels cannot be scored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ScoreError {
    /// The two lists of labels have different lengths.
    #[error(
        "{n_predicted} predicted labels but {n_reference} reference labels; give one of each per point"
    )]
    Length {
        /// The number of predicted labels.
        n_predicted: usize,
        /// The number of reference labels.
        n_reference: usize,
    },
    /// The reference ignores every point.
    #[error("the reference labels none of the points; use a reference that labels at least one")]
    NothingLabeled,
    /// A point belongs to a token that has no embedding.
    #[error("a point belongs to token {token}, but only {n_tokens} tokens have an embedding")]
    Token {
        /// The token of the point.
        token: u32,
        /// The number of tokens that have an embedding.
        n_tokens: usize,
    },
}

impl ScoreError {
    /// Refuses tokens of points that have no embedding.
    pub(crate) fn check_tokens(token_of_point: &[u32], n_tokens: usize) -> Result<(), Self> {
        match token_of_point
            .iter()
            .find(|&&token| token as usize >= n_tokens)
        {
            Some(&token) => Err(Self::Token { token, n_tokens }),
            None => Ok(()),
        }
    }
}

/// The numbers of points by reference part and predicted cluster. Points that the reference ignores are not counted.
///
/// Invariant: every part has at least one point, and every cluster has at least one point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Confusion {
    reference_ids: Vec<i32>,
    predicted_ids: Vec<u32>,
    /// The counts row by row, with one row per part.
    counts: Vec<u64>,
    /// Points of each part that have no predicted cluster.
    unlabeled: Vec<u64>,
}

impl Confusion {
    /// Counts the points. Negative reference labels are ignored.
    ///
    /// # Errors
    /// If the lists differ in length, or the reference ignores every point.
    pub fn new(predicted: &[u32], reference: &[i32]) -> Result<Self, ScoreError> {
        let clusters = predicted.iter().map(|&cluster| Some(cluster));
        Self::of_pairs(clusters, predicted.len(), reference)
    }

    /// Counts the points of two sources, each of which may leave points without a label.
    ///
    /// A negative label of the reference is ignored. A negative label of the prediction is a point that agrees with no
    /// part: it counts as a point of its part, but in no cluster.
    ///
    /// # Errors
    /// If the lists differ in length, or the reference ignores every point.
    pub fn of_labels(predicted: &[i32], reference: &[i32]) -> Result<Self, ScoreError> {
        let clusters = predicted.iter().map(|&label| u32::try_from(label).ok());
        Self::of_pairs(clusters, predicted.len(), reference)
    }

    fn of_pairs(
        predicted: impl Iterator<Item = Option<u32>>,
        n_predicted: usize,
        reference: &[i32],
    ) -> Result<Self, ScoreError> {
        if n_predicted != reference.len() {
            return Err(ScoreError::Length {
                n_predicted,
                n_reference: reference.len(),
            });
        }
        let labeled: Vec<(u32, Option<u32>)> = reference
            .iter()
            .zip(predicted)
            .filter_map(|(&part, cluster)| Some((u32::try_from(part).ok()?, cluster)))
            .collect();
        if labeled.is_empty() {
            return Err(ScoreError::NothingLabeled);
        }

        let parts = Ids::of(labeled.iter().map(|&(part, _)| part));
        let clusters = Ids::of(labeled.iter().filter_map(|&(_, cluster)| cluster));
        let mut counts = vec![0; parts.sorted.len() * clusters.sorted.len()];
        let mut unlabeled = vec![0; parts.sorted.len()];
        for (part, cluster) in labeled {
            let row = parts.index(part);
            match cluster {
                Some(cluster) => counts[row * clusters.sorted.len() + clusters.index(cluster)] += 1,
                None => unlabeled[row] += 1,
            }
        }
        // The labels were not negative before, so this conversion is exact.
        let reference_ids = parts.sorted.iter().map(|&part| part as i32).collect();
        let predicted_ids = clusters.sorted;
        Ok(Self {
            reference_ids,
            predicted_ids,
            counts,
            unlabeled,
        })
    }

    /// The labels of the reference parts that have a point, ascending.
    #[must_use]
    pub fn reference_ids(&self) -> &[i32] {
        &self.reference_ids
    }

    /// The predicted clusters that have a point, ascending.
    #[must_use]
    pub fn predicted_ids(&self) -> &[u32] {
        &self.predicted_ids
    }

    /// The number of points that a part and a cluster have in common, by their indices in the lists of ids.
    #[must_use]
    pub fn count(&self, part: usize, cluster: usize) -> u64 {
        self.counts[part * self.predicted_ids.len() + cluster]
    }

    /// The number of points that are in the part or in the cluster.
    #[must_use]
    pub fn union(&self, part: usize, cluster: usize) -> u64 {
        self.n_of_part(part) + self.n_of_cluster(cluster) - self.count(part, cluster)
    }

    /// The points that a part and a cluster share, divided by those that are in either.
    #[must_use]
    pub fn iou(&self, part: usize, cluster: usize) -> f64 {
        self.count(part, cluster) as f64 / self.union(part, cluster) as f64
    }

    /// Points of the part at this index, with those that have no predicted cluster.
    #[must_use]
    pub fn n_of_part(&self, part: usize) -> u64 {
        let n_clusters = self.predicted_ids.len();
        let labeled: u64 = self.counts[part * n_clusters..][..n_clusters].iter().sum();
        labeled + self.unlabeled[part]
    }

    /// Points of the cluster at this index.
    #[must_use]
    pub fn n_of_cluster(&self, cluster: usize) -> u64 {
        let n_clusters = self.predicted_ids.len();
        self.counts.iter().skip(cluster).step_by(n_clusters).sum()
    }

    /// The number of points that the reference labels.
    #[must_use]
    pub fn n_points(&self) -> u64 {
        self.counts.iter().chain(&self.unlabeled).sum()
    }
}

/// The different labels of a list, ascending.
struct Ids {
    sorted: Vec<u32>,
    /// The index of each label up to the largest, if labels are small numbers, as in most cases.
    index_of: Option<Vec<u32>>,
}

impl Ids {
    /// Up to this label, a table is faster than a search.
    const MAX_OF_TABLE: u32 = 1 << 16;

    fn of(labels: impl Iterator<Item = u32> + Clone) -> Self {
        let largest = labels.clone().max().unwrap_or(0);
        if largest > Self::MAX_OF_TABLE {
            let mut sorted: Vec<u32> = labels.collect();
            sorted.sort_unstable();
            sorted.dedup();
            return Self {
                sorted,
                index_of: None,
            };
        }
        let mut is_there = vec![false; largest as usize + 1];
        labels.for_each(|label| is_there[label as usize] = true);
        let mut index_of = vec![0; is_there.len()];
        let mut sorted = Vec::new();
        for (label, _) in (0..).zip(is_there).filter(|(_, is_there)| *is_there) {
            index_of[label as usize] = sorted.len() as u32;
            sorted.push(label);
        }
        Self {
            sorted,
            index_of: Some(index_of),
        }
    }

    fn index(&self, label: u32) -> usize {
        match &self.index_of {
            Some(table) => table[label as usize] as usize,
            None => self.sorted.partition_point(|&id| id < label),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_counted_by_part_and_cluster() {
        let confusion = Confusion::new(&[9, 9, 4, 4, 7], &[0, 2, 2, 2, -1]).unwrap();
        assert_eq!(
            (confusion.reference_ids(), confusion.predicted_ids()),
            (&[0, 2][..], &[4, 9][..])
        );
        assert_eq!(
            [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(part, cluster)| confusion.count(part, cluster)),
            [0, 1, 2, 1]
        );
        assert_eq!(
            [(0, 1), (1, 0), (1, 1)].map(|(part, cluster)| confusion.union(part, cluster)),
            [2, 3, 4]
        );
        assert_eq!(confusion.n_points(), 4);
    }

    #[test]
    fn labels_may_be_large() {
        let confusion = Confusion::new(&[u32::MAX, 5, u32::MAX], &[i32::MAX, 0, 0]).unwrap();
        assert_eq!(confusion.reference_ids(), [0, i32::MAX]);
        assert_eq!(confusion.predicted_ids(), [5, u32::MAX]);
        assert_eq!(
            [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(part, cluster)| confusion.count(part, cluster)),
            [1, 1, 0, 1]
        );
    }

    #[test]
    fn a_point_without_a_prediction_counts_in_its_part_alone() {
        let confusion = Confusion::of_labels(&[4, -1, -1, 4, 7], &[0, 0, 2, 2, -1]).unwrap();
        assert_eq!(confusion.predicted_ids(), [4]);
        assert_eq!([0, 1].map(|part| confusion.n_of_part(part)), [2, 2]);
        assert_eq!((confusion.n_of_cluster(0), confusion.n_points()), (2, 4));
        assert_eq!(confusion.union(0, 0), 3);

        let nothing = Confusion::of_labels(&[-1, -1], &[0, 1]).unwrap();
        assert_eq!((nothing.predicted_ids().len(), nothing.n_points()), (0, 2));
    }

    #[test]
    fn what_cannot_be_scored_is_refused() {
        assert_eq!(
            Confusion::new(&[0], &[]),
            Err(ScoreError::Length {
                n_predicted: 1,
                n_reference: 0
            })
        );
        assert_eq!(
            Confusion::new(&[0, 1], &[-1, -1]),
            Err(ScoreError::NothingLabeled)
        );
    }
}
