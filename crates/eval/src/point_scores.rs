//! Scores predictions of any program for the points of a shape: clusters, or embeddings with one row per point.
//!
//! Predictions and reference labels go in, and the metrics of the list come out. Equal rows are clustered as one, with the number
//! of their points.

use crate::best_cut::best_cut_ari;
use crate::confusion::ScoreError;
use crate::gtc::{gtc, split_gtc};
use crate::metric::{Metric, ScoredShape};
use crate::oracle_k::{OracleError, TokenizedShape, score_oracle_k};
use crate::scores::{clusters_of_labels, score_clusters};
use partprobe_carrier::{Embeddings, EmbeddingsError};
use partprobe_cluster::{AverageLinkTree, Clusterer};
use std::collections::{BTreeMap, HashMap};

/// The largest number of rows for which the best cut is computed. The time of the tree grows with the square of the number of
/// rows.
const MAX_ROWS_OF_TREE: usize = 4096;

/// The scores of the points of one shape.
#[derive(Clone, Debug, PartialEq)]
pub struct PointScores {
    /// The number of reference parts that have a point.
    pub k: usize,
    /// The value of each metric that has one.
    pub scores: BTreeMap<Metric, f64>,
}

impl PointScores {
    fn of(scored: &ScoredShape<'_>) -> Self {
        Self {
            k: scored.matched.k,
            scores: scored.scores(),
        }
    }

    /// The scores of predicted clusters. Points with a negative cluster form one additional cluster, which agrees with at most
    /// one part.
    ///
    /// `near_boundary` says for each point whether it is near a boundary of the reference, if positions are known.
    ///
    /// # Errors
    /// If the lists differ in length, or the reference ignores every point.
    pub fn of_clusters(
        predicted: &[i32],
        reference: &[i32],
        near_boundary: Option<&[bool]>,
    ) -> Result<Self, ScoreError> {
        let clusters = clusters_of_labels(predicted);
        let none = Embeddings::from_rows([[0.0]; 0]);
        let matched = score_clusters(&clusters, reference)?;
        Ok(Self::of(&ScoredShape {
            near_boundary,
            ..ScoredShape::of_clusters(&clusters, reference, &[], &none, matched)
        }))
    }
}

/// The embeddings of points, each different row once. Points of one token usually have equal rows.
#[derive(Clone, Debug, PartialEq)]
pub struct PointEmbeddings {
    rows: Embeddings,
    row_of_point: Vec<u32>,
    /// How many points have each row.
    multiplicity: Vec<u32>,
}

impl PointEmbeddings {
    /// Takes the values of a matrix with a row of `dim` numbers per point.
    ///
    /// # Errors
    /// If `dim` is 0 or does not divide the number of values.
    pub fn new(dim: usize, values: &[f32]) -> Result<Self, EmbeddingsError> {
        let mut index_of_row: HashMap<Vec<u32>, u32> = HashMap::new();
        let mut distinct = Vec::new();
        let mut multiplicity: Vec<u32> = Vec::new();
        let mut row_of_point = Vec::new();
        let all = Embeddings::new(dim, values.to_vec())?;
        for row in all.rows() {
            let bits = row.iter().map(|x| x.to_bits()).collect();
            let index = *index_of_row.entry(bits).or_insert_with(|| {
                distinct.extend_from_slice(row);
                multiplicity.push(0);
                (multiplicity.len() - 1) as u32
            });
            multiplicity[index as usize] += 1;
            row_of_point.push(index);
        }
        Ok(Self {
            rows: Embeddings::new(dim, distinct)?,
            row_of_point,
            multiplicity,
        })
    }

    /// How many points there are.
    #[must_use]
    pub fn n_points(&self) -> usize {
        self.row_of_point.len()
    }

    /// Clusters the rows into as many clusters as the reference has parts, and scores the clusters and the rows.
    ///
    /// The random numbers of the clusterer depend on `id` and `seed`. `near_boundary` is as for [`PointScores::of_clusters`].
    ///
    /// # Errors
    /// If there is not one row per point, a number is not finite, or the reference ignores every point.
    pub fn score(
        &self,
        id: &str,
        reference: &[i32],
        near_boundary: Option<&[bool]>,
        clusterer: &dyn Clusterer,
        seed: u64,
    ) -> Result<PointScores, OracleError> {
        let (rows, row_of_point) = (&self.rows, &self.row_of_point);
        let tokenized = TokenizedShape {
            id,
            embeddings: rows,
            multiplicity: &self.multiplicity,
            token_of_point: row_of_point,
        };
        let found = score_oracle_k(&tokenized, reference, clusterer, seed)?;
        let best_cut = if rows.n_rows() <= MAX_ROWS_OF_TREE {
            let tree = AverageLinkTree::new(rows, &self.multiplicity)?;
            Some(best_cut_ari(&tree, row_of_point, reference)?)
        } else {
            None
        };
        let clusters = ScoredShape::of_clusters(
            &found.predicted,
            reference,
            row_of_point,
            rows,
            found.scores,
        );
        Ok(PointScores::of(&ScoredShape {
            gtc: Some(gtc(rows, row_of_point, reference)?),
            split_gtc: split_gtc(rows, row_of_point, reference)?,
            best_cut_ari: best_cut,
            near_boundary,
            ..clusters
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ACCURACY, GTC_MIOU, MIOU};
    use partprobe_cluster::AverageLink;

    #[test]
    fn equal_rows_are_one_with_the_number_of_its_points() {
        let embedded = PointEmbeddings::new(2, &[1.0, 0.0, 0.0, 1.0, 1.0, 0.0]).unwrap();
        assert_eq!(embedded.rows.values(), [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(embedded.row_of_point, [0, 1, 0]);
        assert_eq!(embedded.multiplicity, [2, 1]);
        assert_eq!(embedded.n_points(), 3);
        assert!(PointEmbeddings::new(2, &[1.0]).is_err());
    }

    #[test]
    fn perfect_embeddings_and_clusters_have_perfect_scores() {
        let reference = [4, 4, 2, -1];
        let rows = [1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0];
        let embedded = PointEmbeddings::new(2, &rows).unwrap();
        let of_rows = embedded
            .score("a", &reference, None, &AverageLink, 0)
            .unwrap();
        let of_clusters = PointScores::of_clusters(&[7, 7, -1, 3], &reference, None).unwrap();
        for found in [&of_rows, &of_clusters] {
            assert_eq!(
                (found.k, found.scores[&MIOU], found.scores[&ACCURACY]),
                (2, 1.0, 1.0)
            );
        }
        assert_eq!(of_rows.scores[&GTC_MIOU], 1.0);
        assert!(!of_clusters.scores.contains_key(&GTC_MIOU));
    }

    #[test]
    fn lists_of_different_lengths_are_refused() {
        assert!(PointScores::of_clusters(&[0], &[0, 1], None).is_err());
        let embedded = PointEmbeddings::new(1, &[1.0]).unwrap();
        assert!(embedded.score("a", &[0, 1], None, &AverageLink, 0).is_err());
    }
}
