//! Runs `partprobe check labels`: shows which label files would be joined to a data set, and how, before anything is trained.

use crate::counted::counted;
use crate::disk_files::DiskFiles;
use crate::markdown_table::Alignment::{Left, Right};
use crate::markdown_table::markdown_table;
use crate::progress::Progress;
use crate::source_types::{open_source, source_type};
use crate::stdout::{print_line, print_tables};
use crate::usage::UsageError;
use anyhow::{Result, anyhow, bail, ensure};
use partprobe_dataset::{Dataset, IndexEntry, json_document};
use partprobe_imports::{IMPORT_TYPES, Import, ImportError, ImportType, JoinProblem, JoinReport};
use partprobe_sources::{PathKind, SourceContext, SourceFiles};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What `check labels` takes.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe check labels seg/ --data dataset/
  partprobe check labels faces.jsonl.zst --data dataset/ --type faces --set column=instance

The keys of --set are those of [sources.NAME] in a config. Exit codes: 0 labels were joined and none were refused, 1 otherwise, 2
wrong usage.")]
pub(super) struct LabelsArgs {
    /// A folder with a label file per shape, a file with the labels of many shapes, or an ONNX model.
    #[arg(value_name = "PATH")]
    labels: String,
    /// The labeled data set (`partprobe label` makes one).
    #[arg(long, value_name = "DATASET")]
    data: PathBuf,
    /// The type of the label files; every type of label file is tried if not given.
    #[arg(long = "type", value_name = "TYPE")]
    import_type: Option<String>,
    /// Set a key of the type, for example `column=instance`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print JSON, with an entry for each shape.
    #[arg(long)]
    json: bool,
}

/// The largest number of problems that are named. Further ones are only counted.
const MAX_NAMED: usize = 10;

/// Joins the labels to every shape, and prints the result.
pub(super) fn check_labels(args: &LabelsArgs) -> Result<()> {
    let context = context(args)?;
    if DiskFiles.kind(&args.labels) == PathKind::Missing {
        let path = &args.labels;
        let reason = format!(
            "{path} does not exist; give a folder with a label file for each shape, or one file with the labels of many shapes"
        );
        return Err(UsageError(reason).into());
    }
    let dataset = Dataset::open(&args.data)?;
    let types: Vec<&ImportType> = match &args.import_type {
        Some(name) => vec![source_type(name).map_err(misuse)?],
        None => IMPORT_TYPES.iter().collect(),
    };
    let checked = types
        .into_iter()
        .map(|import_type| check_type(import_type, &context, &dataset, args.import_type.is_some()))
        .collect::<Result<Vec<TypeCheck>>>()?;

    if args.json {
        print_line(String::from_utf8_lossy(&json_document(&checked)?).trim_end())?;
    } else {
        checked.iter().try_for_each(print_tables)?;
    }
    if checked.iter().any(TypeCheck::is_sound) {
        Ok(())
    } else {
        bail!("not every label could be joined; see the lines above")
    }
}

/// A type of label files with which labels can be joined to shapes without refusals.
#[cfg(feature = "train")]
pub(crate) struct JoiningType {
    /// The name of the type.
    pub(crate) name: &'static str,
    /// Advice if the labels seem to be classes.
    pub(crate) hint: Option<String>,
}

/// The types of label files with which these labels can be joined to shapes of the data set without refusals.
///
/// # Errors
/// If the data set cannot be read.
#[cfg(feature = "train")]
pub(crate) fn types_that_join(labels: &str, data: &Path) -> Result<Vec<JoiningType>> {
    let context = SourceContext::default()
        .with_files(Arc::new(DiskFiles))
        .with("path", labels);
    let dataset = Dataset::open(data)?;
    let mut types = Vec::new();
    for import_type in IMPORT_TYPES {
        let check = check_type(import_type, &context, &dataset, false)?;
        if check.is_sound() {
            types.push(JoiningType {
                name: check.name,
                hint: check.class_hint(),
            });
        }
    }
    Ok(types)
}

fn context(args: &LabelsArgs) -> Result<SourceContext> {
    let context = SourceContext::default()
        .with_files(Arc::new(DiskFiles))
        .with("path", &args.labels);
    args.set.iter().try_fold(context, |context, assignment| {
        let (key, value) = assignment
            .split_once('=')
            .ok_or_else(|| UsageError(format!("--set {assignment}: write KEY=VALUE")))?;
        Ok(context.with(key.trim(), value.trim()))
    })
}

fn misuse(error: ImportError) -> UsageError {
    UsageError(error.to_string())
}

/// The result of reading the labels as one type.
#[derive(Serialize)]
struct TypeCheck {
    #[serde(rename = "type")]
    name: &'static str,
    /// The reason why no shape is joined, if the type was not given by the user.
    refused: Option<String>,
    shapes: Vec<ShapeCheck>,
    /// Label files, or entries of one, that belong to no shape of the data set.
    unused: Vec<String>,
    /// Advice if no label has the name of a shape.
    hint: Option<String>,
}

