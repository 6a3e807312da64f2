//! Lists the metrics, one file each. Score files, tables and `[expect]` follow this list.
//!
//! To add a metric, write one file with a constant [`Metric`], and add the constant to [`METRICS`].

mod accuracy;
mod ari;
mod asa;
mod best_cut;
mod best_overlap;
mod boundary_accuracy;
mod count_error;
mod gtc_accuracy;
mod gtc_miou;
mod miou;
mod miou_large;
mod pair_auc;
mod panoptic_quality;
mod split_gtc_accuracy;
mod split_gtc_miou;

pub use accuracy::ACCURACY;
pub use ari::ARI;
pub use asa::ASA;
pub use best_cut::BEST_CUT_ARI;
pub use best_overlap::BEST_OVERLAP_MIOU;
pub use boundary_accuracy::BOUNDARY_ACCURACY;
pub use count_error::COUNT_ERROR;
pub use gtc_accuracy::GTC_ACCURACY;
pub use gtc_miou::GTC_MIOU;
pub use miou::MIOU;
pub use miou_large::MIOU_LARGE;
pub use pair_auc::PAIR_AUC;
pub use panoptic_quality::PANOPTIC_QUALITY;
pub use split_gtc_accuracy::SPLIT_GTC_ACCURACY;
pub use split_gtc_miou::SPLIT_GTC_MIOU;

use crate::metric::{Metric, ScoredShape};
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// Every metric, in the order of table columns and of the numbers in a line of `scores.jsonl`.
pub const METRICS: &[Metric] = &[
    MIOU,
    ACCURACY,
    GTC_ACCURACY,
    GTC_MIOU,
    BEST_OVERLAP_MIOU,
    MIOU_LARGE,
    BOUNDARY_ACCURACY,
    SPLIT_GTC_ACCURACY,
    SPLIT_GTC_MIOU,
    ARI,
    BEST_CUT_ARI,
    PANOPTIC_QUALITY,
    PAIR_AUC,
    ASA,
    COUNT_ERROR,
];

/// The metrics of the second table of each reference and clusterer.
const SECONDARY: [Metric; 11] = [
    BEST_OVERLAP_MIOU,
    MIOU_LARGE,
    BOUNDARY_ACCURACY,
    SPLIT_GTC_ACCURACY,
    SPLIT_GTC_MIOU,
    ARI,
    BEST_CUT_ARI,
    PANOPTIC_QUALITY,
    PAIR_AUC,
    ASA,
    COUNT_ERROR,
];

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

    /// Whether the metric is in the second table of each reference and clusterer, and not in lines of progress.
    #[must_use]
    pub fn is_secondary(&self) -> bool {
        SECONDARY.contains(self)
    }

    /// Whether a smaller value is better: the metric is an error, and not an agreement.
    #[must_use]
    pub fn is_error(&self) -> bool {
        *self == COUNT_ERROR
    }

    /// The index of the metric in the order of all metrics.
    fn order(&self) -> (usize, &'static str) {
        let index = METRICS.iter().position(|metric| metric.name == self.name);
        (index.unwrap_or(METRICS.len()), self.name)
    }
}

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
        assert!(METRICS.is_sorted());
        let names: Vec<&str> = METRICS.iter().map(|metric| metric.name).collect();
        let known = Metric::known_names();
        assert!(known.split(", ").eq(names), "{known}");

        let outside = Metric {
            name: "a",
            heading: "a",
            value: |_| None,
        };
        assert!(METRICS.iter().all(|metric| *metric < outside));
    }
}
