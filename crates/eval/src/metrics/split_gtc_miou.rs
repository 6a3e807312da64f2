//! Computes the mean IoU of the nearest ground-truth centroid (GTc), whose centers come from the other half of the tokens.

use crate::metric::Metric;

/// Mean IoU of the nearest centroid of the other half.
pub const SPLIT_GTC_MIOU: Metric = Metric {
    name: "split_gtc_miou",
    heading: "split GTc mIoU",
    value: |shape| Some(shape.split_gtc?.miou),
};
