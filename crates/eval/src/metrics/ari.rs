//! Computes the adjusted Rand index of clusters and parts, which needs no matching.

use crate::agreement::adjusted_rand_index;
use crate::confusion::Confusion;
use crate::metric::Metric;

/// Adjusted Rand index: 1 for equal partitions, about 0 for unrelated ones.
pub const ARI: Metric = Metric {
    name: "ari",
    heading: "ARI",
    value: |shape| {
        let confusion = Confusion::new(shape.predicted, shape.reference).ok()?;
        Some(adjusted_rand_index(&confusion))
    },
};
