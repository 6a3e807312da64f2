//! A line of `scores.jsonl`, and the names of the numbers in it.

use serde::{Deserialize, Serialize};

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
    /// Parts of the reference that have a point; the clusterer was asked for as many.
    pub k: usize,
    /// Mean IoU over the reference parts.
    pub miou: f64,
    /// Point accuracy under the matching.
    pub accuracy: f64,
    /// Accuracy of the nearest ground-truth centre; null without embeddings.
    pub gtc_accuracy: Option<f64>,
    /// Mean IoU of the nearest ground-truth centre; null without embeddings.
    pub gtc_miou: Option<f64>,
    /// The group of related shapes that the bootstrap draws together.
    pub group: String,
}

/// A number of a [`ScoreRow`] that tables average.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Metric {
    /// Mean IoU.
    Miou,
    /// Point accuracy.
    Accuracy,
    /// Accuracy of the nearest ground-truth centre.
    GtcAccuracy,
    /// Mean IoU of the nearest ground-truth centre.
    GtcMiou,
}

impl Metric {
    /// Every metric, in the order of table columns.
    pub const ALL: [Self; 4] = [Self::Miou, Self::Accuracy, Self::GtcAccuracy, Self::GtcMiou];

    /// The name in files and in `[expect]`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Miou => "miou",
            Self::Accuracy => "accuracy",
            Self::GtcAccuracy => "gtc_accuracy",
            Self::GtcMiou => "gtc_miou",
        }
    }

    /// The heading in tables.
    #[must_use]
    pub fn heading(self) -> &'static str {
        match self {
            Self::Miou => "mIoU",
            Self::Accuracy => "accuracy",
            Self::GtcAccuracy => "GTc accuracy",
            Self::GtcMiou => "GTc mIoU",
        }
    }

    /// The metric with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|metric| metric.name() == name)
    }

    /// The number in a row; none where the row has none, or it is no number.
    #[must_use]
    pub fn of(self, row: &ScoreRow) -> Option<f64> {
        let value = match self {
            Self::Miou => Some(row.miou),
            Self::Accuracy => Some(row.accuracy),
            Self::GtcAccuracy => row.gtc_accuracy,
            Self::GtcMiou => row.gtc_miou,
        };
        value.filter(|value| value.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_one_line_with_nulls() {
        let row = ScoreRow {
            shape: "a__b".to_owned(),
            supervision: "no-network".to_owned(),
            seed: 3,
            reference: "step-parts".to_owned(),
            clusterer: "k-means".to_owned(),
            k: 4,
            miou: 0.5,
            accuracy: 0.75,
            gtc_accuracy: None,
            gtc_miou: None,
            group: "a__b".to_owned(),
        };
        let line = serde_json::to_string(&row).unwrap();
        let expected = concat!(
            r#"{"shape":"a__b","supervision":"no-network","seed":3,"reference":"step-parts","clusterer":"k-means","#,
            r#""k":4,"miou":0.5,"accuracy":0.75,"gtc_accuracy":null,"gtc_miou":null,"group":"a__b"}"#
        );
        assert_eq!(line, expected);
        assert_eq!(serde_json::from_str::<ScoreRow>(&line).unwrap(), row);
        assert_eq!(Metric::ALL.map(|metric| metric.of(&row)), [Some(0.5), Some(0.75), None, None]);
    }

    #[test]
    fn metrics_are_found_by_their_names() {
        for metric in Metric::ALL {
            assert_eq!(Metric::named(metric.name()), Some(metric));
            assert_eq!(serde_json::to_string(&metric).unwrap(), format!("\"{}\"", metric.name()));
        }
        assert_eq!(Metric::named("iou"), None);
    }
}
