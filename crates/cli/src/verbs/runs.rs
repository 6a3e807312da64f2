//! Runs `partprobe runs`: it lists run folders, each with its data, its sources and its main score.

use crate::markdown_table::{Alignment, markdown_table};
use crate::run_path::run_path;
use crate::stdout::{print_line, print_tables};
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::json_document;
use serde::Serialize;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// List the run folders in a folder
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe runs
  partprobe runs experiments/ --json

A run is `scored` if it is complete, `trained` if it has weights but no scores, and `started` otherwise. The mIoU is that of its
first label source against its first reference. A run of the implicit probe has no test shapes: all of its shapes are fitted, and
its tables are in tables.md. The folder of a verdict is listed with the run in it, which has scores after `partprobe eval`.")]
pub(crate) struct RunsArgs {
    /// The folder that contains the run folders.
    #[arg(value_name = "DIR", default_value = "runs")]
    folder: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// The facts of a run folder. Missing or damaged facts are `None`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
struct ListedRun {
    run: String,
    state: &'static str,
    started_unix_s: Option<u64>,
    supervision: Vec<String>,
    seeds: Vec<u64>,
    n_test: Option<usize>,
    miou: Option<f64>,
}

/// Lists the runs by name.
///
/// # Errors
/// If the folder cannot be read.
pub(crate) fn runs(args: &RunsArgs) -> Result<()> {
    ensure!(
        args.folder.is_dir(),
        UsageError(format!("{} is not a folder", args.folder.display()))
    );
    let listed = listed_runs(&args.folder)?;
    if args.json {
        let document = json_document(&listed)?;
        return print_line(String::from_utf8_lossy(&document).trim_end());
    }
    let heading = [
        "run",
        "state",
        "label sources",
        "seeds",
        "test shapes",
        "mIoU",
    ];
    let alignment = [
        Alignment::Left,
        Alignment::Left,
        Alignment::Left,
        Alignment::Right,
        Alignment::Right,
        Alignment::Right,
    ];
    print_tables(markdown_table(heading, alignment, listed.iter().map(cells)))
}

fn cells(run: &ListedRun) -> [String; 6] {
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
    [
        run.run.clone(),
        run.state.to_owned(),
        run.supervision.join(", "),
        run.seeds.len().to_string(),
        or_dash(run.n_test.map(|n| n.to_string())),
        or_dash(run.miou.map(|miou| format!("{miou:.3}"))),
    ]
}

fn listed_runs(folder: &Path) -> Result<Vec<ListedRun>> {
    let entries = fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))?;
    let mut listed = Vec::new();
    for entry in entries {
        let entry = entry?;
        let path = run_path(&entry.path());
        if path.join("config.toml").is_file() {
            let name = entry.file_name().to_string_lossy().into_owned();
            listed.push(listed_run(name, &path));
        }
    }
    ensure!(
        !listed.is_empty(),
        UsageError(format!("{} holds no run folder", folder.display()))
    );
    listed.sort_by(|a, b| a.run.cmp(&b.run));
    Ok(listed)
}

fn listed_run(name: String, path: &Path) -> ListedRun {
    let json = |file: &str| -> Option<Value> {
        serde_json::from_slice(&fs::read(path.join(file)).ok()?).ok()
    };
    let config: Option<toml::Table> = fs::read_to_string(path.join("config.toml"))
        .ok()
        .and_then(|text| toml::from_str(&text).ok());
    let compare = |key: &str| -> Vec<toml::Value> {
        let compare = config.as_ref().and_then(|config| config.get("compare"));
        let list = compare.and_then(|compare| compare.get(key)?.as_array().cloned());
        list.unwrap_or_default()
    };
    let supervision: Vec<String> = compare("supervision")
        .iter()
        .filter_map(|name| Some(name.as_str()?.to_owned()))
        .collect();
    let seeds: Vec<u64> = compare("seeds")
        .iter()
        .filter_map(|seed| u64::try_from(seed.as_integer()?).ok())
        .collect();

    let is_implicit = config
        .as_ref()
        .is_some_and(|config| config.contains_key("implicit"));
    let tables = json("tables.json");
    let row_of = |name: &String| {
        let rows = tables.as_ref()?["rows"].as_array()?;
        rows.iter().find(|row| row["supervision"] == name.as_str())
    };
    let miou = supervision
        .first()
        .and_then(row_of)
        .and_then(|row| row["means"]["miou"].as_f64());
    // An evaluation before the last training has the rows without a training, but lacks some of these rows.
    let has_scores = supervision.iter().all(|name| row_of(name).is_some());
    ListedRun {
        run: name,
        state: match is_implicit {
            true => state_of_implicit(path),
            false => state(path, has_scores, &supervision, &seeds),
        },
        started_unix_s: json("run.json").and_then(|run| run["started_unix_s"].as_u64()),
        n_test: json("split.json").and_then(|split| Some(split["test"].as_array()?.len())),
        supervision,
        seeds,
        miou,
    }
}

/// The implicit probe writes its tables at the end, and has no weights.
fn state_of_implicit(path: &Path) -> &'static str {
    match path.join("tables.csv").is_file() {
        true => "scored",
        false => "started",
    }
}

fn state(path: &Path, has_scores: bool, supervision: &[String], seeds: &[u64]) -> &'static str {
    let is_trained = |source: &String, seed: &u64| {
        let weights = format!("checkpoints/{source}-{seed}/model.safetensors");
        path.join(weights).is_file()
    };
    let mut trainings = supervision
        .iter()
        .flat_map(|source| seeds.iter().map(move |seed| (source, seed)));
    if has_scores && path.join("scores.jsonl").is_file() {
        "scored"
    } else if trainings.all(|(source, seed)| is_trained(source, seed)) {
        "trained"
    } else {
        "started"
    }
}
