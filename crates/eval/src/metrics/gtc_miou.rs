//! Computes the mean IoU of the parts with the points whose nearest ground-truth centroid (GTc) is theirs.

use crate::metric::Metric;

/// Mean IoU of the nearest ground-truth centroid.
pub const GTC_MIOU: Metric = Metric {
    name: "gtc_miou",
    heading: "GTc mIoU",
    value: |shape| Some(shape.gtc?.miou),
};
