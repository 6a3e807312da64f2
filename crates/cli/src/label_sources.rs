//! Finds label sources by name: the built-in ones, and those of the config's `[sources.NAME]` tables.

use crate::config::{Config, ResolvedSource};
use crate::disk_files::DiskFiles;
use crate::source_types::open_source;
use crate::usage::{UsageError, as_usage_error};
use anyhow::{Context, Result, ensure};
use partprobe_imports::ImportedSource;
use partprobe_sources::BoxedSource;
use std::sync::Arc;

/// The source with this name.
///
/// # Errors
/// If no source has the name, the number at its end is not possible, or its label files cannot be read.
pub(crate) fn source_named(config: &Config, name: &str) -> Result<BoxedSource> {
    match config.resolved_source(name)? {
        ResolvedSource::Imported(table) => {
            let context = table.context().with_files(Arc::new(DiskFiles));
            let import = open_source(&table.import_type, context);
            let import = import.with_context(|| format!("sources.{name}"))?;
            Ok(Box::new(ImportedSource::new(name, import)))
        }
        ResolvedSource::BuiltIn(source) => Ok(source),
        ResolvedSource::Control(control, followed) => {
            Ok(control.of(source_named(config, followed)?))
        }
    }
}

/// The sources with these names, in their order.
///
/// # Errors
/// The same as for one source.
pub(crate) fn sources_named(config: &Config, names: &[String]) -> Result<Vec<BoxedSource>> {
    names
        .iter()
        .map(|name| source_named(config, name))
        .collect()
}

/// The sources that a command line lists, in this order.
///
/// # Errors
/// If a name is unknown, or is in the list twice.
pub(crate) fn listed_sources(config: &Config, names: &[String]) -> Result<Vec<BoxedSource>> {
    for (idx, name) in names.iter().enumerate() {
        ensure!(
            !names[..idx].contains(name),
            UsageError(format!("`{name}` is named twice; name each source once"))
        );
    }
    sources_named(config, names).map_err(as_usage_error)
}
