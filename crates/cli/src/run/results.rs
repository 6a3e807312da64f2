//! Writes the results of a run: score lines, tables, the report, and the expectations that decide the exit code.

use super::bounds::bound_names;
use super::evaluation::{NO_NETWORK, UNTRAINED};
use super::folder::RunFolder;
use super::page::{FaceSource, PageScores, page};
use super::stages::Run;
use super::training_job::TrainingRecord;
use crate::MISSED_BOUND;
use crate::config::Config;
use crate::stdout::print_result;
use anyhow::Result;
use partprobe_eval::{
    Bootstrap, ExpectationOutcome, Expectations, ScoreRow, TableSettings, TrainingFigures, tables,
};
use std::process::ExitCode;

/// Refuses expectations that no run can meet or miss, before any work is done.
///
/// # Errors
/// If a key or a bound cannot be read, or names what the config does not compare.
pub(crate) fn checked_expectations(config: &Config) -> Result<Expectations> {
    let expectations = Expectations::parse(
        config
            .expect
            .iter()
            .map(|(key, bound)| (key.as_str(), bound.as_str())),
    )?;
    let bounds = bound_names(config);
    let trained = config.compare.supervision.iter().chain(&bounds);
    let rows = trained.map(String::as_str);
    let supervision: Vec<&str> = rows.chain([UNTRAINED, NO_NETWORK]).collect();
    let references = config.references();
    expectations.check_names(
        &supervision,
        &references.iter().map(String::as_str).collect::<Vec<_>>(),
    )?;
    Ok(expectations)
}

impl Run<'_> {
    /// Writes `report.html`, `tables.*` and, last, `scores.jsonl`, prints the table, and checks the expectations.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub(crate) fn write_results(&self, rows: &[ScoreRow]) -> Result<ExitCode> {
        let folder = self.folder;
        let tables = tables(rows, &table_settings(self.config));
        let figures = training_figures(folder, self.config)?;
        let outcomes = checked_expectations(self.config)?.evaluate(&tables, &figures)?;
        let scores = PageScores {
            tables: &tables,
            rows,
            outcomes: &outcomes,
            summary: &self.data.split_file.selection.to_string(),
        };

        let page = page(folder, self.config, &scores, &FaceSource::Stored)?;
        folder.write("report.html", page.as_bytes())?;
        folder.write("tables.md", tables.to_markdown().as_bytes())?;
        folder.write("tables.csv", tables.to_csv().as_bytes())?;
        folder.write("tables.json", tables.to_json().as_bytes())?;
        // A folder that has its scores is complete.
        write_scores(folder, rows)?;

        // What was selected, and how labels collide in tokens, was said on stderr before the training.
        print_result(tables.to_markdown())?;
        print_result(format_args!("run folder: {}", folder.root().display()))?;
        print_expectations(&outcomes)
    }
}

/// What the trainings of the folder say of themselves.
pub(super) fn training_figures(folder: &RunFolder, config: &Config) -> Result<TrainingFigures> {
    let mut figures = TrainingFigures::default();
    for supervision in &config.compare.supervision {
        for &seed in &config.compare.seeds {
            let Some(record) = TrainingRecord::read(folder, supervision, seed)? else {
                continue;
            };
            let worst = figures
                .untouched_tensors
                .entry(supervision.clone())
                .or_default();
            *worst = record.untouched_tensors.len().max(*worst);
        }
    }
    Ok(figures)
}

fn write_scores(folder: &RunFolder, rows: &[ScoreRow]) -> Result<()> {
    let mut lines = String::new();
    for row in rows {
        lines.push_str(&serde_json::to_string(row)?);
        lines.push('\n');
    }
    folder.write("scores.jsonl", lines.as_bytes())
}

/// The first two supervision sources are the pair whose difference is reported.
pub(crate) fn table_settings(config: &Config) -> TableSettings {
    let compared = match config.compare.supervision.as_slice() {
        [first, second, ..] => Some([first.clone(), second.clone()]),
        _ => None,
    };
    TableSettings {
        bin_reference: config.references()[0].clone(),
        clusterer: config.eval.clusterers[0].name().to_owned(),
        compared,
        bootstrap: Bootstrap {
            draws: config.eval.bootstrap,
            seed: config.eval.seed,
            least_groups: Bootstrap::LEAST_GROUPS,
        },
    }
}

/// Says which expectations hold; the exit code is 3 if one does not.
fn print_expectations(outcomes: &[ExpectationOutcome]) -> Result<ExitCode> {
    for outcome in outcomes {
        let verdict = if outcome.passed { "met" } else { "MISSED" };
        print_result(format_args!(
            "expectation {verdict}: {}, found {:.4}",
            outcome.text, outcome.value
        ))?;
    }
    Ok(if outcomes.iter().all(|outcome| outcome.passed) {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(MISSED_BOUND)
    })
}
