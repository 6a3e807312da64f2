//! Writes tables of labeled shapes: `partprobe export parquet`.
//!
//! A row is a shape. Its faces and edges are lists, so no join is needed. All files of an export have the same columns, because
//! the layers of all shapes are found first.

use super::common_args::FolderArgs;
use super::exporter::Exporter;
use super::outputs::Outputs;
use super::session::ExportSession;
use super::shape_facts::origin_of;
use super::shape_line::ShapeLine;
use crate::shape_input::ShapeInput;
use anyhow::Result;
use partprobe_tables::{ShapeRow, layers_of, shape_metadata, shape_table, table_to_parquet};
use serde_json::json;
use std::collections::BTreeSet;
use std::path::Path;

/// What `parquet` takes.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe export parquet dataset/ --out tables/

DIR/part-00000.parquet and so on have a row per shape: its id, source and hash, and lists per face (face_step_id, face_type,
face_part, face_label, face_area_mm2, a column per stored layer) and per shared edge (edge_face_a, edge_face_b, edge_phi_deg,
edge_length_mm). pandas, polars, DuckDB and Hugging Face datasets read them. docs/reference/formats.md lists all columns.")]
pub(crate) struct ParquetArgs {
    #[command(flatten)]
    folder: FolderArgs,
    /// The most shapes in one file.
    #[arg(long, default_value_t = 10_000, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    shard_size: u32,
}

impl Exporter for ParquetArgs {
    const NAME: &'static str = "parquet";
    const EXTENSIONS: &'static [&'static str] = &["parquet"];

    fn export(&self, known: &'static [Outputs]) -> Result<()> {
        let settings = json!({ "shard_size": self.shard_size });
        let session = ExportSession::new(Self::NAME, &self.folder, &settings, known)?;
        let shapes: Vec<&ShapeInput> = session.sources.shapes.iter().collect();

        let mut layers = BTreeSet::new();
        let look = |_: &ShapeInput, carrier: &_| Ok(layers_of(carrier));
        session
            .batch()
            .for_each("look", &shapes, look, |_, found| {
                // A shape that cannot be read is reported when its row is made.
                layers.extend(found.unwrap_or_default());
                Ok(())
            })?;

        let mut shard = Shard::new(&session, &layers);
        let mut lines = Vec::new();
        let row = |shape: &ShapeInput, carrier: &_| Ok(ShapeRow::new(origin_of(shape), carrier));
        session
            .batch()
            .for_each("export", &shapes, row, |shape, row| {
                match row {
                    Ok(row) => {
                        lines.push(ShapeLine::written(shape, vec![shard.name()]));
                        shard.add(row, self.shard_size as usize)?;
                    }
                    Err(error) => lines.push(ShapeLine::failed(shape, &error)),
                }
                Ok(())
            })?;
        shard.write()?;
        lines.extend(session.sources.failed.iter().map(ShapeLine::from));
        session.batch().conclude(&lines)
    }
}

/// The rows that wait for their file.
struct Shard<'a> {
    session: &'a ExportSession,
    layers: &'a BTreeSet<String>,
    number: usize,
    rows: Vec<ShapeRow>,
}

impl<'a> Shard<'a> {
    fn new(session: &'a ExportSession, layers: &'a BTreeSet<String>) -> Self {
        Self {
            session,
            layers,
            number: 0,
            rows: Vec::new(),
        }
    }

    fn name(&self) -> String {
        format!("part-{:05}.parquet", self.number)
    }

    /// Adds a row, and writes the file if it is full.
    fn add(&mut self, row: ShapeRow, size: usize) -> Result<()> {
        self.rows.push(row);
        if self.rows.len() < size {
            return Ok(());
        }
        self.write()
    }

    /// Writes the rows, if there are some, and begins the next file.
    fn write(&mut self) -> Result<()> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let table = shape_table(&self.rows, self.layers)?;
        let bytes = table_to_parquet(&table, &shape_metadata())?;
        self.session.folder.write(Path::new(&self.name()), &bytes)?;
        self.rows.clear();
        self.number += 1;
        Ok(())
    }
}
