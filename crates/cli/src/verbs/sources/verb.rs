//! Defines the arguments of `sources`, and its table.

use super::card::{CardRequest, source_card};
use crate::config::SourceTable;
use crate::markdown_table::Alignment::Left;
use crate::markdown_table::markdown_table;
use crate::shape_choice::ChoiceArgs;
use crate::shape_input::DataArgs;
use crate::source_types::source_type;
use crate::stdout::{print_line, print_tables};
use crate::usage::UsageError;
use anyhow::{Result, ensure};
use partprobe_dataset::json_document;
use partprobe_sources::{CONTROLS, SOURCES, SourceControl, SourceFactory};
use serde::Serialize;
use std::path::PathBuf;

/// List the label sources, with one line of explanation per source; with --data, measure some of them on shapes.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Replace a placeholder such as <K> with a whole number in the range that is shown, and <SOURCE> with the name of another source.
Example: partprobe sample dataset/ --out points/ --format npz --source step-parts --source ward-20
Labels of another program are listed if a config names them in [sources.NAME]: `partprobe sources --config my.toml`.
--json adds the lowest and the highest number that each placeholder accepts, whether `label --layers` can store the labels, and
what a shape must have at least: a B-Rep, a mesh, or a point cloud.

With --data, the card of the named sources is printed:
  partprobe sources step-parts ward-20 brep-face --data dataset/ --out card/
It says how many labels each source gives, how evenly the area is spread over them (entropy), how long their borders are, how many
shapes have 20 labels or more, and how well each pair of sources agrees (ARI). --out writes sources.md, sources.json, and a PNG
for each of the five shapes on which two sources differ most."
)]
pub(crate) struct SourcesArgs {
    /// The sources to measure, with --data.
    #[arg(value_name = "SOURCE")]
    sources: Vec<String>,
    #[command(flatten)]
    data: DataArgs,
    #[command(flatten)]
    choice: ChoiceArgs,
    /// The number of points per shape on which sources are compared. They are uniform by area.
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    points: u32,
    /// A folder to write the card to.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the output of an earlier call.
    #[arg(long, requires = "out")]
    force: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Prints one line per source, or the card.
///
/// # Errors
/// If the config is wrong, only one of sources and data is given, the card cannot be made, or stdout cannot be written
/// to.
pub(crate) fn sources(args: &SourcesArgs) -> Result<()> {
    let has_data = !args.data.paths.is_empty();
    if has_data || !args.sources.is_empty() {
        ensure!(
            has_data && !args.sources.is_empty(),
            UsageError("a card needs sources and --data, for example: partprobe sources step-parts ward-20 --data dataset/".to_owned())
        );
        return source_card(&CardRequest {
            sources: &args.sources,
            data: &args.data,
            choice: &args.choice,
            n_points: args.points as usize,
            out: args.out.as_ref(),
            force: args.force,
            is_json: args.json,
        });
    }
    let config = args.data.settings()?;
    let own = config
        .sources
        .iter()
        .map(|(name, table)| Row::imported(name, table));
    let controls = CONTROLS.iter().map(Row::control);
    let rows: Vec<Row> = SOURCES
        .iter()
        .map(Row::new)
        .chain(controls)
        .chain(own)
        .collect();
    if args.json {
        return print_line(String::from_utf8_lossy(&json_document(&rows)?).trim_end());
    }
    print_tables(table(&rows))
}

/// The description of one source.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Row {
    name: String,
    /// The lowest and the highest number that the placeholder accepts, or `None` without a placeholder.
    numbers: Option<[u32; 2]>,
    /// Whether the labels are constant on faces, so that `label --layers` can store them.
    labels_faces: bool,
    /// The data that a shape must have at least: `brep`, `mesh` or `cloud`. It is `None` if this depends on the imported labels.
    needs: Option<&'static str>,
    description: String,
}

impl Row {
    fn new(factory: &SourceFactory) -> Self {
        let numbers = factory
            .numbers()
            .map(|numbers| [*numbers.start(), *numbers.end()]);
        Self {
            name: factory.pattern().to_owned(),
            numbers,
            labels_faces: factory.labels_faces(),
            needs: Some(factory.needs().name()),
            description: factory.description().to_owned(),
        }
    }

    /// The row of a control of granularity, which is based on another source.
    fn control(control: &SourceControl) -> Self {
        Self {
            name: control.pattern(),
            numbers: None,
            labels_faces: control.labels_faces(),
            needs: None,
            description: control.description().to_owned(),
        }
    }

    /// The row of a source that the config defines.
    fn imported(name: &str, table: &SourceTable) -> Self {
        let known = source_type(&table.import_type).ok();
        let description = known.map_or("", |known| known.description);
        Self {
            name: name.to_owned(),
            numbers: None,
            labels_faces: false,
            needs: None,
            description: format!("imported, type {}: {description}", table.import_type),
        }
    }

    fn cells(&self) -> [String; 3] {
        let numbers = self
            .numbers
            .map_or_else(|| "–".to_owned(), |[min, max]| format!("{min} to {max}"));
        [self.name.clone(), numbers, self.description.clone()]
    }
}

/// The rows as a table for readers.
fn table(rows: &[Row]) -> String {
    let heading = ["source", "number", "labels"];
    markdown_table(heading, [Left; 3], rows.iter().map(Row::cells))
}
