//! Writes `run.json`: versions, machine and times of a run. Nothing else may depend on them.

use super::execution::Execution;
use super::folder::RunFolder;
use crate::program_version::COMMIT;
use crate::usage::UsageError;
use anyhow::{Result, bail};
use serde::Serialize;
use serde_json::Value;
use std::time::{SystemTime, UNIX_EPOCH};

/// The version that the workspace pins exactly.
pub(crate) const BURN_VERSION: &str = "0.22.1";

/// The machine, the versions and the times of a run.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct RunRecord {
    pub(crate) format_version: u32,
    pub(crate) program: &'static str,
    pub(crate) version: &'static str,
    pub(crate) burn: &'static str,
    /// The commit from which the program was built, or `None` if it is not known.
    pub(crate) commit: Option<&'static str>,
    pub(crate) backend: String,
    pub(crate) threads: usize,
    pub(crate) host: Host,
    pub(crate) data: Vec<String>,
    /// The settings of the given labeled data set, from its `dataset.json`.
    pub(crate) data_set: Option<Value>,
    pub(crate) started_unix_s: u64,
    /// Seconds of each stage, in the order in which they ran.
    pub(crate) stage_seconds: Vec<(String, f64)>,
}

/// The file's name in the run folder.
const FILE: &str = "run.json";

impl RunRecord {
    /// The data that are known before any work.
    pub(crate) fn new(execution: &Execution, data: Vec<String>, data_set: Option<Value>) -> Self {
        Self {
            format_version: partprobe_formats::FORMAT_VERSION,
            program: "partprobe",
            version: env!("CARGO_PKG_VERSION"),
            burn: BURN_VERSION,
            commit: COMMIT,
            backend: execution.backend_name.to_owned(),
            threads: execution.threads,
            host: Host::of_this_machine(),
            data,
            data_set,
            started_unix_s: unix_seconds(),
            stage_seconds: Vec::new(),
        }
    }

    /// Writes the data that are known so far. A resumed run must have the same data, backend and program as at its start.
    ///
    /// # Errors
    /// If it has others, or the file cannot be written.
    pub(crate) fn begin_run(&self, folder: &RunFolder) -> Result<()> {
        if let Some(former) = Self::former(folder)? {
            self.refuse_differences(&former, &["version", "backend", "data"])?;
        }
        self.write(folder)
    }

    /// The same for a training. Its data are identified by the split, for any path of the data. An existing record of a run is
    /// kept.
    ///
    /// # Errors
    /// The same as for [`begin_run`](Self::begin_run).
    pub(crate) fn begin_training(&self, folder: &RunFolder) -> Result<()> {
        match Self::former(folder)? {
            Some(former) => self.refuse_differences(&former, &["version", "backend"]),
            None => self.write(folder),
        }
    }

    /// Writes the record.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(crate) fn write(&self, folder: &RunFolder) -> Result<()> {
        folder.write_json(FILE, self)
    }

    fn former(folder: &RunFolder) -> Result<Option<Value>> {
        if !folder.path(FILE).exists() {
            return Ok(None);
        }
        folder
            .read_json(
                FILE,
                "put back a copy of the file, or make a new run folder",
            )
            .map(Some)
    }

    fn refuse_differences(&self, former: &Value, keys: &[&str]) -> Result<()> {
        let own = serde_json::to_value(self)?;
        let differs = |key: &&&str| own[**key] != former[**key];
        let others: Vec<String> = keys
            .iter()
            .filter(differs)
            .map(|key| format!("{key} {}, not {}", former[*key], own[*key]))
            .collect();
        if others.is_empty() {
            return Ok(());
        }
        bail!(UsageError(format!(
            "the run began with {}; resume with the same, or choose another --out",
            others.join(" and ")
        )))
    }
}

/// The machine.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Host {
    os: &'static str,
    architecture: &'static str,
    instruction_set: Vec<&'static str>,
    cores: usize,
}

impl Host {
    /// Reads the data of this machine.
    pub(crate) fn of_this_machine() -> Self {
        Self {
            os: std::env::consts::OS,
            architecture: std::env::consts::ARCH,
            instruction_set: instruction_set(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
        }
    }
}

#[cfg(target_arch = "x86_64")]
fn instruction_set() -> Vec<&'static str> {
    let features = [
        ("avx2", std::arch::is_x86_feature_detected!("avx2")),
        ("fma", std::arch::is_x86_feature_detected!("fma")),
        ("avx512f", std::arch::is_x86_feature_detected!("avx512f")),
    ];
    features
        .into_iter()
        .filter(|(_, present)| *present)
        .map(|(name, _)| name)
        .collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn instruction_set() -> Vec<&'static str> {
    Vec::new()
}

/// Seconds since 1970, in UTC.
pub(crate) fn unix_seconds() -> u64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |elapsed| elapsed.as_secs())
}

/// Today in UTC as `YYYY-MM-DD`, for the names of run folders.
pub(crate) fn today() -> String {
    date_of(unix_seconds())
}

/// The date in UTC as `YYYY-MM-DD`.
pub(super) fn date_of(unix_s: u64) -> String {
    let (year, month, day) = civil_from_days((unix_s / 86_400) as i64);
    format!("{year:04}-{month:02}-{day:02}")
}

/// The Gregorian date of a day counted from 1970-01-01, by the 400-year cycle of 146 097 days.
fn civil_from_days(days: i64) -> (i64, i64, i64) {
    let shifted = days + 719_468;
    let era = shifted.div_euclid(146_097);
    let day_of_era = shifted.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 {
        month_from_march + 3
    } else {
        month_from_march - 9
    };
    (year_of_era + era * 400 + i64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_recorded_burn_is_the_pinned_one() {
        let manifest = include_str!("../../../../Cargo.toml");
        assert!(manifest.contains(&format!("burn = {{ version = \"={BURN_VERSION}\"")));
    }

    #[test]
    fn dates_of_known_days() {
        for (days, expected) in [
            (0, (1970, 1, 1)),
            (11_016, (2000, 2, 29)),
            (20_779, (2026, 11, 22)),
            (-1, (1969, 12, 31)),
        ] {
            assert_eq!(civil_from_days(days), expected);
        }
    }
}
