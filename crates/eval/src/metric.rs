//! Defines a metric: a named number of one scored shape, which tables average.

use crate::gtc::Gtc;
use crate::scores::ShapeScores;
use partprobe_carrier::Embeddings;
use serde::{Serialize, Serializer};
use std::fmt;

/// The data of one shape under one supervision, reference and clusterer that a metric can read.
#[derive(Clone, Copy, Debug)]
pub struct ScoredShape<'a> {
    /// The predicted cluster of each point.
    pub predicted: &'a [u32],
    /// The reference label of each point. Negative labels are ignored.
    pub reference: &'a [i32],
    /// The token of each point.
    pub token_of_point: &'a [u32],
    /// The embedding of each token.
    pub embeddings: &'a Embeddings,
    /// The scores under the matching of clusters to parts.
    pub matched: ShapeScores,
    /// The scores of the nearest ground-truth centroid (GTc), or `None` without embeddings.
    pub gtc: Option<Gtc>,
    /// The same with centers from the other half of the tokens ([`split_gtc`](crate::split_gtc)), if there are any.
    pub split_gtc: Option<Gtc>,
    /// The best cut of the average-link tree of the embeddings ([`best_cut_ari`](crate::best_cut_ari)), or `None` if it was
    /// not computed.
    pub best_cut_ari: Option<f64>,
    /// Whether each point is near a boundary ([`near_boundary`](crate::near_boundary)), or `None` if positions are not known.
    pub near_boundary: Option<&'a [bool]>,
}

impl<'a> ScoredShape<'a> {
    /// Clusters without embeddings, or with embeddings that are not scored.
    #[must_use]
    pub fn of_clusters(
        predicted: &'a [u32],
        reference: &'a [i32],
        token_of_point: &'a [u32],
        embeddings: &'a Embeddings,
        matched: ShapeScores,
    ) -> Self {
        Self {
            predicted,
            reference,
            token_of_point,
            embeddings,
            matched,
            gtc: None,
            split_gtc: None,
            best_cut_ari: None,
            near_boundary: None,
        }
    }
}

/// A number that measures how well the clusters or the embeddings of a shape agree with its reference parts.
///
/// Two metrics are equal if they have the same name. They are ordered as in [`METRICS`](crate::METRICS). Metrics that
/// are not in the list come after it, by their names.
#[derive(Clone, Copy)]
pub struct Metric {
    /// The name in files and in `[expect]`.
    pub name: &'static str,
    /// The heading in tables.
    pub heading: &'static str,
    /// Computes the value, or `None` if the shape has none, for example without embeddings.
    pub value: fn(&ScoredShape<'_>) -> Option<f64>,
}

impl fmt::Debug for Metric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Metric {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Metric {}

impl Serialize for Metric {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name)
    }
}
