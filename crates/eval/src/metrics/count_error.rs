//! Computes the difference between the number of clusters and the number of parts. It measures clusterers that are not given a
//! number.

use crate::confusion::Confusion;
use crate::metric::Metric;

/// Absolute difference of the numbers of clusters and of parts that have a labeled point.
pub const COUNT_ERROR: Metric = Metric {
    name: "count_error",
    heading: "count error",
    value: |shape| {
        let confusion = Confusion::new(shape.predicted, shape.reference).ok()?;
        let n_parts = confusion.reference_ids().len();
        let n_clusters = confusion.predicted_ids().len();
        Some(n_parts.abs_diff(n_clusters) as f64)
    },
};
