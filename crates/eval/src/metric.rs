//! A metric: a named number that one scored shape gives, and that tables average.

use crate::{Gtc, METRICS, ScoreRow, ShapeScores};
use partprobe_carrier::Embeddings;
use serde::{Serialize, Serializer};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fmt;

/// All that a metric can read about one shape under one supervision, reference and clusterer.
#[derive(Clone, Copy, Debug)]
pub struct ScoredShape<'a> {
    /// The predicted cluster of each point.
    pub predicted: &'a [u32],
    /// The reference label of each point; negative labels are ignored.
    pub reference: &'a [i32],
    /// The token of each point.
    pub token_of_point: &'a [u32],
    /// The embedding of each token.
    pub embeddings: &'a Embeddings,
    /// The scores under the matching of clusters to parts.
    pub matched: ShapeScores,
    /// The scores of the nearest ground-truth centroid, or `None` without a network.
    pub gtc: Option<Gtc>,
}

impl ScoredShape<'_> {
    /// The value of each metric of the list that has one for this shape.
    #[must_use]
    pub fn scores(&self) -> BTreeMap<Metric, f64> {
        METRICS
            .iter()
            .filter_map(|metric| Some((*metric, (metric.value)(self)?)))
            .collect()
    }
}

/// A number that says how well the clusters or the embeddings of a shape meet its reference parts.
///
/// Two metrics are equal if they have the same name. They are ordered as in [`METRICS`]; metrics that are not in the
/// list come after it, by their names.
#[derive(Clone, Copy)]
pub struct Metric {
    /// The name in files and in `[expect]`.
    pub name: &'static str,
    /// The heading in tables.
    pub heading: &'static str,
    /// Computes the value, or `None` if the shape has none, for example without a network.
    pub value: fn(&ScoredShape<'_>) -> Option<f64>,
}

impl Metric {
    /// Returns the metric of [`METRICS`] with this name, or `None` if the list has none.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        METRICS.iter().find(|metric| metric.name == name).copied()
    }

    /// The names of [`METRICS`], separated by commas.
    #[must_use]
    pub fn known_names() -> String {
        let names: Vec<&str> = METRICS.iter().map(|metric| metric.name).collect();
        names.join(", ")
    }

    /// Returns the number in a row, or `None` if the row has none or it is not finite.
    #[must_use]
    pub fn of(self, row: &ScoreRow) -> Option<f64> {
        row.scores
            .get(&self)
            .copied()
            .filter(|value| value.is_finite())
    }

    /// Where the metric is in the order of all metrics.
    fn order(&self) -> (usize, &'static str) {
        let place = METRICS.iter().position(|metric| metric.name == self.name);
        (place.unwrap_or(METRICS.len()), self.name)
    }
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

impl PartialOrd for Metric {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Metric {
    fn cmp(&self, other: &Self) -> Ordering {
        self.order().cmp(&other.order())
    }
}

impl Serialize for Metric {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metrics_are_found_by_their_names_and_ordered_as_in_the_list() {
        for metric in METRICS {
            assert_eq!(Metric::named(metric.name), Some(*metric));
            assert_eq!(
                serde_json::to_string(metric).unwrap(),
                format!("\"{}\"", metric.name)
            );
        }
        assert_eq!(Metric::named("iou"), None);
        assert!(
            METRICS.is_sorted()
                && Metric::known_names() == "miou, accuracy, gtc_accuracy, gtc_miou"
        );

        let outside = Metric {
            name: "a",
            heading: "a",
            value: |_| None,
        };
        assert!(METRICS.iter().all(|metric| *metric < outside));
    }
}
