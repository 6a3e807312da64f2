//! Distinguishes errors of the caller, such as invalid arguments, from other errors.

use partprobe_dataset::{DatasetError, DatasetWriteError, JournalError};

/// A mistake in the arguments or the config. The program ends with 2 instead of 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct UsageError(pub String);

impl std::fmt::Display for UsageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for UsageError {}

/// Converts any error to one of the caller.
pub(crate) fn as_usage_error(error: anyhow::Error) -> anyhow::Error {
    UsageError(format!("{error:#}")).into()
}

/// Whether an error is one of the caller.
pub(crate) fn is_usage_error(error: &anyhow::Error) -> bool {
    error.is::<UsageError>()
        || error.chain().any(|cause| {
            let read = cause.downcast_ref::<DatasetError>();
            let written = cause.downcast_ref::<DatasetWriteError>();
            read.is_some_and(DatasetError::is_misuse)
                || written.is_some_and(DatasetWriteError::is_misuse)
                || matches!(cause.downcast_ref(), Some(JournalError::InUse(_)))
        })
}
