//! Writes the results of a run: score lines, tables, the report, and the expectations that determine the exit code.

use super::bounds::bound_names;
use super::endpoints::EndpointTables;
use super::evaluation::{NO_NETWORK, RANDOM_FOURIER, UNTRAINED};
use super::folder::RunFolder;
use super::footer::{Normals, TestShapes, footer};
use super::page::{FaceSource, PageScores, page};
use super::stages::Run;
use super::training_job::TrainingRecord;
use crate::MISSED_BOUND;
use crate::config::{Config, suggestion};
use crate::stderr;
use crate::stdout::{print_result, print_result_tables};
use crate::usage::UsageError;
use anyhow::{Result, anyhow, ensure};
use partprobe_carrier::STEP_PARTS;
use partprobe_eval::{
    Endpoint, EndpointError, ExpectationError, ExpectationOutcome, Expectations, MIOU, Metric,
    ScoreRow, TableSettings, Tables, TrainingFigures, junit_xml, tables,
};
use std::process::ExitCode;

/// The largest number of primary endpoints. With more of them, a correction for their number would be needed.
const MAX_PRIMARY: usize = 2;

/// Refuses invalid expectations and endpoints before any work is done.
///
/// # Errors
/// If a key, a bound or an endpoint cannot be read, or names what the config does not compare.
pub(crate) fn checked_expectations(config: &Config) -> Result<Expectations> {
    let expectations = Expectations::parse(
        config
            .expect
            .iter()
            .map(|(key, bound)| (key.as_str(), bound.as_str())),
    )
    .map_err(expectation_problem)?;
    primary_endpoints(config)?;
    let bounds = bound_names(config);
    let trained = config.compare.supervision.iter().chain(&bounds);
    let rows = trained.map(String::as_str);
    let supervision: Vec<&str> = rows
        .chain([UNTRAINED, RANDOM_FOURIER, NO_NETWORK])
        .collect();
    let references = config.references();
    let references: Vec<&str> = references.iter().map(String::as_str).collect();
    expectations
        .check_names(&supervision, &references)
        .map_err(expectation_problem)?;
    Ok(expectations)
}

/// The error with the name of its table, and with the name that may have been meant.
fn expectation_problem(error: ExpectationError) -> anyhow::Error {
    let (name, known) = match &error {
        ExpectationError::UnknownName { name, known, .. } => (name, known.clone()),
        ExpectationError::Metric { metric, .. } => (metric, Metric::known_names()),
        _ => return anyhow!("expect: {error}"),
    };
    anyhow!("expect: {error}{}", suggestion(name, &known))
}

impl Run<'_> {
    /// Checks the expectations, and writes `report.html`, `tables.*`, `expectations.*` and, last, `scores.jsonl`.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub(crate) fn write_results(&self, rows: &[ScoreRow]) -> Result<Results> {
        let folder = self.folder;
        let footer = footer(
            self.config,
            rows,
            &TestShapes::of_split(&self.data.split_file),
            Normals::OfConfig,
        );
        let tables = tables(rows, &table_settings(self.config, footer)?);
        let Outcomes {
            outcomes,
            unchecked,
        } = outcomes(folder, self.config, &tables)?;
        let scores = PageScores {
            tables: &tables,
            rows,
            outcomes: &outcomes,
            summary: &self.data.split_file.selection.to_string(),
        };

        let paper_comparison = paper_comparison(&tables, self.config);
        if let Some(text) = &paper_comparison {
            folder.write("paper.md", text.as_bytes())?;
        }
        let page = page(folder, self.config, &scores, &FaceSource::Stored)?;
        folder.write("report.html", page.as_bytes())?;
        folder.write("tables.md", tables.to_markdown().as_bytes())?;
        folder.write("tables.csv", tables.to_csv().as_bytes())?;
        folder.write("tables.json", tables.to_json().as_bytes())?;
        if !outcomes.is_empty() {
            folder.write_json("expectations.json", &outcomes)?;
            let report = junit_xml("partprobe run", &outcomes);
            folder.write("expectations.xml", report.as_bytes())?;
        }
        // A folder that has its scores is complete.
        write_scores(folder, rows)?;

        Ok(Results {
            tables: tables.to_markdown(),
            paper_comparison,
            outcomes,
            unchecked,
        })
    }

    /// Prints the tables and those of the endpoints, and reports which expectations are met. The exit code is 3 if one is missed.
    ///
    /// # Errors
    /// If an endpoint could not be scored, after everything was printed.
    pub(crate) fn print_results(
        &self,
        results: &Results,
        endpoints: EndpointTables,
    ) -> Result<ExitCode> {
        // The choice of the shapes, and the collisions of labels in tokens, were printed on stderr before the training.
        print_result_tables(&results.tables)?;
        endpoints.scored.iter().try_for_each(print_result_tables)?;
        if let Some(text) = &results.paper_comparison {
            print_result_tables(text)?;
        }
        print_result(format_args!("run folder: {}", self.folder.root().display()))?;
        for bound in &results.unchecked {
            stderr::print_line(format_args!(
                "not checked: {bound}: not all of its label sources have a trained backbone"
            ));
        }
        let exit_code = print_expectations(&results.outcomes)?;
        match endpoints.failed {
            None => Ok(exit_code),
            Some(error) => Err(error.context("all else of the run is written")),
        }
    }
}

