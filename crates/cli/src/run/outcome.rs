//! The end of a run: score lines, tables, the report, and the expectations that decide the exit code.

use super::collisions::Collisions;
use super::evaluation::{NO_NETWORK, UNTRAINED};
use super::folder::RunFolder;
use super::report::{Report, html};
use super::shapes::Selection;
use super::training::TrainingRecord;
use crate::config::Config;
use crate::stdout::print_result;
use anyhow::Result;
use partprobe_eval::{
    Bootstrap, ExpectationOutcome, Expectations, ScoreRow, TableSettings, TrainingFigures, tables,
};
use std::fmt;
use std::process::ExitCode;

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} of {} labeled shapes take part",
            self.taking_part, self.labeled
        )?;
        for (reason, ids) in &self.left_out {
            write!(f, "; {} left out: {reason}", ids.len())?;
        }
        Ok(())
    }
}

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
    let supervision = config.compare.supervision.iter().map(String::as_str);
    let supervision: Vec<&str> = supervision.chain([UNTRAINED, NO_NETWORK]).collect();
    let references = config.references();
    expectations.check_names(
        &supervision,
        &references.iter().map(String::as_str).collect::<Vec<_>>(),
    )?;
    Ok(expectations)
}

/// Writes `report.html`, `tables.*` and, last, `scores.jsonl`, prints the table, and checks the expectations.
///
/// # Errors
/// If a file cannot be written.
pub(crate) fn conclude(
    folder: &RunFolder,
    config: &Config,
    selection: &Selection,
    rows: &[ScoreRow],
) -> Result<ExitCode> {
    let tables = tables(rows, &table_settings(config));
    let outcomes =
        checked_expectations(config)?.evaluate(&tables, &training_figures(folder, config)?)?;
    let log = if folder.path("log.jsonl").exists() {
        folder.read_text("log.jsonl")?
    } else {
        String::new()
    };
    let collisions = Collisions::read(folder)?;
    let report = Report {
        collisions: collisions.as_ref(),
        tables: &tables,
        rows,
        selection,
        outcomes: &outcomes,
        log: &log,
        config: &folder.read_text("config.toml")?,
    };
    folder.write("report.html", html(&report).as_bytes())?;
    folder.write("tables.md", tables.to_markdown().as_bytes())?;
    folder.write("tables.csv", tables.to_csv().as_bytes())?;
    folder.write("tables.json", tables.to_json().as_bytes())?;
    // A folder that has its scores is complete.
    write_scores(folder, rows)?;
    // What was selected, and how labels collide in tokens, was said on stderr before the training.
    print_result(tables.to_markdown())?;
    print_result(format_args!("run folder: {}", folder.root().display()))?;
    tell(&outcomes)
}

/// What the trainings of the folder say of themselves.
fn training_figures(folder: &RunFolder, config: &Config) -> Result<TrainingFigures> {
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
        },
    }
}

/// Says which expectations hold; the exit code is 1 if one does not.
fn tell(outcomes: &[ExpectationOutcome]) -> Result<ExitCode> {
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
        ExitCode::FAILURE
    })
}
