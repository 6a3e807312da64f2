//! Computes the fraction of the points whose nearest ground-truth centroid (GTc) is that of their own part.

use crate::metric::Metric;

/// Accuracy of the nearest ground-truth centroid.
pub const GTC_ACCURACY: Metric = Metric {
    name: "gtc_accuracy",
    heading: "GTc accuracy",
    value: |shape| Some(shape.gtc?.accuracy),
};