/// The written results, for printing.
pub(crate) struct Results {
    tables: String,
    paper_comparison: Option<String>,
    outcomes: Vec<ExpectationOutcome>,
    /// The bounds that could not be checked yet.
    unchecked: Vec<String>,
}

/// The outcomes of the bounds of a config.
pub(super) struct Outcomes {
    pub(super) outcomes: Vec<ExpectationOutcome>,
    /// The bounds about a supervision without a backbone.
    unchecked: Vec<String>,
}

/// Checks the bounds of a config. A bound about a supervision without a backbone cannot be checked yet.
///
/// # Errors
/// If a bound is not valid, or a record of a training cannot be read.
pub(super) fn outcomes(folder: &RunFolder, config: &Config, tables: &Tables) -> Result<Outcomes> {
    let has_rows = |name: &str| tables.rows.iter().any(|row| row.supervision == name);
    let supervision = config.compare.supervision.iter().map(String::as_str);
    let untrained: Vec<&str> = supervision.filter(|name| !has_rows(name)).collect();
    let (bounds, unchecked) = checked_expectations(config)?.without(&untrained);
    Ok(Outcomes {
        outcomes: bounds.evaluate(tables, &training_figures(folder, config)?)?,
        unchecked,
    })
}

/// The paper's probe tables with those of this run, if its first two sources are STEP-Parts and another one, and both are
/// references.
pub(super) fn paper_comparison(tables: &Tables, config: &Config) -> Option<String> {
    let [first, second, ..] = config.compare.supervision.as_slice() else {
        return None;
    };
    if first != STEP_PARTS {
        return None;
    }
    tables.paper_comparison([first, second])
}

/// The figures of the trainings in the folder.
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

/// The settings of the tables. The first supervision is compared with each of the others, and the first two are the main pair.
///
/// # Errors
/// If a primary endpoint cannot be read.
pub(crate) fn table_settings(config: &Config, footer: Vec<String>) -> Result<TableSettings> {
    let compared = match config.compare.supervision.as_slice() {
        [first, others @ ..] => others
            .iter()
            .map(|other| [first.clone(), other.clone()])
            .collect(),
        [] => Vec::new(),
    };
    Ok(TableSettings {
        primary: primary_endpoints(config)?,
        seed_deviation: None,
        bin_reference: config.references()[0].clone(),
        clusterer: config.eval.clusterers[0].name().to_owned(),
        compared,
        bootstrap: config.eval.bootstrap(),
        footer,
    })
}

/// The endpoints of the config, or the mIoU under the first reference.
fn primary_endpoints(config: &Config) -> Result<Vec<Endpoint>> {
    let references = config.references();
    if config.compare.primary.is_empty() {
        return Ok(vec![Endpoint {
            reference: references[0].clone(),
            clusterer: None,
            metric: MIOU,
        }]);
    }
    ensure!(
        config.compare.primary.len() <= MAX_PRIMARY,
        UsageError(format!(
            "compare.primary names {} endpoints; name at most {MAX_PRIMARY}, all others are secondary",
            config.compare.primary.len()
        ))
    );
    let endpoint = |text: &String| {
        let endpoint = Endpoint::parse(text).map_err(|error| {
            let near = match &error {
                EndpointError::Metric { metric, .. } => suggestion(metric, &Metric::known_names()),
                EndpointError::Form(_) => String::new(),
            };
            UsageError(format!("compare.primary: {error}{near}"))
        })?;
        let known = references.join(", ");
        ensure!(
            references.contains(&endpoint.reference),
            UsageError(format!(
                "compare.primary names `{text}`, but nothing is scored against `{}`, only against {known}{}",
                endpoint.reference,
                suggestion(&endpoint.reference, &known)
            ))
        );
        Ok(endpoint)
    };
    config.compare.primary.iter().map(endpoint).collect()
}

/// Reports which expectations are met. The exit code is 3 if one is missed.
fn print_expectations(outcomes: &[ExpectationOutcome]) -> Result<ExitCode> {
    for outcome in outcomes {
        print_result(outcome)?;
    }
    Ok(if outcomes.iter().all(|outcome| outcome.passed) {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(MISSED_BOUND)
    })
}
