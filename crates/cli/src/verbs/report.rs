//! Runs `partprobe report`: it puts the scores of several runs into one table, over the test shapes that all of them have.

use crate::counted::counted;
#[cfg(feature = "train")]
use crate::own_output::OwnOutput;
use crate::scored_run::ScoredRun;
use crate::stderr;
use crate::stdout::{print_line, print_result, print_result_tables};
use crate::usage::UsageError;
use anyhow::{Result, bail, ensure};
#[cfg(feature = "train")]
use clap::ArgGroup;
use partprobe_dataset::{json_document, write_atomically};
use partprobe_eval::{Bootstrap, ScoreRow, TableSettings, Tables, tables};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::process::ExitCode;

/// The number of draws of the bootstrap.
const DRAWS: usize = 2000;

/// Compare the scores of several runs, over the test shapes that all of them have
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe report runs/base runs/chord
  partprobe report runs/*/ --json
  partprobe report runs/base --html base.html --charts charts

A row is a run and the label source that it was trained on, as in `chord:step-parts`. Rows without a training come from the first
run that has them. With two runs, the last row is the difference between their first label sources.
A folder that is not a scored run is named and left out. The folder of a verdict means the run in it, which has scores after
`partprobe eval`.
A shape counts if every run was scored on it against the same reference, with the same mesh and the same labels.
With one run, its tables are computed again from its scores.
With --html, the page `report.html` of one run is written again. With --charts, its charts become SVG files for a paper.
Exit codes: 0 done, 1 a folder was left out.")]
#[cfg_attr(feature = "train", command(group = ArgGroup::new("figures").args(["html", "charts"]).multiple(true)))]
pub(crate) struct ReportArgs {
    /// The run folders.
    #[arg(value_name = "RUN", required = true)]
    runs: Vec<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Write the page of one run again, to this file.
    #[cfg(feature = "train")]
    #[arg(long, value_name = "FILE", conflicts_with = "json")]
    html: Option<PathBuf>,
    /// Write the charts of the page of one run to this folder, one SVG file each.
    #[cfg(feature = "train")]
    #[arg(
        long,
        value_name = "FOLDER",
        conflicts_with = "json",
        group = "figures"
    )]
    charts: Option<PathBuf>,
    /// Replace the charts of an earlier call.
    #[cfg(feature = "train")]
    #[arg(long, requires = "charts")]
    force: bool,
    /// The data set of the run, if it has moved. It is needed only for runs of earlier versions, which do not contain the faces
    /// of the points.
    #[cfg(feature = "train")]
    #[arg(long, value_name = "DATASET", requires = "figures")]
    data: Option<PathBuf>,
}

/// The JSON output.
#[derive(Serialize)]
struct Report<'a> {
    runs: Vec<&'a str>,
    n_common_shapes: usize,
    tables: &'a Tables,
}

/// A shape under a reference.
type Key<'a> = (&'a str, &'a str);

/// Prints the table of the runs. The exit code shows whether a folder was left out.
///
/// # Errors
/// If no folder is a scored run, two runs have the same name, or they have no test shape in common.
pub(crate) fn report(args: &ReportArgs) -> Result<ExitCode> {
    #[cfg(feature = "train")]
    if args.html.is_some() || args.charts.is_some() {
        write_figures(args)?;
        return Ok(ExitCode::SUCCESS);
    }
    let runs = scored_runs(&args.runs)?;
    print_report(args, &runs)?;
    Ok(if runs.len() == args.runs.len() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// The runs that have scores. The others are named on stderr.
///
/// # Errors
/// If there are none.
fn scored_runs(paths: &[PathBuf]) -> Result<Vec<ScoredRun>> {
    let (mut runs, mut refused) = (Vec::new(), Vec::new());
    for path in paths {
        match ScoredRun::read(path) {
            Ok(run) => runs.push(run),
            Err(error) => refused.push(error),
        }
    }
    if runs.is_empty() {
        return Err(refused.swap_remove(0));
    }
    for error in refused {
        stderr::print_line(format_args!("left out: {error:#}"));
    }
    Ok(runs)
}

/// Prints the tables of all runs, or of one.
fn print_report(args: &ReportArgs, runs: &[ScoredRun]) -> Result<()> {
    for (idx, run) in runs.iter().enumerate() {
        ensure!(
            runs[..idx].iter().all(|other| other.name != run.name),
            UsageError(format!("two runs are called {}; rename a folder", run.name))
        );
    }
    let of_name = common_shapes(runs);
    let common: BTreeSet<Key<'_>> = of_name
        .iter()
        .filter(|(shape, reference)| is_same(runs, shape, reference))
        .copied()
        .collect();
    let n_others = distinct_shapes(&of_name) - distinct_shapes(&common);
    ensure!(
        !common.is_empty(),
        "the runs have no test shape in common with the same mesh and the same labels{}",
        if_any(n_others, |n| format!(
            "; {} differ in one of them",
            counted(n, "shape", "shapes")
        ))
    );

    let rows = joined_rows(runs, &common);
    let tables = joined_tables(args, runs, &rows)?;
    let n_common = distinct_shapes(&common);
    if args.json {
        let document = json_document(&Report {
            runs: runs.iter().map(|run| run.name.as_str()).collect(),
            n_common_shapes: n_common,
            tables: &tables,
        })?;
        return print_line(String::from_utf8_lossy(&document).trim_end());
    }
    print_result_tables(tables.to_markdown())?;
    let n_shapes = counted(n_common, "test shape", "test shapes");
    match runs.len() {
        1 => print_result(format_args!("Over {n_shapes} of the run.")),
        n => print_result(format_args!(
            "Over {n_shapes} that all {n} runs were scored on{}.",
            if_any(n_others, |n| format!(
                "; {} left out, whose mesh or labels differ between the runs",
                counted(n, "shape is", "shapes are")
            ))
        )),
    }?;
    partial_clusterers(runs).iter().try_for_each(print_result)
}

/// A sentence for each clusterer that not all runs were scored by: its tables lack the others.
fn partial_clusterers(runs: &[ScoredRun]) -> Vec<String> {
    let mut runs_of: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for run in runs {
        for row in &run.rows {
            runs_of.entry(&row.clusterer).or_default().insert(&run.name);
        }
    }
    let partial = runs_of
        .into_iter()
        .filter(|(_, names)| names.len() < runs.len());
    partial
        .map(|(clusterer, names)| {
            let names: Vec<&str> = names.into_iter().collect();
            format!("By {clusterer}, only {} was scored.", names.join(", "))
        })
        .collect()
}

/// A text about a number of things. It is empty if the number is 0.
fn if_any(n: usize, text: impl Fn(usize) -> String) -> String {
    if n > 0 { text(n) } else { String::new() }
}

/// The tables of one run with its own comparison, or of several runs.
fn joined_tables(args: &ReportArgs, runs: &[ScoredRun], rows: &[ScoreRow]) -> Result<Tables> {
    #[cfg(feature = "train")]
    if let [run] = args.runs.as_slice() {
        return crate::run::tables_of_folder(run);
    }
    let _ = args;
    Ok(tables(rows, &settings(runs, rows)))
}

fn distinct_shapes(keys: &BTreeSet<Key<'_>>) -> usize {
    let shapes: BTreeSet<&str> = keys.iter().map(|(shape, _)| *shape).collect();
    shapes.len()
}

/// Whether a shape has the same mesh and the same labels by the reference in all runs that record this.
fn is_same(runs: &[ScoredRun], shape: &str, reference: &str) -> bool {
    let hashes = runs.iter().filter_map(|run| run.shape_hashes.get(shape));
    let of_labels = hashes.map(|hashes| hashes.of_labels(reference));
    of_labels.collect::<BTreeSet<_>>().len() <= 1
}

/// Sentences about the settings of the training and of the scoring that differ between the runs.
fn differing_settings(runs: &[ScoredRun]) -> Vec<String> {
    let trained = differing(runs.iter().map(|run| &run.training));
    let scored = differing(runs.iter().map(|run| &run.scoring));
    let mut sentences = Vec::new();
    sentences.extend(trained.map(|found| {
        format!("The runs were trained with different settings, in their order: {found}.")
    }));
    sentences.extend(scored.map(|found| {
        format!("The runs were scored with different settings: {found}. Rows without a training are of the first run.")
    }));
    sentences
}

/// The keys whose values differ between some configs, with the values in the order of the configs. Returns `None` if there are none.
fn differing<'a>(
    configs: impl Iterator<Item = &'a BTreeMap<&'static str, toml::Value>>,
) -> Option<String> {
    let values: Vec<BTreeMap<String, String>> = configs.map(values_by_key).collect();
    let keys: BTreeSet<&String> = values.iter().flat_map(BTreeMap::keys).collect();
    let mut differing = Vec::new();
    for key in keys {
        let of_key = |values: &BTreeMap<String, String>| {
            let found = values.get(key).cloned();
            found.unwrap_or_else(|| "–".to_owned())
        };
        let of_key: Vec<String> = values.iter().map(of_key).collect();
        if of_key.iter().any(|value| *value != of_key[0]) {
            differing.push(format!("{key} ({})", of_key.join(", ")));
        }
    }
    (!differing.is_empty()).then(|| differing.join("; "))
}

/// All values of some tables by their keys, such as `net.backbone.dim`.
fn values_by_key(tables: &BTreeMap<&'static str, toml::Value>) -> BTreeMap<String, String> {
    let mut values = BTreeMap::new();
    let mut open: Vec<(String, &toml::Value)> = tables
        .iter()
        .map(|(name, value)| ((*name).to_owned(), value))
        .collect();
    while let Some((key, value)) = open.pop() {
        match value {
            toml::Value::Table(inner) => open.extend(
                inner
                    .iter()
                    .map(|(name, value)| (format!("{key}.{name}"), value)),
            ),
            value => {
                values.insert(key, value.to_string());
            }
        }
    }
    values
}

/// The files of `--charts`. A run with scores has the first of them, which is written first.
#[cfg(feature = "train")]
const CHARTS: OwnOutput = OwnOutput {
    verb: "report --charts",
    marker: Some("means.svg"),
    is_own: |name| name.ends_with(".svg"),
};

/// Writes the page or the charts of the named run.
#[cfg(feature = "train")]
fn write_figures(args: &ReportArgs) -> Result<()> {
    let [run] = args.runs.as_slice() else {
        bail!(UsageError(
            "--html and --charts are about one run; name one run folder".to_owned()
        ));
    };
    let data = args.data.as_deref();
    if let Some(file) = &args.html {
        let page = crate::run::page_of_folder(run, data)?;
        write_atomically(file, page.as_bytes())?;
        print_result(format_args!("page: {}", file.display()))?;
    }
    if let Some(folder) = &args.charts {
        let charts = crate::run::charts_of_folder(run, data)?;
        let _lock = CHARTS.take(folder, "drawing charts into", args.force, &args.runs)?;
        for chart in &charts {
            let file = folder.join(format!("{}.svg", chart.name));
            write_atomically(&file, chart.to_svg_file().as_bytes())?;
        }
        let n = counted(charts.len(), "chart", "charts");
        print_result(format_args!("{n}: {}", folder.display()))?;
    }
    Ok(())
}

fn common_shapes(runs: &[ScoredRun]) -> BTreeSet<Key<'_>> {
    let keys = |run: &'_ ScoredRun| -> BTreeSet<(String, String)> {
        let keys = run
            .rows
            .iter()
            .map(|row| (row.shape.clone(), row.reference.clone()));
        keys.collect()
    };
    let all: Vec<BTreeSet<(String, String)>> = runs.iter().map(keys).collect();
    let is_common = |row: &&ScoreRow| {
        let key = (row.shape.clone(), row.reference.clone());
        all.iter().all(|of_run| of_run.contains(&key))
    };
    let first = runs.first().into_iter().flat_map(|run| &run.rows);
    first
        .filter(is_common)
        .map(|row| (row.shape.as_str(), row.reference.as_str()))
        .collect()
}

/// The rows of all runs, named after their runs. Rows without a training are included only once.
fn joined_rows(runs: &[ScoredRun], common: &BTreeSet<Key<'_>>) -> Vec<ScoreRow> {
    let mut untrained: BTreeSet<&str> = BTreeSet::new();
    let mut rows = Vec::new();
    for run in runs {
        let is_trained = |row: &ScoreRow| run.supervision.contains(&row.supervision);
        let of_run = run
            .rows
            .iter()
            .filter(|row| common.contains(&(&row.shape, &row.reference)));
        let mut own: BTreeSet<&str> = BTreeSet::new();
        for row in of_run {
            if is_trained(row) {
                rows.push(ScoreRow {
                    supervision: named(run, &row.supervision),
                    ..row.clone()
                });
            } else if !untrained.contains(row.supervision.as_str()) {
                own.insert(&row.supervision);
                rows.push(row.clone());
            }
        }
        untrained.extend(own);
    }
    rows
}

fn named(run: &ScoredRun, supervision: &str) -> String {
    format!("{}:{supervision}", run.name)
}

fn settings(runs: &[ScoredRun], rows: &[ScoreRow]) -> TableSettings {
    let first = |run: &ScoredRun| Some(named(run, run.supervision.first()?));
    let compared = match runs {
        [a, b] => first(a).zip(first(b)).map(|(a, b)| [a, b]),
        _ => None,
    };
    let compared = compared.into_iter().collect();
    TableSettings {
        bin_reference: rows[0].reference.clone(),
        clusterer: rows[0].clusterer.clone(),
        compared,
        primary: Vec::new(),
        seed_deviation: None,
        bootstrap: Bootstrap {
            draws: DRAWS,
            seed: 0,
            least_groups: Bootstrap::LEAST_GROUPS,
        },
        footer: differing_settings(runs),
    }
}
