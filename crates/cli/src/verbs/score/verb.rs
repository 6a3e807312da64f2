//! Defines the arguments of `score`, computes the scores of each file, and prints the tables.

use super::shape_file::ShapeFile;
use crate::MISSED_BOUND;
use crate::config::ClustererName;
use crate::counted::counted;
use crate::program_version::commit_or_version;
use crate::standard_input::{STDIN_NAME, is_standard_input, with_standard_input};
use crate::stderr;
use crate::stdout::{print_result, print_result_tables};
use crate::usage::{UsageError, as_usage_error};
use anyhow::{Context, Result, ensure};
use partprobe_carrier::sha256_hex;
use partprobe_cluster::ClustererSettings;
use partprobe_dataset::{json_document, write_atomically};
use partprobe_eval::{
    Bootstrap, ExpectationOutcome, Expectations, PointEmbeddings, PointScores, ScoreRow,
    TableSettings, Tables, TrainingFigures, junit_xml, tables,
};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::slice;

/// The name that is used as supervision and as reference in tables and expectations.
const SCORED: &str = "scored";
const REFERENCE: &str = "reference";

/// The column of clusters that were predicted, and not computed here.
const PREDICTED: &str = "predicted";

/// Score predictions of other programs: clusters or embeddings of points, with reference labels
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe score predictions/
  partprobe score predictions/ --expect bounds.toml --junit report.xml
  python predict.py bracket.step | partprobe score -

Each <id>.npz in the folder is a shape; one such file, or `-` for the standard input, is scored alone. It contains `reference`, a label per point (a negative one is ignored), and at least one
of `predicted`, a cluster per point, and `embedding`, a row per point. With `points` (three coordinates per point) there is a
boundary accuracy; `normals` then distinguish the two sides of a thin wall. Embeddings are clustered into as many clusters as the
reference has parts. A file that cannot be scored is named, and the others are scored.

A file of bounds has lines such as `miou = \">= 0.5\"` or `\"k-means.accuracy\" = \">= 0.7\"`. A bound must name its column, such as
k-means or predicted, if there are several.
Exit codes: 0 done, 1 no bound is missed, but a file could not be scored, 3 a bound is missed.")]
pub(crate) struct ScoreArgs {
    /// The folder with the files, or one file; `-` is the standard input.
    #[arg(value_name = "PATH")]
    path: PathBuf,
    /// How embeddings are clustered: k-means, average-link or modes; may be given several times.
    #[arg(long, value_name = "NAME", default_value = "k-means", value_parser = clusterer)]
    clusterer: Vec<ClustererName>,
    /// k-means: the number of random restarts.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..))]
    restarts: u16,
    /// k-means: the seed.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// A TOML file with bounds on the scores.
    #[arg(long, value_name = "FILE")]
    expect: Option<PathBuf>,
    /// Write the outcome of each bound as a JUnit report.
    #[arg(long, value_name = "FILE", requires = "expect")]
    junit: Option<PathBuf>,
    /// Print JSON: the tables, the scores of each shape, and the files that could not be scored.
    #[arg(long)]
    json: bool,
}

fn clusterer(name: &str) -> Result<ClustererName, String> {
    let value = serde_json::Value::String(name.to_owned());
    serde_json::from_value(value).map_err(|error| error.to_string())
}

/// The JSON output.
#[derive(Serialize)]
struct Scored<'a> {
    tables: &'a Tables,
    shapes: &'a [ScoreRow],
    failed: &'a [FailedFile],
}

/// A file that could not be scored.
#[derive(Clone, Debug, Serialize)]
struct FailedFile {
    file: String,
    reason: String,
}

