//! Defines the scores of one shape: a line of `scores.jsonl`.

use crate::metric::Metric;
use crate::metrics::METRICS;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The scores of one shape under one supervision, seed, reference and clusterer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScoreRow {
    /// The id of the shape.
    pub shape: String,
    /// The label source that the backbone was trained on, or `untrained`, or `no-network`.
    pub supervision: String,
    /// The training seed.
    pub seed: u64,
    /// The label source that the clusters are scored against.
    pub reference: String,
    /// The algorithm that made the clusters.
    pub clusterer: String,
    /// The number of reference parts that have a point. It is also the number of clusters that was requested.
    pub k: usize,
    /// The value of each metric. A metric without a value is absent here and null in the line.
    #[serde(flatten, with = "scores_in_line")]
    pub scores: BTreeMap<Metric, f64>,
    /// The group of related shapes that the bootstrap draws together.
    pub group: String,
}

impl Metric {
    /// Returns the number in a row, or `None` if the row has none or it is not finite.
    #[must_use]
    pub fn of(self, row: &ScoreRow) -> Option<f64> {
        row.scores
            .get(&self)
            .copied()
            .filter(|value| value.is_finite())
    }
}

/// The scores as keys of the line itself, by the names of the metrics.
mod scores_in_line {
    use super::*;
    use serde::ser::SerializeMap;
    use serde::{Deserializer, Serializer, de};
    use serde_json::Value;

    /// Writes every metric of the list, and then those that only the row has.
    pub(super) fn serialize<S: Serializer>(
        scores: &BTreeMap<Metric, f64>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let metrics: BTreeSet<&Metric> = METRICS.iter().chain(scores.keys()).collect();
        let mut line = serializer.serialize_map(Some(metrics.len()))?;
        for metric in metrics {
            line.serialize_entry(metric.name, &scores.get(metric))?;
        }
        line.end()
    }

    /// Reads the metrics of the list. Other keys are ignored, and a metric that the line lacks has no value.
    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<BTreeMap<Metric, f64>, D::Error> {
        let line: BTreeMap<String, Value> = BTreeMap::deserialize(deserializer)?;
        let mut scores = BTreeMap::new();
        for metric in METRICS {
            match line.get(metric.name) {
                None | Some(Value::Null) => {}
                Some(value) => {
                    let not_a_number =
                        || de::Error::custom(format!("`{}` must be a number or null", metric.name));
                    scores.insert(*metric, value.as_f64().ok_or_else(not_a_number)?);
                }
            }
        }
        Ok(scores)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::{ACCURACY, MIOU};

    #[test]
    fn a_row_is_one_line_with_nulls() {
        let row = ScoreRow {
            shape: "a__b".to_owned(),
            supervision: "no-network".to_owned(),
            seed: 3,
            reference: "step-parts".to_owned(),
            clusterer: "k-means".to_owned(),
            k: 4,
            scores: BTreeMap::from([(MIOU, 0.5), (ACCURACY, 0.75)]),
            group: "a__b".to_owned(),
        };
        let line = serde_json::to_string(&row).unwrap();
        let expected = concat!(
            r#"{"shape":"a__b","supervision":"no-network","seed":3,"reference":"step-parts","clusterer":"k-means","#,
            r#""k":4,"miou":0.5,"accuracy":0.75,"gtc_accuracy":null,"gtc_miou":null,"#,
            r#""best_overlap_miou":null,"miou_large":null,"boundary_accuracy":null,"split_gtc_accuracy":null,"#,
            r#""split_gtc_miou":null,"ari":null,"best_cut_ari":null,"pq":null,"pair_auc":null,"asa":null,"#,
            r#""count_error":null,"group":"a__b"}"#
        );
        assert_eq!(line, expected);
        assert_eq!(serde_json::from_str::<ScoreRow>(&line).unwrap(), row);
        let values: Vec<Option<f64>> = METRICS.iter().map(|metric| metric.of(&row)).collect();
        assert_eq!(values[..3], [Some(0.5), Some(0.75), None]);
        assert!(values[3..].iter().all(Option::is_none));
    }

    #[test]
    fn lines_with_other_metrics_are_read() {
        let read = |metrics: &str| {
            let names =
                r#""shape":"a","supervision":"b","seed":0,"reference":"c","clusterer":"d","k":2"#;
            serde_json::from_str::<ScoreRow>(&format!(r#"{{{names},{metrics},"group":"a"}}"#))
        };
        let row = read(r#""gtc_miou":1,"of_a_later_version":[1],"miou":0.1"#).unwrap();
        assert_eq!(
            (MIOU.of(&row), ACCURACY.of(&row), row.scores.len()),
            (Some(0.1), None, 2)
        );
        let error = read(r#""miou":"high""#).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("`miou` must be a number or null"),
            "{error}"
        );
    }
}
