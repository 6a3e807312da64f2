//! Distinguishes damaged carriers from other failures.

use crate::counted::counted;
use anyhow::{Result, ensure};
use partprobe_dataset::{DamagedCarrier, DatasetError};

/// Whether an error says that a carrier is missing, damaged or changed.
pub(crate) fn is_damaged_carrier(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause.is::<DamagedCarrier>()
            || matches!(cause.downcast_ref(), Some(DatasetError::Damaged(_)))
    })
}

/// Ends a command that has written everything else.
///
/// # Errors
/// If any carrier was damaged.
pub(crate) fn refuse_damaged_carriers(n_damaged: usize) -> Result<()> {
    ensure!(
        n_damaged == 0,
        "{} cannot be used; everything else is written. Label again with --resume to replace what is damaged",
        counted(n_damaged, "carrier", "carriers")
    );
    Ok(())
}
