//! Finds out what the names of label sources in a config stand for, without reading a label file.

use super::problem::suggestion;
use super::settings::Config;
use super::source_table::SourceTable;
use anyhow::{Context, Result, anyhow};
use partprobe_sources::{
    BoxedSource, SOURCES, SourceContext, SourceControl, SourceError, source_among,
};

/// What the name of a label source stands for.
pub(crate) enum ResolvedSource<'a> {
    /// The table `[sources.NAME]` of a config.
    Imported(&'a SourceTable),
    /// A source that needs no table.
    BuiltIn(BoxedSource),
    /// A control, and the name of the source that it follows.
    Control(&'static SourceControl, &'a str),
}

impl Config {
    /// Refuses names that are neither a built-in source nor one of `[sources.NAME]`. The message begins with the key.
    ///
    /// # Errors
    /// If a name is unknown, or the number at its end is not possible.
    pub(super) fn check_source_names(&self) -> Result<()> {
        let compare = [
            ("compare.supervision", &self.compare.supervision),
            ("compare.references", &self.compare.references),
        ];
        for (key, names) in compare {
            for name in names {
                self.ensure_known_source(name).context(key)?;
            }
        }
        for endpoint in &self.endpoints {
            for name in endpoint.references.iter().chain(&endpoint.probe) {
                self.ensure_known_source(name)
                    .with_context(|| format!("endpoints.{}", endpoint.name))?;
            }
        }
        Ok(())
    }

    /// Refuses a name that is neither a built-in source nor one of `[sources.NAME]`.
    ///
    /// # Errors
    /// If the name is unknown, or the number at its end is not possible.
    pub(crate) fn ensure_known_source(&self, name: &str) -> Result<()> {
        match self.resolved_source(name)? {
            ResolvedSource::Imported(_) | ResolvedSource::BuiltIn(_) => Ok(()),
            ResolvedSource::Control(_, followed) => self.ensure_known_source(followed),
        }
    }

    /// What a name stands for. No label file is read.
    ///
    /// # Errors
    /// If no source has the name, or the number at its end is not possible.
    pub(crate) fn resolved_source<'a>(&'a self, name: &'a str) -> Result<ResolvedSource<'a>> {
        if let Some(table) = self.sources.get(name) {
            return Ok(ResolvedSource::Imported(table));
        }
        let built_in = source_among(SOURCES, name, &SourceContext::default());
        // A control may follow a source that is only in the config.
        match (built_in, SourceControl::of_name(name)) {
            (Ok(source), _) => Ok(ResolvedSource::BuiltIn(source)),
            (Err(_), Some((control, followed))) => Ok(ResolvedSource::Control(control, followed)),
            (Err(error), None) => Err(self.unknown_source(error)),
        }
    }

    /// The error, with the names of the config's own sources in its list, and with the name that may have been meant.
    fn unknown_source(&self, error: SourceError) -> anyhow::Error {
        let SourceError::Unknown { name, known } = error else {
            return error.into();
        };
        let own = self.sources.keys().map(String::as_str);
        let names: Vec<&str> = known.split(", ").chain(own).collect();
        let known = names.join(", ");
        let near = suggestion(&name, &known);
        anyhow!("{}{near}", SourceError::Unknown { name, known })
    }
}
