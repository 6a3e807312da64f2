//! Defines one line per shape, source and channel, and the numbers of such a line that tables average.

use super::shape::ShapeAgreement;
use serde::{Deserialize, Serialize};

/// The scores of the reference itself after its labels passed through the same channel. No source can really score more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CeilingScores {
    /// The accuracy.
    pub accuracy: f64,
    /// The mean IoU.
    pub miou: f64,
    /// The accuracy in the 0.5 % band. `None` if the band has no point.
    pub boundary: Option<f64>,
}

impl CeilingScores {
    /// The ceiling, from the agreement of the reference with itself.
    #[must_use]
    pub fn of(reference_through_channel: &ShapeAgreement) -> Self {
        Self {
            accuracy: reference_through_channel.accuracy,
            miou: reference_through_channel.miou,
            boundary: reference_through_channel.boundary[1],
        }
    }
}

/// The agreement of one source with the reference on one shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AgreementRow {
    /// The id of the shape.
    pub shape: String,
    /// The group of related shapes that the bootstrap draws together.
    pub group: String,
    /// The label source that is compared.
    pub source: String,
    /// The channel by which its labels were carried to the points, for example `index`.
    pub channel: String,
    /// The agreement.
    #[serde(flatten)]
    pub agreement: ShapeAgreement,
    /// The transfer ceiling of this shape and channel.
    pub ceiling: CeilingScores,
}

/// A shape that a source cannot label, or a shape on which no source could be compared.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct RefusedShape {
    /// The source that refused, or the reference if the shape is not compared at all.
    pub source: String,
    /// The id of the shape.
    pub shape: String,
    /// The reason.
    pub reason: String,
}

/// A number of a row that tables average.
#[derive(Clone, Copy, Debug)]
pub struct AgreementMetric {
    /// The name in CSV and JSON.
    pub name: &'static str,
    /// The heading of its column in Markdown.
    pub heading: &'static str,
    /// The value. `None` if the shape has none.
    pub of: fn(&AgreementRow) -> Option<f64>,
}

impl AgreementMetric {
    /// Every number, in the order of the columns of the CSV files.
    pub const ALL: [Self; 15] = [
        Self {
            name: "accuracy",
            heading: "accuracy",
            of: |row| Some(row.agreement.accuracy),
        },
        Self {
            name: "miou",
            heading: "mIoU",
            of: |row| Some(row.agreement.miou),
        },
        Self {
            name: "ari",
            heading: "ARI",
            of: |row| Some(row.agreement.ari),
        },
        Self {
            name: "boundary_0.25",
            heading: "boundary 0.25 %",
            of: |row| row.agreement.boundary[0],
        },
        Self {
            name: "boundary_0.5",
            heading: "boundary 0.5 %",
            of: |row| row.agreement.boundary[1],
        },
        Self {
            name: "boundary_1",
            heading: "boundary 1 %",
            of: |row| row.agreement.boundary[2],
        },
        Self {
            name: "boundary_2",
            heading: "boundary 2 %",
            of: |row| row.agreement.boundary[3],
        },
        Self {
            name: "n_reference",
            heading: "parts",
            of: |row| Some(row.agreement.n_reference as f64),
        },
        Self {
            name: "n_labels",
            heading: "labels",
            of: |row| Some(row.agreement.n_labels as f64),
        },
        Self {
            name: "n_merges",
            heading: "merges",
            of: |row| Some(row.agreement.n_merges as f64),
        },
        Self {
            name: "n_splits",
            heading: "splits",
            of: |row| Some(row.agreement.n_splits as f64),
        },
        Self {
            name: "ceiling_accuracy",
            heading: "accuracy, ceiling",
            of: |row| Some(row.ceiling.accuracy),
        },
        Self {
            name: "ceiling_miou",
            heading: "mIoU, ceiling",
            of: |row| Some(row.ceiling.miou),
        },
        Self {
            name: "ceiling_boundary_0.5",
            heading: "boundary 0.5 %, ceiling",
            of: |row| row.ceiling.boundary,
        },
        Self {
            name: "label_ratio",
            heading: "labels per part",
            of: |row| Some(row.agreement.n_labels as f64 / row.agreement.n_reference as f64),
        },
    ];

    /// The number with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        const METRICS: &[AgreementMetric] = &AgreementMetric::ALL;
        METRICS.iter().find(|metric| metric.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_two_numbers_share_a_name() {
        let names: BTreeSet<&str> = AgreementMetric::ALL
            .iter()
            .map(|metric| metric.name)
            .collect();
        assert_eq!(names.len(), AgreementMetric::ALL.len());
        assert!(
            AgreementMetric::named("ari").is_some() && AgreementMetric::named("aris").is_none()
        );
    }
}
