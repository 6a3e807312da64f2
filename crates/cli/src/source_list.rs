//! Label sources by the names of the command line.

use crate::usage::{UsageError, as_usage_error};
use anyhow::{Result, ensure};
use partprobe_sources::{BoxedSource, source_named};

/// The sources with these names, in this order.
///
/// # Errors
/// If a name is unknown, or stands in the list twice.
pub(crate) fn listed_sources(names: &[String]) -> Result<Vec<BoxedSource>> {
    for (idx, name) in names.iter().enumerate() {
        ensure!(
            !names[..idx].contains(name),
            UsageError(format!("`{name}` is named twice; name each source once"))
        );
    }
    names
        .iter()
        .map(|name| Ok(source_named(name)?))
        .collect::<Result<Vec<BoxedSource>>>()
        .map_err(as_usage_error)
}
