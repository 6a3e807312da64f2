//! Reads the facts of a run from `run.json` and the records of trainings: versions, data, machine and times.

use crate::counted::counted;
use crate::run::folder::RunFolder;
use anyhow::Result;
use partprobe_report::Fact;
use serde_json::Value;

/// The advice for a damaged file.
const ADVICE: &str = "remove the file, and the report is made without it";

/// The facts of a run. There are none without its `run.json`.
///
/// # Errors
/// If the file is damaged.
pub(super) fn facts(folder: &RunFolder) -> Result<Vec<Fact>> {
    if !folder.path("run.json").exists() {
        return Ok(Vec::new());
    }
    let run: Value = folder.read_json("run.json", ADVICE)?;
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let listed = |value: &Value| -> Option<String> {
        let items: Vec<&str> = value.as_array()?.iter().filter_map(Value::as_str).collect();
        (!items.is_empty()).then(|| items.join(", "))
    };
    let inputs = &run["data_set"]["inputs"];
    let host = &run["host"];
    let named = [
        (
            "program",
            text(&run["version"]).map(|version| {
                format!(
                    "partprobe {version}, burn {}",
                    run["burn"].as_str().unwrap_or("?")
                )
            }),
        ),
        ("commit", text(&run["commit"])),
        ("data", listed(&run["data"])),
        ("data hash", text(&inputs["sha256"])),
        (
            "labeled inputs",
            inputs["n_inputs"].as_u64().map(|n| {
                let megabytes = inputs["bytes"].as_f64().unwrap_or(0.0) / 1e6;
                format!(
                    "{} ({megabytes:.0} MB)",
                    counted(n as usize, "file", "files")
                )
            }),
        ),
        ("started", run["started_unix_s"].as_u64().map(utc_text)),
        ("time", time_text(&run["stage_seconds"])),
        (
            "host",
            text(&host["os"]).map(|os| {
                let cores = host["cores"].as_u64().unwrap_or(0) as usize;
                let units = listed(&host["instruction_set"])
                    .map_or_else(String::new, |units| format!(", {units}"));
                format!(
                    "{os}, {}, {}{units}",
                    host["architecture"].as_str().unwrap_or("?"),
                    counted(cores, "core", "cores")
                )
            }),
        ),
        (
            "computed by",
            text(&run["backend"]).map(|backend| {
                let threads = run["threads"].as_u64().unwrap_or(0) as usize;
                format!("{backend}, {}", counted(threads, "thread", "threads"))
            }),
        ),
    ];
    let known = named
        .into_iter()
        .filter_map(|(name, value)| Some(Fact::new(name, value?)));
    Ok(known.collect())
}

/// The longest stages, and the sum of all stages.
fn time_text(stages: &Value) -> Option<String> {
    let stages: Vec<(&str, f64)> = stages
        .as_array()?
        .iter()
        .filter_map(|stage| Some((stage[0].as_str()?, stage[1].as_f64()?)))
        .collect();
    let total: f64 = stages.iter().map(|stage| stage.1).sum();
    let longest = stages.iter().filter(|stage| stage.1 >= 0.01 * total);
    let each: Vec<String> = longest
        .map(|(name, seconds)| format!("{name} {}", duration_text(*seconds)))
        .collect();
    (total > 0.0).then(|| format!("{}: {}", duration_text(total), each.join(", ")))
}

fn duration_text(seconds: f64) -> String {
    match seconds {
        seconds if seconds < 100.0 => format!("{seconds:.1} s"),
        seconds if seconds < 6000.0 => format!("{:.1} min", seconds / 60.0),
        seconds => format!("{:.1} h", seconds / 3600.0),
    }
}

fn utc_text(unix_s: u64) -> String {
    let (hours, minutes) = (unix_s / 3600 % 24, unix_s / 60 % 60);
    format!(
        "{} {hours:02}:{minutes:02} UTC",
        crate::run::host::date_of(unix_s)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn times_have_units() {
        let message = time_text(&json!([
            ["label", 0.01],
            ["train a-0", 7200.0],
            ["evaluate", 180.0]
        ]));
        assert_eq!(
            message.as_deref(),
            Some("2.1 h: train a-0 2.0 h, evaluate 3.0 min")
        );
        assert_eq!(
            [time_text(&json!([])), time_text(&json!(null))],
            [None, None]
        );
        assert_eq!(utc_text(1_795_976_283), "2026-11-29 18:18 UTC");
    }
}
