//! Reads the scores of a finished run, and the label sources on which it was trained.

use crate::given_path::ensure_exists;
use crate::run_path::run_path;
use crate::usage::UsageError;
use anyhow::{Context, Result};
use partprobe_eval::ScoreRow;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The scores of a run.
pub(crate) struct ScoredRun {
    pub(crate) name: String,
    pub(crate) rows: Vec<ScoreRow>,
    /// The label sources on which it was trained, in the order of its config.
    pub(crate) supervision: Vec<String>,
    /// The identity of each shape. Runs of earlier programs do not have it.
    pub(crate) shape_hashes: BTreeMap<String, ShapeHashes>,
    /// The tables of its config that determine the scoring of backbones.
    pub(crate) scoring: BTreeMap<&'static str, toml::Value>,
    /// The tables of its config that determine the training of backbones, and on which shapes.
    pub(crate) training: BTreeMap<&'static str, toml::Value>,
}

/// The tables that determine the scoring of backbones.
const SCORING_TABLES: [&str; 3] = ["sample", "tokens", "eval"];
/// The tables that determine their training.
const TRAINING_TABLES: [&str; 8] = [
    "label", "select", "split", "augment", "net", "loss", "optim", "train",
];

impl ScoredRun {
    /// Reads `scores.jsonl` and `config.toml` of a run folder. Its name is that of the folder. The folder of a verdict means the
    /// run in it.
    ///
    /// # Errors
    /// If there is no such folder, the run was not scored, or a file cannot be read. The message names the line.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        ensure_exists(path)?;
        let name = path.canonicalize()?;
        let path = &run_path(path);
        let read = |file: &str| {
            let path = path.join(file);
            fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))
        };
        ensure_is_scored(path)?;
        let text = read("scores.jsonl")?;
        let mut rows = Vec::new();
        for (number, line) in (1..).zip(text.lines()) {
            let row: ScoreRow = serde_json::from_str(line)
                .with_context(|| format!("{}/scores.jsonl, line {number}", path.display()))?;
            rows.push(row);
        }
        let config: toml::Table = toml::from_str(&read("config.toml")?)
            .with_context(|| format!("{}/config.toml", path.display()))?;
        let compare = config
            .get("compare")
            .and_then(|compare| compare.get("supervision"));
        let supervision = compare
            .and_then(toml::Value::as_array)
            .into_iter()
            .flatten();
        let tables = |names: &[&'static str]| {
            let found = names
                .iter()
                .filter_map(|&name| Some((name, config.get(name)?.clone())));
            found.collect()
        };
        Ok(Self {
            shape_hashes: shape_hashes(path)?,
            scoring: tables(&SCORING_TABLES),
            training: tables(&TRAINING_TABLES),
            name: name
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            rows,
            supervision: supervision
                .filter_map(|name| Some(name.as_str()?.to_owned()))
                .collect(),
        })
    }
}

/// Refuses a folder without scores. The message says how a run gets them.
fn ensure_is_scored(path: &Path) -> Result<(), UsageError> {
    if path.join("scores.jsonl").is_file() {
        return Ok(());
    }
    let name = path.display();
    let Ok(config) = fs::read_to_string(path.join("config.toml")) else {
        return Err(UsageError(format!(
            "{name} is not a run folder: it has no config.toml"
        )));
    };
    let is_implicit = config
        .parse::<toml::Table>()
        .is_ok_and(|config| config.contains_key("implicit"));
    Err(UsageError(if is_implicit {
        format!("{name} is a run of the implicit probe, whose tables are in {name}/tables.md")
    } else {
        format!(
            "the run in {name} has no scores; finish it with --resume, or score its backbones with `partprobe eval {name}`"
        )
    }))
}

/// The identity of a shape in a run.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
pub(crate) struct ShapeHashes {
    /// The hash of its carrier: mesh, faces, labels and settings.
    content_hash: String,
    /// The hash of the labels that were imported for it, by source.
    #[serde(default)]
    imported: BTreeMap<String, String>,
}

impl ShapeHashes {
    /// The hashes that determine the labels of a source.
    pub(crate) fn of_labels(&self, source: &str) -> (&str, Option<&str>) {
        (
            &self.content_hash,
            self.imported.get(source).map(String::as_str),
        )
    }
}

/// The part of `split.json` that is read.
#[derive(Deserialize)]
struct StoredSplit {
    #[serde(default)]
    shapes: BTreeMap<String, ShapeHashes>,
}

/// The identity of each shape in `split.json`. It is empty if there is no such file.
fn shape_hashes(run: &Path) -> Result<BTreeMap<String, ShapeHashes>> {
    let file = run.join("split.json");
    if !file.exists() {
        return Ok(BTreeMap::new());
    }
    let text = fs::read_to_string(&file).with_context(|| format!("reading {}", file.display()))?;
    let split: StoredSplit =
        serde_json::from_str(&text).with_context(|| file.display().to_string())?;
    Ok(split.shapes)
}
