//! Checks the names of label sources in a config without reading a label file.

use super::problem::nearest;
use super::settings::Config;
use anyhow::{Context, Result, anyhow};
use partprobe_sources::{SOURCES, SourceContext, SourceControl, SourceError, source_among};

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

    fn ensure_known_source(&self, name: &str) -> Result<()> {
        if self.sources.contains_key(name) {
            return Ok(());
        }
        match (
            source_among(SOURCES, name, &SourceContext::default()),
            SourceControl::of_name(name),
        ) {
            (Ok(_), _) => Ok(()),
            // A control may follow a source that is only in the config.
            (Err(_), Some((_, followed))) => self.ensure_known_source(followed),
            (Err(error), None) => Err(self.unknown_source(error)),
        }
    }

    /// The error, with the names of the config's own sources in its list, and with the name that may have been meant.
    pub(crate) fn unknown_source(&self, error: SourceError) -> anyhow::Error {
        let SourceError::Unknown { name, known } = error else {
            return error.into();
        };
        let own = self.sources.keys().map(String::as_str);
        let names: Vec<&str> = known.split(", ").chain(own).collect();
        let near = nearest(&name, &names)
            .map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
        let known = names.join(", ");
        anyhow!("{}{near}", SourceError::Unknown { name, known })
    }
}
