//! `partprobe sources`: the label sources that a config or `sample --source` can name.

use crate::config::{self, SourceTable};
use crate::stdout::print_line;
use anyhow::Result;
use partprobe_dataset::json_document;
use partprobe_imports::import_type;
use partprobe_sources::{SOURCES, SourceFactory};
use serde::Serialize;
use std::fmt;

/// List the label sources, each with a line that says what its labels are.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Replace a placeholder such as <K> with a whole number in the range that is shown.
Example: partprobe sample dataset/ --out points/ --format npz --source step-parts --source ward-20
Labels of another program are listed if a config names them in [sources.NAME]: partprobe sources --config my.toml
--json adds the lowest and the highest number that each placeholder accepts."
)]
pub(crate) struct SourcesArgs {
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// A shipped config or a file, whose own sources are listed too.
    #[arg(long, default_value = "base", value_name = "FILE")]
    config: String,
    /// Change one setting, for example `sources.mine.path=seg/`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Prints a line for each source.
///
/// # Errors
/// If the config is wrong, or stdout cannot be written to.
pub(crate) fn sources(args: &SourcesArgs) -> Result<()> {
    let config = config::load(&args.config, &args.set)?.config;
    let own = config
        .sources
        .iter()
        .map(|(name, table)| Row::imported(name, table));
    let rows: Vec<Row> = SOURCES.iter().map(Row::new).chain(own).collect();
    if args.json {
        return print_line(String::from_utf8_lossy(&json_document(&rows)?).trim_end());
    }
    print_line(Table(&rows))
}

/// What is said of one source.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Row {
    name: String,
    /// The lowest and the highest number that the placeholder accepts; none without a placeholder.
    numbers: Option<[u32; 2]>,
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
            description: factory.description().to_owned(),
        }
    }

    /// A source of the config's own.
    fn imported(name: &str, table: &SourceTable) -> Self {
        let description = import_type(&table.import_type).map_or("", |known| known.description);
        Self {
            name: name.to_owned(),
            numbers: None,
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

struct Table<'a>(&'a [Row]);

impl fmt::Display for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let heading = ["source", "number", "labels"].map(str::to_owned);
        let lines: Vec<[String; 3]> = std::iter::once(heading)
            .chain(self.0.iter().map(Row::cells))
            .collect();
        let width = |column: usize| {
            lines
                .iter()
                .map(|line| line[column].chars().count())
                .max()
                .unwrap_or(0)
        };
        let [name_width, number_width] = [width(0), width(1)];

        for (idx, [name, numbers, description]) in lines.iter().enumerate() {
            let end = if idx + 1 < lines.len() { "\n" } else { "" };
            write!(
                f,
                "{name:name_width$}  {numbers:number_width$}  {description}{end}"
            )?;
        }
        Ok(())
    }
}
