//! Makes the table of labeled shapes that `partprobe export parquet` writes: one row per shape, with lists per face and edge.

use crate::labels::{ShapeLabels, edge_columns, face_columns, full};
use crate::table::{Column, Table, TableError, Text};
use partprobe_carrier::{Carrier, ShapeKind};
use std::collections::{BTreeMap, BTreeSet};

/// The key of the file's metadata with the kind of the table.
pub const SCHEMA_KEY: &str = "partprobe.schema";
/// The key of the file's metadata with the version of the schema.
pub const SCHEMA_VERSION_KEY: &str = "partprobe.schema_version";
/// The version of the tables of shapes.
const SHAPES_VERSION: u32 = 1;

/// The origin of a shape. Unknown values are `None`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ShapeOrigin {
    /// The id of the shape.
    pub id: String,
    /// The name of the file from which it was read.
    pub source: String,
    /// The unit of shapes: `file` or `solid`.
    pub unit: Option<&'static str>,
    /// The `#` number of the solid, if the shape is one.
    pub solid_step_id: Option<u64>,
    /// The name of the product.
    pub product: Option<String>,
    /// The hash of the settings with which it was labeled.
    pub settings_sha256: Option<String>,
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeRow {
    origin: ShapeOrigin,
    source_sha256: String,
    kind: ShapeKind,
    theta_deg: f64,
    tau_min: u32,
    n_parts: usize,
    n_labels: usize,
    n_triangles: usize,
    area_mm2: Vec<f64>,
    length_mm: Vec<f64>,
    labels: ShapeLabels,
}

impl ShapeRow {
    /// The row of a carrier.
    #[must_use]
    pub fn new(origin: ShapeOrigin, carrier: &Carrier) -> Self {
        let (meta, graph) = (carrier.meta(), carrier.graph());
        Self {
            origin,
            source_sha256: meta.source_sha256.clone(),
            kind: carrier.kind(),
            theta_deg: meta.theta_deg,
            tau_min: meta.tau_min,
            n_parts: carrier.n_raw_parts(),
            n_labels: carrier.n_parts(),
            n_triangles: carrier.mesh().triangles.len(),
            area_mm2: graph.faces.iter().map(|face| face.area).collect(),
            length_mm: graph.edges.iter().map(|edge| edge.length).collect(),
            labels: ShapeLabels::of(carrier),
        }
    }
}

/// The table of these shapes, with one column per layer.
///
/// # Errors
/// If a layer has the name of another column.
pub fn shape_table(rows: &[ShapeRow], layers: &BTreeSet<String>) -> Result<Table, TableError> {
    let labels: Vec<Option<&ShapeLabels>> = rows.iter().map(|row| Some(&row.labels)).collect();
    let areas = rows.iter().map(|row| Some(full(&row.area_mm2)));
    let lengths = rows.iter().map(|row| Some(full(&row.length_mm)));

    let mut columns = scalar_columns(rows);
    columns.extend(face_columns(&labels, layers));
    columns.push(Column::of_lists("face_area_mm2", areas));
    columns.extend(edge_columns(&labels));
    columns.push(Column::of_lists("edge_length_mm", lengths));
    Table::new(columns)
}

fn scalar_columns(rows: &[ShapeRow]) -> Vec<Column> {
    let text = |name: &str, cell: fn(&ShapeRow) -> Option<String>| {
        Column::of_cells(name, rows.iter().map(|row| cell(row).map(Text::Owned)))
    };
    let known = |name: &str, cell: fn(&ShapeRow) -> Option<&'static str>| {
        Column::of_cells(name, rows.iter().map(|row| cell(row).map(Text::Borrowed)))
    };
    let number = |name: &str, cell: fn(&ShapeRow) -> Option<u64>| {
        Column::of_cells(name, rows.iter().map(cell))
    };
    let thetas = rows.iter().map(|row| Some(row.theta_deg));
    vec![
        text("id", |row| Some(row.origin.id.clone())),
        text("source", |row| Some(row.origin.source.clone())),
        text("source_sha256", |row| Some(row.source_sha256.clone())),
        known("unit", |row| row.origin.unit),
        number("solid_step_id", |row| row.origin.solid_step_id),
        text("product", |row| row.origin.product.clone()),
        known("kind", |row| Some(row.kind.name())),
        text("settings_sha256", |row| row.origin.settings_sha256.clone()),
        Column::of_cells("theta_deg", thetas),
        number("tau_min", |row| Some(u64::from(row.tau_min))),
        number("n_faces", |row| Some(row.labels.step_id.len() as u64)),
        number("n_edges", |row| Some(row.labels.edge_faces.len() as u64)),
        number("n_parts", |row| Some(row.n_parts as u64)),
        number("n_labels", |row| Some(row.n_labels as u64)),
        number("n_triangles", |row| Some(row.n_triangles as u64)),
    ]
}

/// The key-value metadata of a file with this table.
#[must_use]
pub fn shape_metadata() -> BTreeMap<String, String> {
    schema_metadata("shapes", SHAPES_VERSION)
}

/// The metadata with the kind of the table in a file.
#[must_use]
pub fn schema_metadata(schema: &str, version: u32) -> BTreeMap<String, String> {
    BTreeMap::from([
        (SCHEMA_KEY.to_owned(), schema.to_owned()),
        (SCHEMA_VERSION_KEY.to_owned(), version.to_string()),
    ])
}
