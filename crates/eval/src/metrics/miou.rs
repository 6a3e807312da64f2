//! Computes the mean IoU over the reference parts under the matching.

use crate::metric::Metric;

/// Mean IoU.
pub const MIOU: Metric = Metric {
    name: "miou",
    heading: "mIoU",
    value: |shape| Some(shape.matched.miou),
};
