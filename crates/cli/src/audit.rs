//! Checks every carrier of a data set, and shows its progress.

use crate::progress::Progress;
use partprobe_dataset::{Audit, Dataset};

/// The carriers that are no longer as they were labeled.
pub(crate) fn audited(dataset: &Dataset) -> Audit {
    let bar = Progress::on_terminal().bar("check", dataset.labeled().len());
    let audit = Audit::of(dataset, || bar.inc(1));
    bar.finish_and_clear();
    audit
}
