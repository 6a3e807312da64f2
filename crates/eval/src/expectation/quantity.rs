//! Lists the quantities that a bound may limit: a score of the tables, or a figure of a training.

use super::error::ExpectationError;
use crate::metric::Metric;
use crate::tables::{TableRow, Tables};
use std::collections::BTreeMap;
use std::fmt;

/// The name of [`TrainingFigures::untouched_tensors`] in a key.
const UNTOUCHED_TENSORS: &str = "untouched_tensors";

/// Figures of the trainings by supervision. If there are several seeds, the worst value counts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TrainingFigures {
    /// The number of parameter tensors that no gradient has reached.
    pub untouched_tensors: BTreeMap<String, usize>,
}

/// A quantity that a key names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Score(ScoreName),
    /// The untouched tensors of this supervision.
    Untouched(String),
}

/// One score: `supervision/reference.metric`, or `supervision/reference@clusterer.metric`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ScoreName {
    pub(super) supervision: String,
    pub(super) reference: String,
    clusterer: Option<String>,
    metric: Metric,
}

impl Quantity {
    /// Reads one of the quantities in `key`, which error messages quote.
    pub(super) fn parse(key: &str, text: &str) -> Result<Self, ExpectationError> {
        match text.trim().split_once('.') {
            Some((supervision, UNTOUCHED_TENSORS)) if is_name(supervision) => {
                Ok(Self::Untouched(supervision.to_owned()))
            }
            _ => ScoreName::parse(key, text).map(Self::Score),
        }
    }

    /// The supervision that it is about.
    pub(super) fn supervision(&self) -> &str {
        match self {
            Self::Score(score) => &score.supervision,
            Self::Untouched(supervision) => supervision,
        }
    }

    /// The number that a run has for the quantity.
    pub(super) fn value(
        &self,
        key: &str,
        tables: &Tables,
        trainings: &TrainingFigures,
    ) -> Result<f64, ExpectationError> {
        let value = match self {
            Self::Score(score) => {
                let row = score.row(key, tables)?;
                row.means.get(&score.metric).copied()
            }
            Self::Untouched(supervision) => {
                let n_tensors = trainings.untouched_tensors.get(supervision);
                n_tensors.map(|&n| n as f64)
            }
        };
        value.ok_or_else(|| ExpectationError::NoValue {
            key: key.to_owned(),
            score: self.to_string(),
        })
    }
}

/// The quantity without its clusterer, as messages name it.
impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Score(score) => {
                let ScoreName {
                    supervision,
                    reference,
                    metric,
                    ..
                } = score;
                write!(f, "{supervision}/{reference}.{}", metric.name)
            }
            Self::Untouched(supervision) => write!(f, "{supervision}.{UNTOUCHED_TENSORS}"),
        }
    }
}

impl ScoreName {
    fn parse(key: &str, text: &str) -> Result<Self, ExpectationError> {
        let bad_key = || ExpectationError::Key {
            key: key.to_owned(),
        };
        let (supervision, rest) = text.trim().split_once('/').ok_or_else(bad_key)?;
        let (target, metric) = rest.split_once('.').ok_or_else(bad_key)?;
        let (reference, clusterer) = match target.split_once('@') {
            Some((reference, clusterer)) => (reference, Some(clusterer)),
            None => (target, None),
        };
        let has_names = is_name(supervision) && is_name(reference) && clusterer.is_none_or(is_name);
        if !has_names {
            return Err(bad_key());
        }

        let metric = Metric::named(metric).ok_or_else(|| ExpectationError::Metric {
            key: key.to_owned(),
            metric: metric.to_owned(),
        })?;
        Ok(Self {
            supervision: supervision.to_owned(),
            reference: reference.to_owned(),
            clusterer: clusterer.map(str::to_owned),
            metric,
        })
    }

    /// The row of the tables that has the score.
    fn row<'a>(&self, key: &str, tables: &'a Tables) -> Result<&'a TableRow, ExpectationError> {
        let clusterer = self.clusterer.as_deref().unwrap_or(&tables.clusterer);
        let row = tables.row(&self.supervision, &self.reference, clusterer);
        row.ok_or_else(|| ExpectationError::UnknownName {
            key: key.to_owned(),
            name: format!("{}/{}@{clusterer}", self.supervision, self.reference),
            known: names_of_rows(tables),
        })
    }
}

fn names_of_rows(tables: &Tables) -> String {
    let names: Vec<String> = tables
        .rows
        .iter()
        .map(|row| format!("{}/{}@{}", row.supervision, row.reference, row.clusterer))
        .collect();
    names.join(", ")
}

/// Whether the text may name a source or a clusterer.
fn is_name(text: &str) -> bool {
    let is_allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    !text.is_empty() && text.chars().all(is_allowed)
}
