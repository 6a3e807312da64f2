//! The share of the points whose nearest ground-truth centroid is that of their own part.

use crate::Metric;

/// Accuracy of the nearest ground-truth centroid.
pub const GTC_ACCURACY: Metric = Metric {
    name: "gtc_accuracy",
    heading: "GTc accuracy",
    value: |shape| Some(shape.gtc?.accuracy),
};
