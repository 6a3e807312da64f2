//! Runs `partprobe nearest`: finds the shapes of a library that are most similar to a query.
//!
//! A folder that `embed --form shapes` wrote and files of any kind that `embed` reads go in, and a table of ids and cosines comes
//! out. The search compares the query with every shape of the library. With 128 numbers per shape, a search tree would also visit
//! nearly all of them.

use super::form::{Form, shape_row};
use super::index::read_index;
use super::input::{Input, Inputs};
use super::library_model::LibraryModel;
use crate::backbone::{Backbone, BackboneArgs, ensure_preparation};
use crate::counted::counted;
use crate::given_path::ensure_exists;
use crate::markdown_table::{Alignment, markdown_table};
use crate::run::{Execution, ExecutionArgs};
use crate::standard_input::is_standard_input;
use crate::stdout::{print_line, print_tables};
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::json_lines;
use partprobe_formats::{Values, arrays_from_npz};
use rayon::prelude::*;
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Find the shapes of a library that are most similar to a shape
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe embed runs/mine dataset/ --form shapes --out library/
  partprobe nearest library/ bracket.step
  partprobe nearest library/ scan.ply --most 20 --json

The query is embedded by the backbone that the library was made with. The cosine is 1 for equal embeddings.
Exit codes: 0 every query was searched for, 1 a query could not be searched for, 2 wrong usage.")]
pub(crate) struct NearestArgs {
    /// A folder that `partprobe embed --form shapes` wrote.
    #[arg(value_name = "LIBRARY")]
    library: PathBuf,
    /// Anything that `embed` reads: STEP files, carriers, meshes, point clouds, folders, data sets.
    #[arg(value_name = "QUERY", required = true)]
    queries: Vec<PathBuf>,
    /// The number of shapes for each query.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    most: u32,
    /// The run or the weights that the library was made with, if they have moved.
    #[arg(long, value_name = "RUN|WEIGHTS")]
    model: Option<PathBuf>,
    /// Print one JSON object per line.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// A shape of the library that is similar to a query.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Found {
    query: String,
    rank: usize,
    id: String,
    cosine: f64,
}

/// Searches for each query.
///
/// # Errors
/// If the folder is not a library, its backbone does not exist any more, or a query cannot be read.
pub(crate) fn nearest(args: &NearestArgs) -> Result<ExitCode> {
    let mut files = args.queries.iter().filter(|path| !is_standard_input(path));
    files.try_for_each(|path| ensure_exists(path))?;
    let execution = Execution::new(&args.execution.machine)?;
    let model = LibraryModel::read(&args.library)?;
    ensure!(
        model.form == Form::Shapes.name(),
        UsageError(format!(
            "{} has a row for each of its {}; embed with --form shapes",
            args.library.display(),
            model.form
        ))
    );
    let backbone = backbone_of(args, &model, &execution)?;
    let library = Library::read(&args.library)?;
    let inputs = Inputs::open(&args.queries, &backbone.config, &execution)?;

    let mut found = Vec::new();
    let mut n_failed = 0;
    for input in inputs.list() {
        match query_rows(input, &backbone) {
            Ok(rows) => found.extend(
                rows.into_iter()
                    .flat_map(|(name, row)| library.nearest(&name, &row, args.most as usize)),
            ),
            Err(error) => {
                let name = input.name();
                execution
                    .progress
                    .note(&format!("warning: {name}: {error:#}"));
                n_failed += 1;
            }
        }
    }
    print(&found, args.json)?;
    let queries = counted(inputs.list().len(), "query", "queries");
    ensure!(n_failed == 0, "{n_failed} of {queries} could not be read");
    Ok(ExitCode::SUCCESS)
}

/// The backbone of the library, or the same one in another place.
fn backbone_of(
    args: &NearestArgs,
    model: &LibraryModel,
    execution: &Execution,
) -> Result<Backbone> {
    ensure_preparation(&args.execution.set, &[])?;
    let set = [model.set.as_slice(), &args.execution.set].concat();
    let backbone: BackboneArgs = match &args.model {
        Some(path) => model.backbone.in_other_run(path),
        None => model.backbone.clone(),
    };
    let opened = backbone.open(&set, execution.backend).context(
        "the backbone of the library cannot be opened; say with --model where it is now",
    )?;
    model.ensure_weights(&opened.weights_sha256)?;
    Ok(opened)
}

/// The row of each shape of a query, with its id.
fn query_rows(input: &Input, backbone: &Backbone) -> Result<Vec<(String, Vec<f32>)>> {
    let shapes = input.shapes(&backbone.config)?;
    let row = |shape: super::input::EmbedInput| {
        let (tokens, rows) = backbone.embedded(&shape.sample)?;
        Ok((shape.id, shape_row(&tokens, &rows)))
    };
    shapes.into_iter().map(row).collect()
}

fn print(found: &[Found], is_json: bool) -> Result<()> {
    if is_json {
        let lines = json_lines(found)?;
        return print_line(String::from_utf8_lossy(&lines).trim_end());
    }
    let heading = ["query", "rank", "shape", "cosine"];
    let alignment = [
        Alignment::Left,
        Alignment::Right,
        Alignment::Left,
        Alignment::Right,
    ];
    let cells = found.iter().map(|found| {
        [
            found.query.clone(),
            found.rank.to_string(),
            found.id.clone(),
            format!("{:.4}", found.cosine),
        ]
    });
    print_tables(markdown_table(heading, alignment, cells))
}

/// The rows of a library, with the ids of its shapes.
struct Library(Vec<(String, Vec<f32>)>);

impl Library {
    fn read(folder: &Path) -> Result<Self> {
        let written: Vec<(String, String)> = read_index(folder)?
            .into_iter()
            .filter_map(|line| Some((line.id, line.file?)))
            .collect();
        ensure!(
            !written.is_empty(),
            "{} has no index of shapes; finish it with `partprobe embed … --resume`",
            folder.display()
        );
        let row = |(id, file): (String, String)| {
            let row = read_row(&folder.join(&file)).with_context(|| file)?;
            Ok((id, row))
        };
        Ok(Self(
            written.into_par_iter().map(row).collect::<Result<_>>()?,
        ))
    }

    /// The shapes with the largest cosines. The largest cosine comes first, and in a tie the lower id.
    fn nearest(&self, query: &str, row: &[f32], most: usize) -> Vec<Found> {
        let cosine = |other: &[f32]| -> f64 {
            let products = row.iter().zip(other);
            products.map(|(&a, &b)| f64::from(a) * f64::from(b)).sum()
        };
        let mut ranked: Vec<(f64, &str)> = self
            .0
            .par_iter()
            .map(|(id, other)| (cosine(other), id.as_str()))
            .collect();
        ranked.sort_by(|(a, first), (b, second)| b.total_cmp(a).then_with(|| first.cmp(second)));
        let found = ranked.into_iter().take(most).enumerate();
        found
            .map(|(idx, (cosine, id))| Found {
                query: query.to_owned(),
                rank: idx + 1,
                id: id.to_owned(),
                cosine,
            })
            .collect()
    }
}

/// The single row of an embedding file.
fn read_row(file: &Path) -> Result<Vec<f32>> {
    let members = arrays_from_npz(&fs::read(file)?)?;
    let array = members
        .array("embeddings")
        .context("it has no member `embeddings`")?;
    Ok(match array.values() {
        Values::F32(values) => values.clone(),
        Values::F16(values) => values.iter().map(|half| half.to_f32()).collect(),
        _ => anyhow::bail!("its embeddings are not numbers of 16 or 32 bits"),
    })
}