#[derive(Serialize)]
struct ShapeCheck {
    id: String,
    #[serde(flatten)]
    outcome: Outcome,
}

/// The result for the labels of one shape.
#[derive(Serialize)]
#[serde(tag = "status", rename_all = "kebab-case")]
enum Outcome {
    /// Each face or triangle has a label, and each label is used.
    Whole { join: Join },
    /// Some have no label, or some labels are not used.
    Partly { join: Join },
    /// No labels are named after the shape.
    WithoutLabels,
    /// The labels do not fit, or cannot be read.
    Refused { reason: String },
}

#[derive(Serialize)]
struct Join {
    by: String,
    entries: Vec<String>,
    items: &'static str,
    n_items: usize,
    n_labeled: usize,
    n_labels: u32,
    unlabeled: Vec<String>,
    unused: Vec<String>,
    /// The number of labels whose faces are not all connected.
    n_separate: usize,
    #[serde(skip)]
    text: String,
}

impl Outcome {
    fn is_joined(&self) -> bool {
        matches!(self, Self::Whole { .. } | Self::Partly { .. })
    }

    fn is_refused(&self) -> bool {
        matches!(self, Self::Refused { .. })
    }

    fn join(&self) -> Option<&Join> {
        match self {
            Self::Whole { join } | Self::Partly { join } => Some(join),
            _ => None,
        }
    }
}

fn check_type(
    import_type: &'static ImportType,
    context: &SourceContext,
    dataset: &Dataset,
    is_type_given: bool,
) -> Result<TypeCheck> {
    let import = match open_source(import_type.name, context.clone()) {
        Ok(import) => import,
        Err(error) if is_type_given => return Err(misuse(error).into()),
        Err(error) => {
            return Ok(TypeCheck::refused(import_type.name, error.to_string()));
        }
    };
    let entries = dataset.labeled();
    ensure!(
        !entries.is_empty(),
        "{} has no labeled shape",
        dataset.root().display()
    );
    let bar = Progress::on_terminal().bar("check", entries.len());
    let check = |entry: &&IndexEntry| {
        bar.inc(1);
        check_shape(import.as_ref(), dataset, entry)
    };
    let shapes = entries
        .par_iter()
        .map(check)
        .collect::<Result<Vec<ShapeCheck>>>()?;
    bar.finish_and_clear();
    let mut unused = import.entries().map_err(|error| anyhow!("{error}"))?;
    let is_joined = |shape: &ShapeCheck| shape.outcome.is_joined();
    if !is_type_given && !shapes.iter().any(is_joined) {
        let reason = first_refusal(&shapes).unwrap_or_else(|| without_names(&unused, &shapes));
        return Ok(TypeCheck::refused(import_type.name, reason));
    }
    let is_named = |shape: &ShapeCheck| !matches!(shape.outcome, Outcome::WithoutLabels);
    let hint = (!shapes.iter().any(is_named)).then(|| without_names(&unused, &shapes));

    let entries_of = |shape: &ShapeCheck| match shape.outcome.join() {
        Some(join) => join.entries.clone(),
        // The labels of a refused shape are not those of another shape.
        None => import.entries_of(&shape.id),
    };
    let used: BTreeSet<String> = shapes.iter().flat_map(entries_of).collect();
    unused.retain(|entry| !used.contains(entry));
    Ok(TypeCheck {
        name: import_type.name,
        refused: None,
        unused,
        shapes,
        hint,
    })
}

/// The reason why the first shape with a problem was not joined.
fn first_refusal(shapes: &[ShapeCheck]) -> Option<String> {
    let reason = |shape: &ShapeCheck| match &shape.outcome {
        Outcome::Refused { reason } => Some(format!("{}: {reason}", shape.id)),
        _ => None,
    };
    shapes.iter().find_map(reason)
}

/// Advice if no label has the name of a shape.
fn without_names(labels: &[String], shapes: &[ShapeCheck]) -> String {
    let [label, shape] = [labels.first(), shapes.first().map(|shape| &shape.id)]
        .map(|name| name.map_or("", String::as_str));
    format!(
        "no label file is named like a shape: the first label file is {label}, and the first shape is {shape}; name each label \
         file like its STEP file"
    )
}

fn check_shape(import: &dyn Import, dataset: &Dataset, entry: &IndexEntry) -> Result<ShapeCheck> {
    let carrier = dataset.carrier(entry)?;
    let outcome = match import.join(&carrier) {
        Ok(joined) => {
            let n_labels = joined.labels.n_labels();
            let is_whole = joined.report.unlabeled.is_empty() && joined.report.unused.is_empty();
            let join = join_of(joined.report, n_labels);
            if is_whole {
                Outcome::Whole { join }
            } else {
                Outcome::Partly { join }
            }
        }
        Err(JoinProblem::NoLabels) => Outcome::WithoutLabels,
        Err(problem) => Outcome::Refused {
            reason: problem.to_string(),
        },
    };
    Ok(ShapeCheck {
        id: entry.id.clone(),
        outcome,
    })
}

