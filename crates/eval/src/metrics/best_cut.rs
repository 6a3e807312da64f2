//! Takes the adjusted Rand index of the best cut of the average-link tree, which needs no number of clusters.

use crate::metric::Metric;

/// Adjusted Rand index of the best cut.
pub const BEST_CUT_ARI: Metric = Metric {
    name: "best_cut_ari",
    heading: "ARI, best cut",
    value: |shape| shape.best_cut_ari,
};
