//! Lists the scores of a fit, in the order of the tables.

/// A score of a fit.
pub(super) struct ProbeMetric {
    /// The name in files.
    pub(super) name: &'static str,
    /// The heading in tables.
    pub(super) heading: &'static str,
    /// The factor of a value in tables.
    pub(super) scale: f64,
}

const fn metric(name: &'static str, heading: &'static str, scale: f64) -> ProbeMetric {
    ProbeMetric {
        name,
        heading,
        scale,
    }
}

/// All scores. Those of labels are missing for the control.
pub(super) const METRICS: [ProbeMetric; 23] = [
    metric("cdl1", "CDL1 ×10²", 100.0),
    metric("f1", "F1", 1.0),
    metric("nc", "NC", 1.0),
    metric("miou_own", "mIoU, own", 1.0),
    metric("accuracy_own", "Acc, own", 1.0),
    metric("miou_step", "mIoU, step", 1.0),
    metric("accuracy_step", "Acc, step", 1.0),
    metric("cons_knn", "cons_knn", 1.0),
    metric("cons_normal", "cons_normal", 1.0),
    metric("cdl1_pp", "CDL1_pp ×10²", 100.0),
    metric("f1_pp", "F1_pp", 1.0),
    metric("nc_pp", "NC_pp", 1.0),
    metric("cdl1_floor", "floor of CDL1_pp ×10²", 100.0),
    metric("f1_floor", "floor of F1_pp", 1.0),
    metric("nc_floor", "floor of NC_pp", 1.0),
    metric("miou_own_reference", "mIoU, own, at reference points", 1.0),
    metric(
        "accuracy_own_reference",
        "Acc, own, at reference points",
        1.0,
    ),
    metric(
        "miou_step_reference",
        "mIoU, step, at reference points",
        1.0,
    ),
    metric(
        "accuracy_step_reference",
        "Acc, step, at reference points",
        1.0,
    ),
    metric("labels_miou_step", "mIoU of the labels themselves", 1.0),
    metric("labels_accuracy_step", "Acc of the labels themselves", 1.0),
    metric("n_labels", "labels", 1.0),
    metric("n_triangles", "triangles", 1.0),
];

/// The metric with a name.
pub(super) fn named(name: &str) -> Option<&'static ProbeMetric> {
    METRICS.iter().find(|metric| metric.name == name)
}