fn join_of(report: JoinReport, n_labels: u32) -> Join {
    Join {
        text: report.to_string(),
        by: report.by,
        entries: report.entries,
        items: report.items,
        n_items: report.n_items,
        n_labeled: report.n_matched,
        n_labels,
        unlabeled: report.unlabeled,
        unused: report.unused,
        n_separate: report.n_separate,
    }
}

impl TypeCheck {
    /// The result if no shape can use the labels as this type.
    fn refused(name: &'static str, reason: String) -> Self {
        Self {
            name,
            refused: Some(reason),
            shapes: Vec::new(),
            unused: Vec::new(),
            hint: None,
        }
    }

    /// Whether labels were joined and none were refused.
    fn is_sound(&self) -> bool {
        self.count(Outcome::is_joined) > 0 && self.count(Outcome::is_refused) == 0
    }

    fn count(&self, is_counted: impl Fn(&Outcome) -> bool) -> usize {
        self.shapes
            .iter()
            .filter(|shape| is_counted(&shape.outcome))
            .count()
    }

    /// Advice if labels seem to be classes: their faces are not connected.
    fn class_hint(&self) -> Option<String> {
        let is_separate =
            |outcome: &Outcome| outcome.join().is_some_and(|join| join.n_separate > 0);
        let n_shapes = self.count(is_separate);
        (n_shapes > 0).then(|| {
            format!(
                "{} a label whose faces are not connected; if the labels are classes, such as `hole`, set `instances = true`, so that \
                 each connected set of faces is a part of its own",
                counted(n_shapes, "shape has", "shapes have")
            )
        })
    }

    /// The number of shapes that were joined in each way.
    fn counts_by_join(&self) -> BTreeMap<&str, usize> {
        let mut counts_by_join = BTreeMap::new();
        for join in self.shapes.iter().filter_map(|shape| shape.outcome.join()) {
            *counts_by_join.entry(join.by.as_str()).or_default() += 1;
        }
        counts_by_join
    }

    /// The problems, shape by shape.
    fn problems(&self) -> Vec<String> {
        let problem = |shape: &ShapeCheck| match &shape.outcome {
            Outcome::Partly { join } => Some(format!("{}: {}", shape.id, join.text)),
            Outcome::Refused { reason } => Some(format!("{}: refused: {reason}", shape.id)),
            Outcome::Whole { .. } | Outcome::WithoutLabels => None,
        };
        // Refusals come first, because they are the most serious.
        let (refused, others): (Vec<&ShapeCheck>, Vec<&ShapeCheck>) = self
            .shapes
            .iter()
            .partition(|shape| shape.outcome.is_refused());
        refused
            .into_iter()
            .chain(others)
            .filter_map(problem)
            .collect()
    }
}

impl fmt::Display for TypeCheck {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.name;
        if let Some(reason) = &self.refused {
            return write!(f, "{name}: no shape is joined: {reason}");
        }
        let n_joined = self.count(Outcome::is_joined);
        let shapes = counted(self.shapes.len(), "shape has", "shapes have");
        write!(f, "{name}: {n_joined} of {shapes} labels")?;
        let counts_by_join = self.counts_by_join().into_iter();
        let mut rows: Vec<[String; 2]> = counts_by_join
            .map(|(way, n_shapes)| [format!("joined by {way}"), n_shapes.to_string()])
            .collect();
        for (what, n_shapes) in [
            (
                "each labeled",
                self.count(|outcome| matches!(outcome, Outcome::Whole { .. })),
            ),
            (
                "partly labeled",
                self.count(|outcome| matches!(outcome, Outcome::Partly { .. })),
            ),
            ("refused", self.count(Outcome::is_refused)),
            (
                "without labels",
                self.count(|outcome| matches!(outcome, Outcome::WithoutLabels)),
            ),
            ("labels of other shapes", self.unused.len()),
        ] {
            rows.push([what.to_owned(), n_shapes.to_string()]);
        }
        let table = markdown_table(["labels", "shapes"], [Left, Right], rows);
        write!(f, "\n\n{table}\n")?;

        for hint in self.hint.iter().chain(&self.class_hint()) {
            write!(f, "\n{hint}")?;
        }
        let problems = self.problems();
        for problem in problems.iter().take(MAX_NAMED) {
            write!(f, "\n{problem}")?;
        }
        match problems.len().saturating_sub(MAX_NAMED) {
            0 => Ok(()),
            n_more => write!(f, "\nand {n_more} more"),
        }
    }
}