/// Scores the file, or all files of the folder. The exit code shows whether a file failed or a bound is missed.
///
/// # Errors
/// If the folder has no files, the bounds cannot be read, or a report cannot be written.
pub(crate) fn score(args: &ScoreArgs) -> Result<ExitCode> {
    let bounds = args.expect.as_deref().map(read_bounds).transpose();
    let bounds = bounds.map_err(as_usage_error)?.unwrap_or_default();
    // The file of the standard input exists as long as the second value.
    let (paths, _standard_input) =
        with_standard_input(slice::from_ref(&args.path), STDIN_NAME, u64::MAX)?;
    let files = npz_files(&paths[0])?;

    let scored: Vec<Result<ScoredFile>> = files
        .par_iter()
        .map(|file| args.scored_file(file))
        .collect();
    let mut rows = Vec::new();
    let mut failed = Vec::new();
    let mut data = String::new();
    for (file, outcome) in files.iter().zip(scored) {
        match outcome {
            Ok(found) => {
                data.push_str(&found.sha256);
                rows.extend(found.rows);
            }
            Err(error) => {
                let file = shown(file, &args.path);
                stderr::print_line(format_args!("{file}: {error:#}"));
                failed.push(FailedFile {
                    file,
                    reason: format!("{error:#}"),
                });
            }
        }
    }
    ensure!(
        !rows.is_empty(),
        "{}",
        match files.len() {
            1 => "the file could not be scored".to_owned(),
            n => format!("none of the {n} files could be scored"),
        }
    );

    bounds.ensure_clear(&rows)?;

    let tables = tables(
        &rows,
        &args.table_settings(&rows, &sha256_hex(data.as_bytes())),
    );
    let outcomes = bounds
        .expectations
        .evaluate(&tables, &TrainingFigures::default());
    let outcomes = outcomes.map_err(|error| as_usage_error(error.into()))?;
    args.print(&tables, &rows, &failed, &outcomes)?;
    Ok(if outcomes.iter().any(|outcome| !outcome.passed) {
        ExitCode::from(MISSED_BOUND)
    } else if failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

impl ScoreArgs {
    fn print(
        &self,
        tables: &Tables,
        shapes: &[ScoreRow],
        failed: &[FailedFile],
        outcomes: &[ExpectationOutcome],
    ) -> Result<()> {
        if let Some(path) = &self.junit {
            write_atomically(path, junit_xml("partprobe score", outcomes).as_bytes())?;
        }
        if self.json {
            let document = json_document(&Scored {
                tables,
                shapes,
                failed,
            })?;
            return print_result(String::from_utf8_lossy(&document).trim_end());
        }
        print_result_tables(tables.to_markdown())?;
        if !failed.is_empty() {
            print_result(format_args!(
                "{} could not be scored",
                counted(failed.len(), "file", "files")
            ))?;
        }
        outcomes.iter().try_for_each(print_result)
    }

    /// The scores of one file: a row for predicted clusters, and one per clusterer for embeddings.
    fn scored_file(&self, path: &Path) -> Result<ScoredFile> {
        let bytes = fs::read(path)?;
        let file = ShapeFile::read(&bytes)?;
        let id = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let mut rows = Vec::new();
        if let Some(predicted) = &file.predicted {
            let near = file.near_boundary.as_deref();
            let found = PointScores::of_clusters(predicted, &file.reference, near)?;
            rows.push(row(&id, PREDICTED, found));
        }
        if let Some(embedded) = &file.embedded {
            for &clusterer in &self.clusterer {
                rows.push(self.embedded_row(&id, embedded, &file, clusterer)?);
            }
        }
        Ok(ScoredFile {
            rows,
            sha256: sha256_hex(&bytes),
        })
    }

    fn embedded_row(
        &self,
        id: &str,
        embedded: &PointEmbeddings,
        file: &ShapeFile,
        clusterer: ClustererName,
    ) -> Result<ScoreRow> {
        let found = embedded.score(
            id,
            &file.reference,
            file.near_boundary.as_deref(),
            clusterer.clusterer(&self.settings()).as_ref(),
            self.seed,
        )?;
        Ok(row(id, clusterer.name(), found))
    }

    fn settings(&self) -> ClustererSettings {
        ClustererSettings {
            restarts: usize::from(self.restarts),
            max_iterations: 300,
            tolerance: 1e-6,
        }
    }

    /// The settings of the tables. Bounds without a column mean the first one. Such bounds are only allowed if there is only one
    /// column.
    fn table_settings(&self, rows: &[ScoreRow], data_hash: &str) -> TableSettings {
        TableSettings {
            bin_reference: REFERENCE.to_owned(),
            clusterer: rows[0].clusterer.clone(),
            compared: Vec::new(),
            primary: Vec::new(),
            seed_deviation: None,
            bootstrap: Bootstrap {
                draws: 0,
                seed: 0,
                least_groups: 2,
            },
            footer: self.footer(rows, data_hash),
        }
    }

    /// The sentences below the tables: the settings that this program knows.
    fn footer(&self, rows: &[ScoreRow], data_hash: &str) -> Vec<String> {
        let is_clustered = rows.iter().any(|row| row.clusterer != PREDICTED);
        let names: Vec<&str> = self.clusterer.iter().map(|found| found.name()).collect();
        let clustering = match is_clustered {
            true => format!(
                "embeddings clustered by {} with {} restarts and seed {}, K of the reference (`modes` finds its own K); ",
                names.join(", "),
                self.restarts,
                self.seed
            ),
            false => String::new(),
        };
        vec![format!(
            "The points, their normals and the training are those of the program that wrote the files; {clustering}commit {}, data {}.",
            commit_or_version(),
            &data_hash[..12],
        )]
    }
}

/// The scores of one file.
struct ScoredFile {
    rows: Vec<ScoreRow>,
    /// The SHA-256 of its bytes.
    sha256: String,
}

fn row(id: &str, clusterer: &str, found: PointScores) -> ScoreRow {
    ScoreRow {
        shape: id.to_owned(),
        supervision: SCORED.to_owned(),
        seed: 0,
        reference: REFERENCE.to_owned(),
        clusterer: clusterer.to_owned(),
        k: found.k,
        scores: found.scores,
        group: id.to_owned(),
    }
}

/// The name of a file in messages. That of the standard input is a copy with a path that means nothing to the user.
fn shown(file: &Path, given: &Path) -> String {
    if is_standard_input(given) {
        "the standard input".to_owned()
    } else {
        file.display().to_string()
    }
}

/// The `.npz` files of a folder, by name. A file is the only one.
fn npz_files(folder: &Path) -> Result<Vec<PathBuf>> {
    if folder.is_file() {
        return Ok(vec![folder.to_owned()]);
    }
    let entries = fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()));
    let mut files = Vec::new();
    for entry in entries.map_err(as_usage_error)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "npz") {
            files.push(path);
        }
    }
    files.sort();
    ensure!(
        !files.is_empty(),
        UsageError(format!("{} holds no .npz file", folder.display()))
    );
    Ok(files)
}

