//! Defines the result of a clustering, and the reasons why rows cannot be clustered.

use partprobe_carrier::Embeddings;

/// The cluster of each row.
#[derive(Clone, Debug, PartialEq)]
pub struct Clusters {
    /// The cluster of each row, from 0 to `k_found - 1`. Clusters are numbered in the order of their first rows.
    pub assignment: Vec<u32>,
    /// The number of clusters. It is smaller than the requested number if there are fewer different rows.
    pub k_found: usize,
    /// The value that the algorithm minimizes. For k-means it is the sum, over points, of the squared distance to the center. For
    /// average link it is the sum of `1 - mean cosine` over the merges.
    pub objective: f64,
}

/// The reason why rows cannot be clustered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ClusterError {
    /// The number of multiplicities differs from the number of rows.
    #[error("{n_weights} multiplicities were given for {n_rows} rows; give one per row")]
    Weights {
        /// The number of multiplicities.
        n_weights: usize,
        /// The number of rows.
        n_rows: usize,
    },
    /// A row contains an infinity or a NaN.
    #[error("row {row} contains a number that is not finite; the training may have diverged")]
    NotFinite {
        /// The index of the row.
        row: usize,
    },
    /// 0 clusters were requested.
    #[error("0 clusters were asked for; ask for at least 1")]
    NoClusters,
}

impl Clusters {
    /// Refuses input that no algorithm can cluster. Every clusterer calls it first.
    ///
    /// # Errors
    /// If the number of weights is not the number of rows, a number is not finite, or `k` is 0.
    pub fn check_input(rows: &Embeddings, weights: &[u32], k: usize) -> Result<(), ClusterError> {
        if k == 0 {
            return Err(ClusterError::NoClusters);
        }
        if weights.len() != rows.n_rows() {
            return Err(ClusterError::Weights {
                n_weights: weights.len(),
                n_rows: rows.n_rows(),
            });
        }
        match rows.values().iter().position(|value| !value.is_finite()) {
            Some(at) => Err(ClusterError::NotFinite {
                row: at / rows.dim(),
            }),
            None => Ok(()),
        }
    }

    /// Makes clusters of the groups in `raw`, one per row, renumbered in the order of the groups' first rows.
    #[must_use]
    pub fn numbered(raw: &[u32], objective: f64) -> Self {
        let mut ids = std::collections::BTreeMap::new();
        let mut assignment = Vec::with_capacity(raw.len());
        for group in raw {
            let next = ids.len() as u32;
            assignment.push(*ids.entry(group).or_insert(next));
        }
        Self {
            assignment,
            k_found: ids.len(),
            objective,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_clustered_is_refused() {
        let rows = |values: &[f32]| Embeddings::new(1, values.to_vec()).unwrap();
        assert_eq!(
            Clusters::check_input(&rows(&[1.0]), &[1], 0),
            Err(ClusterError::NoClusters)
        );
        assert_eq!(
            Clusters::check_input(&rows(&[1.0, 2.0]), &[1], 1),
            Err(ClusterError::Weights {
                n_weights: 1,
                n_rows: 2
            })
        );
        assert_eq!(
            Clusters::check_input(&rows(&[1.0, f32::NAN]), &[1, 1], 1),
            Err(ClusterError::NotFinite { row: 1 })
        );
        assert_eq!(Clusters::check_input(&rows(&[]), &[], 1), Ok(()));
    }

    #[test]
    fn groups_are_numbered_by_their_first_rows() {
        let clusters = Clusters::numbered(&[7, 2, 7, 0], 0.5);
        assert_eq!(
            clusters,
            Clusters {
                assignment: vec![0, 1, 0, 2],
                k_found: 3,
                objective: 0.5
            }
        );
    }
}
