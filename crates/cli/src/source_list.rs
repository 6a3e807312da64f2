//! Label sources by the names of the command line.

use crate::config::Config;
use crate::label_sources::sources_named;
use crate::usage::{UsageError, as_usage_error};
use anyhow::{Result, ensure};
use partprobe_sources::BoxedSource;

/// The sources with these names, in this order; a name is that of a built-in source or of a table of the config.
///
/// # Errors
/// If a name is unknown, or stands in the list twice.
pub(crate) fn listed_sources(config: &Config, names: &[String]) -> Result<Vec<BoxedSource>> {
    for (idx, name) in names.iter().enumerate() {
        ensure!(
            !names[..idx].contains(name),
            UsageError(format!("`{name}` is named twice; name each source once"))
        );
    }
    sources_named(config, names).map_err(as_usage_error)
}
