//! Collects the content of a run's report from its folder: scores, log, facts, and the points of its test shapes.

mod faces;
mod facts;
mod shapes;

pub(super) use faces::{FaceSource, face_members};

use super::collisions::Collisions;
use super::folder::RunFolder;
use super::footer::{Normals, TestShapes, footer};
use super::results::{outcomes, paper_comparison, table_settings};
use super::split_file::SplitFile;
use crate::config::{Config, load};
use crate::scored_run::ScoredRun;
use anyhow::Result;
use partprobe_eval::{ExpectationOutcome, ScoreRow, Tables, tables};
use partprobe_report::{Chart, RunReport};
use std::fs;
use std::path::Path;

/// The scores of a run, and the results that follow from them.
pub(super) struct PageScores<'a> {
    pub(super) tables: &'a Tables,
    pub(super) rows: &'a [ScoreRow],
    pub(super) outcomes: &'a [ExpectationOutcome],
    /// A sentence with the number of shapes.
    pub(super) summary: &'a str,
}

/// The page of a run whose `test/` and `predictions/` are written.
///
/// # Errors
/// If a file of the folder cannot be read.
pub(super) fn page(
    folder: &RunFolder,
    config: &Config,
    scores: &PageScores<'_>,
    faces: &FaceSource,
) -> Result<String> {
    with_report(folder, config, scores, faces, |report| report.to_html())
}

/// What a function makes of the report of a run.
fn with_report<T>(
    folder: &RunFolder,
    config: &Config,
    scores: &PageScores<'_>,
    faces: &FaceSource,
    make: impl FnOnce(&RunReport<'_>) -> T,
) -> Result<T> {
    let collisions = Collisions::read(folder)?.map(|found| found.to_string());
    let mut notes: Vec<String> = collisions.into_iter().collect();
    notes.extend(faces.note());
    let name = run_name(folder.root());
    let report = RunReport {
        name: &name,
        summary: scores.summary,
        notes: &notes,
        trained: &config.compare.supervision,
        tables: scores.tables,
        rows: scores.rows,
        outcomes: scores.outcomes,
        further: &further_tables(folder, scores.tables, config),
        log: &read_log(folder)?,
        facts: &facts::facts(folder)?,
        config: &folder.read_text("config.toml")?,
        shapes: &shapes::shapes(folder, config, scores, faces)?,
    };
    Ok(make(&report))
}

/// The paper's tables with the rows of the run, and the tables of each endpoint, if it was scored.
fn further_tables(folder: &RunFolder, tables: &Tables, config: &Config) -> Vec<String> {
    let mut texts: Vec<String> = paper_comparison(tables, config).into_iter().collect();
    for endpoint in &config.endpoints {
        let file = format!("endpoints/{}/tables.md", endpoint.name);
        if let Ok(text) = fs::read_to_string(folder.path(&file)) {
            texts.push(format!("### Endpoint {}\n\n{text}", endpoint.name));
        }
    }
    texts
}

/// The tables of a finished run, made from the scores in its folder with the statistics of this program.
///
/// # Errors
/// If the folder is not a scored run, or a file of it cannot be read.
pub(crate) fn tables_of_folder(root: &Path) -> Result<Tables> {
    let scored = ScoredRun::read(root)?;
    let folder = RunFolder::open_read_only(root)?;
    let config_file = folder.path("config.toml").to_string_lossy().into_owned();
    let config = load(&config_file, &[])?.config;
    let split = SplitFile::read(&folder, &config).ok().flatten();
    stored_tables(&scored, &config, split.as_ref())
}

fn stored_tables(scored: &ScoredRun, config: &Config, split: Option<&SplitFile>) -> Result<Tables> {
    let footer = split.map_or_else(Vec::new, |split| {
        footer(
            config,
            &scored.rows,
            &TestShapes::of_split(split),
            Normals::OfConfig,
        )
    });
    Ok(tables(&scored.rows, &table_settings(config, footer)?))
}

/// The page of a finished run, made only from its folder. Runs of earlier versions did not store the faces of points. Then the
/// points are drawn again from the data set if it exists.
///
/// # Errors
/// If the folder is not a scored run, or a file of it cannot be read.
pub(crate) fn page_of_folder(root: &Path, data: Option<&Path>) -> Result<String> {
    page_of_run(&RunFolder::open_read_only(root)?, data)
}

/// The charts of the page of a finished run.
///
/// # Errors
/// As for [`page_of_folder`].
pub(crate) fn charts_of_folder(root: &Path, data: Option<&Path>) -> Result<Vec<Chart>> {
    of_run(&RunFolder::open_read_only(root)?, data, |report| {
        report.charts()
    })
}

/// The page of a folder that is already open.
///
/// # Errors
/// As for [`page_of_folder`].
pub(crate) fn page_of_run(folder: &RunFolder, data: Option<&Path>) -> Result<String> {
    of_run(folder, data, |report| report.to_html())
}

/// What a function makes of the report of a finished run.
fn of_run<T>(
    folder: &RunFolder,
    data: Option<&Path>,
    make: impl FnOnce(&RunReport<'_>) -> T,
) -> Result<T> {
    let scored = ScoredRun::read(folder.root())?;
    let config_file = folder.path("config.toml").to_string_lossy().into_owned();
    let config = load(&config_file, &[])?.config;
    // For a run of an earlier version, the page is made without the list of the shapes that were left out.
    let split = SplitFile::read(folder, &config).ok().flatten();
    let tables = stored_tables(&scored, &config, split.as_ref())?;
    let outcomes = outcomes(folder, &config, &tables)?.outcomes;
    let summary = split.map_or_else(String::new, |split| split.selection.to_string());
    let scores = PageScores {
        tables: &tables,
        rows: &scored.rows,
        outcomes: &outcomes,
        summary: &summary,
    };
    with_report(
        folder,
        &config,
        &scores,
        &FaceSource::of(folder, data)?,
        make,
    )
}

/// The name of the folder.
fn run_name(root: &Path) -> String {
    let canonical = root.canonicalize().unwrap_or_else(|_| root.to_owned());
    canonical
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// The lines of `log.jsonl`. There are none if nothing was trained here.
fn read_log(folder: &RunFolder) -> Result<String> {
    if folder.path("log.jsonl").exists() {
        folder.read_text("log.jsonl")
    } else {
        Ok(String::new())
    }
}
