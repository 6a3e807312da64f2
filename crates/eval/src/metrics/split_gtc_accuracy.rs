//! Computes the accuracy of the nearest ground-truth centroid (GTc), whose centers come from the other half of the tokens.

use crate::metric::Metric;

/// Accuracy of the nearest centroid of the other half.
pub const SPLIT_GTC_ACCURACY: Metric = Metric {
    name: "split_gtc_accuracy",
    heading: "split GTc accuracy",
    value: |shape| Some(shape.split_gtc?.accuracy),
};
