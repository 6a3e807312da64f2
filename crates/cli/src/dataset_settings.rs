//! Reads and compares `dataset.json`: exactly the settings that determine the bytes of a data set.

use crate::config::{Config, Difference, Emit, LabelConfig, SampleConfig, differences};
use crate::counted::counted;
use crate::label::{InputFile, Shard};
use anyhow::{Context, Result, bail};
use partprobe_carrier::{hexadecimal, sha256_hex};
use partprobe_dataset::{DatasetError, SETTINGS_FILE};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::Path;

/// The settings that limit the cost of a file. Another value does not change a result that is within both limits.
const BUDGETS: [&str; 5] = [
    "label.max_file_mb",
    "label.max_entities",
    "label.max_triangles",
    "label.memory_mb",
    "label.watchdog_s",
];

/// Keys of `[label]` that do not influence a carrier: budgets, and the settings of the written files.
pub(crate) const NEUTRAL_LABEL_KEYS: [&str; 7] = [
    "emit",
    "compress",
    "max_file_mb",
    "max_entities",
    "max_triangles",
    "memory_mb",
    "watchdog_s",
];

/// The hash of the settings that determine the carriers of a data set, in hexadecimal. Returns `None` if the data set does not
/// record them.
#[must_use]
pub(crate) fn settings_sha256_of(folder: &Path) -> Option<String> {
    let settings = fs::read(folder.join(SETTINGS_FILE)).ok()?;
    let settings: Value = serde_json::from_slice(&settings).ok()?;
    settings_sha256(&settings["label"])
}

/// The hash of the table `[label]` without the keys that do not influence a carrier. Returns `None` if it is not a table.
#[must_use]
pub(crate) fn settings_sha256(label: &Value) -> Option<String> {
    let is_counted = |key: &&String| !NEUTRAL_LABEL_KEYS.contains(&key.as_str());
    let counted: BTreeMap<&String, &Value> = label
        .as_object()?
        .iter()
        .filter(|(key, _)| is_counted(key))
        .collect();
    Some(sha256_hex(&serde_json::to_vec(&counted).ok()?))
}

/// The settings and the inputs of a data set.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub(crate) struct DatasetSettings {
    /// Version of the file formats.
    pub(crate) format_version: u32,
    /// Version of the program.
    pub(crate) program_version: String,
    /// The settings of labeling.
    pub(crate) label: LabelConfig,
    /// The settings of sampling, if points are written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) sample: Option<SampleConfig>,
    /// The files and archives that were given.
    pub(crate) inputs: Inputs,
    /// The share of them in this data set, if it does not have all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) shard: Option<Shard>,
    /// The hash of the `release.json` whose labels the shapes have, if `attach` made the data set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) package_sha256: Option<String>,
}

/// Properties that distinguish a list of inputs from another one.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub(crate) struct Inputs {
    /// The number of files and archives.
    pub(crate) n_inputs: usize,
    /// The total number of bytes.
    pub(crate) bytes: u64,
    /// SHA-256 over their names and sizes.
    pub(crate) sha256: String,
}

impl fmt::Display for Inputs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bytes = if self.bytes == 1 { "byte" } else { "bytes" };
        write!(
            f,
            "{} of {} {bytes}",
            counted(self.n_inputs, "file", "files"),
            self.bytes
        )
    }
}

impl Inputs {
    /// Reads the names and the sizes. A file that does not exist has no size.
    #[must_use]
    pub(crate) fn of(files: &[InputFile]) -> Self {
        let mut hash = Sha256::new();
        let mut bytes = 0;
        for file in files {
            let size = fs::metadata(&file.path).ok().map(|data| data.len());
            bytes += size.unwrap_or(0);
            hash.update(format!("{}\n{size:?}\n", file.name));
        }
        let sha256 = hexadecimal(&hash.finalize());
        Self {
            n_inputs: files.len(),
            bytes,
            sha256,
        }
    }
}

