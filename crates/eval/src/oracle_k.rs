//! The paper's test: cluster the embeddings into as many groups as the reference has parts, then match and score.

use crate::{Confusion, ScoreError, ShapeScores, score_clusters};
use carrier::Embeddings;
use cluster::{ClusterError, Clusters, KMeansSettings, average_link_cosine, spherical_kmeans};
use serde::{Deserialize, Serialize};

/// The algorithms that turn embeddings into a given number of clusters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Clusterer {
    /// Spherical k-means: the paper's column.
    KMeans,
    /// Average link on cosines: does not split large parts to spare small ones.
    AverageLink,
}

impl Clusterer {
    /// The name in score files and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::KMeans => "k-means",
            Self::AverageLink => "average-link",
        }
    }
}

/// The settings of k-means, but for the number of clusters; average link has none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleSettings {
    /// The best of this many restarts counts.
    pub restarts: usize,
    /// No restart iterates more often than this.
    pub max_iterations: usize,
    /// A restart ends when no centre moves further than this.
    pub tolerance: f64,
    /// Seed of the restarts; each shape has its own random numbers.
    pub seed: u64,
}

/// The embedded tokens of one shape, and the token of each of its points.
#[derive(Clone, Copy, Debug)]
pub struct TokenizedShape<'a> {
    /// The id of the shape; it keys the random numbers.
    pub id: &'a str,
    /// One embedding for each token.
    pub embeddings: &'a Embeddings,
    /// How many points each token stands for.
    pub multiplicity: &'a [u32],
    /// The token of each point.
    pub token_of_point: &'a [u32],
}

/// The clusters of the points and what they score.
#[derive(Clone, Debug, PartialEq)]
pub struct OracleScores {
    /// The cluster of each point.
    pub predicted: Vec<u32>,
    /// The scores under the matching.
    pub scores: ShapeScores,
}

/// Why a shape could not be clustered or scored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
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
/// # Errors
/// If lists differ in length, a number is not finite, or the reference ignores every point.
pub fn score_oracle_k(
    shape: &TokenizedShape<'_>,
    reference: &[i32],
    clusterer: Clusterer,
    settings: &OracleSettings,
) -> Result<OracleScores, OracleError> {
    let n_tokens = shape.embeddings.n_rows();
    if let Some(&token) = shape.token_of_point.iter().find(|&&token| token as usize >= n_tokens) {
        return Err(ScoreError::Token { token, n_tokens }.into());
    }
    let k = Confusion::new(shape.token_of_point, reference)?.reference_ids().len();
    let clusters = clusters_of(shape, k, clusterer, settings)?;
    let predicted: Vec<u32> = shape.token_of_point.iter().map(|&token| clusters.assignment[token as usize]).collect();
    let scores = score_clusters(&predicted, reference)?;
    Ok(OracleScores { predicted, scores })
}

fn clusters_of(
    shape: &TokenizedShape<'_>,
    k: usize,
    clusterer: Clusterer,
    settings: &OracleSettings,
) -> Result<Clusters, ClusterError> {
    match clusterer {
        Clusterer::AverageLink => average_link_cosine(shape.embeddings, shape.multiplicity, k),
        Clusterer::KMeans => {
            let OracleSettings { restarts, max_iterations, tolerance, seed } = *settings;
            let settings = KMeansSettings { k, restarts, max_iterations, tolerance };
            spherical_kmeans(shape.embeddings, shape.multiplicity, &settings, seed, shape.id)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: OracleSettings = OracleSettings { restarts: 10, max_iterations: 100, tolerance: 1e-6, seed: 0 };

    #[test]
    fn one_hot_embeddings_are_scored_perfectly_by_every_clusterer() {
        let embeddings = Embeddings::new(3, vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0]).unwrap();
        let shape = TokenizedShape {
            id: "a",
            embeddings: &embeddings,
            multiplicity: &[2, 1, 1, 1],
            token_of_point: &[0, 0, 1, 2, 3],
        };
        for clusterer in [Clusterer::KMeans, Clusterer::AverageLink] {
            let found = score_oracle_k(&shape, &[4, 4, 2, 7, 2], clusterer, &SETTINGS).unwrap();
            assert_eq!((found.scores.k, found.scores.miou, found.scores.accuracy), (3, 1.0, 1.0));
            assert_eq!(found.predicted[2], found.predicted[4]);
        }
    }

    #[test]
    fn a_token_without_embedding_is_refused() {
        let embeddings = Embeddings::new(1, vec![1.0]).unwrap();
        let shape = TokenizedShape { id: "a", embeddings: &embeddings, multiplicity: &[1], token_of_point: &[1] };
        let expected = OracleError::Score(ScoreError::Token { token: 1, n_tokens: 1 });
        assert_eq!(score_oracle_k(&shape, &[0], Clusterer::KMeans, &SETTINGS), Err(expected));
    }
}
