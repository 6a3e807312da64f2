//! Runs the paper's test: clusters the embeddings into as many groups as the reference has parts, then matches and
//! scores.

use crate::confusion::{Confusion, ScoreError};
use crate::scores::{ShapeScores, score_clusters};
use partprobe_carrier::Embeddings;
use partprobe_cluster::{ClusterError, Clusterer};

/// The embedded tokens of one shape, and the token of each of its points.
#[derive(Clone, Copy, Debug)]
pub struct TokenizedShape<'a> {
    /// The id of the shape. It is a key of the random numbers.
    pub id: &'a str,
    /// One embedding per token.
    pub embeddings: &'a Embeddings,
    /// The number of points of each token.
    pub multiplicity: &'a [u32],
    /// The token of each point.
    pub token_of_point: &'a [u32],
}

/// The clusters of the points, and their scores.
#[derive(Clone, Debug, PartialEq)]
pub struct OracleScores {
    /// The cluster of each point.
    pub predicted: Vec<u32>,
    /// The scores under the matching.
    pub scores: ShapeScores,
}

/// The reason why a shape could not be clustered or scored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OracleError {
    /// The tokens cannot be clustered.
    #[error(transparent)]
    Cluster(#[from] ClusterError),
    /// The clusters cannot be scored.
    #[error(transparent)]
    Score(#[from] ScoreError),
}

/// Clusters the tokens, with their multiplicities, into as many groups as `reference` has parts among the points,
/// gives each point its token's cluster, and scores all points.
///
/// The clusterer's random numbers depend on `seed` and on the id of the shape.
///
/// # Errors
/// If lists differ in length, a number is not finite, or the reference ignores every point.
pub fn score_oracle_k(
    shape: &TokenizedShape<'_>,
    reference: &[i32],
    clusterer: &dyn Clusterer,
    seed: u64,
) -> Result<OracleScores, OracleError> {
    ScoreError::check_tokens(shape.token_of_point, shape.embeddings.n_rows())?;
    let k = Confusion::new(shape.token_of_point, reference)?
        .reference_ids()
        .len();
    let clusters = clusterer.cluster(shape.embeddings, shape.multiplicity, k, seed, shape.id)?;
    let predicted: Vec<u32> = shape
        .token_of_point
        .iter()
        .map(|&token| clusters.assignment[token as usize])
        .collect();
    let scores = score_clusters(&predicted, reference)?;
    Ok(OracleScores { predicted, scores })
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_cluster::{AverageLink, CLUSTERERS, ClustererSettings};

    const SETTINGS: ClustererSettings = ClustererSettings {
        restarts: 10,
        max_iterations: 100,
        tolerance: 1e-6,
    };

    #[test]
    fn one_hot_embeddings_are_scored_perfectly_by_every_clusterer() {
        let embeddings = Embeddings::new(
            3,
            vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0],
        )
        .unwrap();
        let shape = TokenizedShape {
            id: "a",
            embeddings: &embeddings,
            multiplicity: &[2, 1, 1, 1],
            token_of_point: &[0, 0, 1, 2, 3],
        };
        for factory in CLUSTERERS {
            let clusterer = (factory.make)(&SETTINGS);
            let found = score_oracle_k(&shape, &[4, 4, 2, 7, 2], clusterer.as_ref(), 0).unwrap();
            assert_eq!(
                (found.scores.k, found.scores.miou, found.scores.accuracy),
                (3, 1.0, 1.0)
            );
            assert_eq!(found.predicted[2], found.predicted[4]);
        }
    }

    #[test]
    fn a_token_without_embedding_is_refused() {
        let embeddings = Embeddings::new(1, vec![1.0]).unwrap();
        let shape = TokenizedShape {
            id: "a",
            embeddings: &embeddings,
            multiplicity: &[1],
            token_of_point: &[1],
        };
        let expected = OracleError::Score(ScoreError::Token {
            token: 1,
            n_tokens: 1,
        });
        assert_eq!(score_oracle_k(&shape, &[0], &AverageLink, 0), Err(expected));
    }
}