/// The bounds that scores must meet.
#[derive(Debug, Default)]
struct Bounds {
    expectations: Expectations,
    /// The keys that only name a metric.
    without_column: Vec<String>,
}

impl Bounds {
    /// Checks that each bound refers to one column.
    fn ensure_clear(&self, rows: &[ScoreRow]) -> Result<(), UsageError> {
        let columns: BTreeSet<&str> = rows.iter().map(|row| row.clusterer.as_str()).collect();
        match (self.without_column.first(), columns.first()) {
            (Some(key), Some(column)) if columns.len() > 1 => Err(UsageError(format!(
                "the bound `{key}` does not say which column it is about: {}; write `\"{column}.{key}\"`",
                Vec::from_iter(columns.iter().copied()).join(", ")
            ))),
            _ => Ok(()),
        }
    }
}

/// Reads bounds. A key names a metric, `<column>.<metric>`, or a score in the form of `[expect]` in a config.
fn read_bounds(path: &Path) -> Result<Bounds> {
    let text = fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))?;
    let table: toml::Table = toml::from_str(&text).with_context(|| path.display().to_string())?;
    let keyed = match table.get("expect").and_then(toml::Value::as_table) {
        Some(inner) => inner.clone(),
        None => table,
    };
    ensure!(
        !keyed.is_empty(),
        "{} has no bound; write for example `miou = \">= 0.6\"`",
        path.display()
    );
    let mut entries = Vec::new();
    for (key, value) in &keyed {
        let bound = value.as_str().with_context(|| {
            format!(
                "{}: `{key}` must be a text such as \">= 0.5\"",
                path.display()
            )
        })?;
        entries.push((full_key(key), bound));
    }
    let entries = entries.iter().map(|(key, bound)| (key.as_str(), *bound));
    let without_column = keyed.keys().filter(|key| !key.contains(['.', '/']));
    Ok(Bounds {
        expectations: Expectations::parse(entries)?,
        without_column: without_column.cloned().collect(),
    })
}

fn full_key(key: &str) -> String {
    if key.contains('/') {
        return key.to_owned();
    }
    match key.split_once('.') {
        Some((column, metric)) => format!("{SCORED}/{REFERENCE}@{column}.{metric}"),
        None => format!("{SCORED}/{REFERENCE}.{key}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_keys_become_scores() {
        assert_eq!(full_key("miou"), "scored/reference.miou");
        assert_eq!(full_key("k-means.ari"), "scored/reference@k-means.ari");
        assert_eq!(full_key("a/b.miou"), "a/b.miou");
    }
}