impl Inputs {
    /// The difference of these inputs from others, in words. Numbers are given only if they differ.
    fn difference(&self, other: &Self) -> String {
        if (self.n_inputs, self.bytes) == (other.n_inputs, other.bytes) {
            return format!("the inputs are {self} as before, but their names or sizes differ");
        }
        format!("the inputs are now {self}, and they were {other}; their names or sizes differ")
    }
}

impl DatasetSettings {
    /// The settings of a batch.
    #[must_use]
    pub(crate) fn new(config: &Config, files: &[InputFile], shard: Option<Shard>) -> Self {
        Self {
            format_version: partprobe_formats::FORMAT_VERSION,
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            label: config.label.clone(),
            sample: config
                .label
                .emit
                .contains(&Emit::Points)
                .then(|| config.sample.clone()),
            inputs: Inputs::of(files),
            shard,
            package_sha256: None,
        }
    }

    /// Reads the settings of a data set.
    ///
    /// # Errors
    /// If there are none, or they are of another version.
    pub(crate) fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(SETTINGS_FILE);
        let bytes = match fs::read(&path) {
            Err(error) if is_missing(&error) => {
                bail!(DatasetError::NotADataset(folder.to_owned()))
            }
            read => read.with_context(|| format!("reading {}", path.display()))?,
        };
        serde_json::from_slice(&bytes).with_context(|| {
            format!(
                "{} was written by another version of partprobe",
                path.display()
            )
        })
    }

    /// Every setting in which the two differ, in the form `key is A, not B`.
    #[must_use]
    pub(crate) fn differences(&self, other: &Self) -> Vec<String> {
        let found = differences(self, other);
        self.messages(other, found.iter())
    }

    /// Every setting in which the two differ, except budgets that `self` has raised.
    #[must_use]
    pub(crate) fn differences_except_raised_budgets(&self, other: &Self) -> Vec<String> {
        let is_raised =
            |difference: &Difference| difference.here.as_f64() > difference.there.as_f64();
        let counts = |difference: &&Difference| {
            !BUDGETS.contains(&difference.key.as_str()) || !is_raised(difference)
        };
        let found = differences(self, other);
        self.messages(other, found.iter().filter(counts))
    }

    /// The differences in words. The inputs are described in words, because users do not know the numbers that represent them.
    fn messages<'a>(
        &self,
        other: &Self,
        found: impl Iterator<Item = &'a Difference>,
    ) -> Vec<String> {
        let mut messages: Vec<String> = found
            .filter(|difference| !difference.key.starts_with("inputs."))
            .map(Difference::to_string)
            .collect();
        if self.inputs != other.inputs {
            messages.push(self.inputs.difference(&other.inputs));
        }
        messages
    }
}

/// Whether a file does not exist, or its folder is a file.
fn is_missing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(overrides: &[&str]) -> DatasetSettings {
        let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
        DatasetSettings::new(
            &crate::config::load("base", &overrides).unwrap().config,
            &[],
            None,
        )
    }

    #[test]
    fn differences_are_named_and_budgets_may_only_rise() {
        let base = settings(&[]);
        assert_eq!(base.differences(&base), Vec::<String>::new());
        let other = settings(&["label.theta_deg=12", "label.watchdog_s=900"]);
        let named = [
            "label.theta_deg is 12.0, not 8.0",
            "label.watchdog_s is 900, not 300",
        ];
        assert_eq!(other.differences(&base), named);
        assert_eq!(other.differences_except_raised_budgets(&base), named[..1]);
        assert_eq!(base.differences_except_raised_budgets(&other).len(), 2);
        let mut more = base.clone();
        more.inputs = Inputs {
            n_inputs: 1,
            bytes: 7,
            sha256: "ab".to_owned(),
        };
        let named = [
            "the inputs are now 1 file of 7 bytes, and they were 0 files of 0 bytes; their names or sizes differ",
        ];
        assert_eq!(
            (
                more.differences(&base),
                more.differences_except_raised_budgets(&base)
            ),
            (
                named.map(str::to_owned).to_vec(),
                named.map(str::to_owned).to_vec()
            )
        );
    }
}
