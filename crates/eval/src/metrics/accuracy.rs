//! Computes the fraction of the points whose cluster is matched to their part.

use crate::metric::Metric;

/// Point accuracy.
pub const ACCURACY: Metric = Metric {
    name: "accuracy",
    heading: "accuracy",
    value: |shape| Some(shape.matched.accuracy),
};
