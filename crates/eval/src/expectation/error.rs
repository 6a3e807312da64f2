//! Lists the reasons why a bound cannot be read or checked.

use crate::metric::Metric;

/// The reason why a bound cannot be read or checked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExpectationError {
    /// The key does not name a score.
    #[error(
        "`{key}` does not name a score; write `supervision/reference.metric`, or two of them with ` - ` between, or \
         `supervision.untouched_tensors`"
    )]
    Key {
        /// The key.
        key: String,
    },
    /// The metric does not exist.
    #[error(
        "`{key}` ends with `{metric}`, which is not a metric; the metrics are {}",
        Metric::known_names()
    )]
    Metric {
        /// The key.
        key: String,
        /// The metric in it.
        metric: String,
    },
    /// The bound is not a comparison with a number.
    #[error(
        "`{value}` is not a bound for `{key}`; write >=, >, <= or < and a number, for example `>= 0.5`"
    )]
    Bound {
        /// The key.
        key: String,
        /// The text of the bound.
        value: String,
    },
    /// The supervision, reference or clusterer is not part of the run.
    #[error("`{key}` names `{name}`, which this run does not have; it has {known}")]
    UnknownName {
        /// The key.
        key: String,
        /// The name in it.
        name: String,
        /// The names that the run has.
        known: String,
    },
    /// The run has no such number, for example no nearest ground-truth centroid (GTc) without a network.
    #[error("`{key}` asks for `{score}`, but this run has no value of it")]
    NoValue {
        /// The key.
        key: String,
        /// The score in it.
        score: String,
    },
}
