//! Defines the rows of a package, and reads and writes them as Parquet.

use crate::digest::{labels_sha256, parts_sha256};
use partprobe_tables::{
    Column, Columns, LabelRowError, ParquetReadError, ParquetWriteError, ShapeLabels, Table,
    TableError, Text, edge_columns, face_columns, labels_of_table, schema_metadata,
    table_from_parquet, table_to_parquet,
};
use std::collections::BTreeSet;

/// The version of the table of released labels.
const LABELS_VERSION: u32 = 1;
/// The status of a shape that has labels.
const OK: &str = "ok";
/// The columns that identify the shape of a row.
const SHAPE_COLUMNS: [&str; 12] = [
    "id",
    "file_id",
    "source",
    "source_sha256",
    "solid_step_id",
    "status",
    "n_faces",
    "n_parts",
    "n_labels",
    "labels_sha256",
    "parts_sha256",
    "content_hash",
];

/// A shape of a package without its lists.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReleasedShape {
    /// The id of the shape in its data set.
    pub id: String,
    /// The id of the shape's file.
    pub file_id: String,
    /// The name of the file without its folders. It is `None` in an anonymous package.
    pub source: Option<String>,
    /// The SHA-256 of the STEP text, in hexadecimal.
    pub source_sha256: String,
    /// The `#` number of the solid, if the shape is one.
    pub solid_step_id: Option<u64>,
    /// `ok`, or the status of a file or solid without labels, as in the index of a data set.
    pub status: String,
    /// Faces.
    pub n_faces: u64,
    /// Parts before small ones were absorbed.
    pub n_parts: u64,
    /// Parts after small ones were absorbed.
    pub n_labels: u64,
    /// The hash of all labels, or `None` if there are none.
    pub labels_sha256: Option<String>,
    /// The hash of the faces and their parts, or `None` if there are none.
    pub parts_sha256: Option<String>,
    /// The hash of the carrier with the labels. It is `None` in an anonymous package.
    pub content_hash: Option<String>,
}

/// A row of a package.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReleasedRow {
    /// The shape of the row.
    pub shape: ReleasedShape,
    /// Its labels, or `None` for a file or solid without labels.
    pub labels: Option<ShapeLabels>,
}

impl ReleasedRow {
    /// The row of a shape with labels. Its name, its solid and its carrier are not known yet.
    #[must_use]
    pub fn with_labels(id: &str, file_id: &str, source_sha256: &str, labels: ShapeLabels) -> Self {
        let n_of = |labels: &[i32]| {
            let highest = labels.iter().max().copied().unwrap_or(-1);
            u64::try_from(i64::from(highest) + 1).unwrap_or(0)
        };
        let shape = ReleasedShape {
            status: OK.to_owned(),
            n_faces: labels.step_id.len() as u64,
            n_parts: n_of(&labels.part),
            n_labels: n_of(&labels.label),
            labels_sha256: Some(labels_sha256(&labels)),
            parts_sha256: Some(parts_sha256(&labels)),
            ..ReleasedShape::new(id, file_id, source_sha256)
        };
        Self {
            shape,
            labels: Some(labels),
        }
    }

    /// The row of a file or solid without labels.
    #[must_use]
    pub fn without_labels(id: &str, file_id: &str, source_sha256: &str, status: &str) -> Self {
        let shape = ReleasedShape {
            status: status.to_owned(),
            ..ReleasedShape::new(id, file_id, source_sha256)
        };
        Self {
            shape,
            labels: None,
        }
    }
}

impl ReleasedShape {
    fn new(id: &str, file_id: &str, source_sha256: &str) -> Self {
        Self {
            id: id.to_owned(),
            file_id: file_id.to_owned(),
            source_sha256: source_sha256.to_owned(),
            ..Self::default()
        }
    }
}

/// The reason why bytes are not rows of a package.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RowsError {
    /// They are not a table.
    #[error(transparent)]
    Parquet(#[from] ParquetReadError),
    /// A column is missing or of another type.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The labels of a row contradict each other.
    #[error(transparent)]
    Labels(#[from] LabelRowError),
    /// A row does not identify its shape.
    #[error("row {row}: `{column}` is missing")]
    MissingValue {
        /// The row, counted from 0.
        row: usize,
        /// The column.
        column: &'static str,
    },
}

/// The bytes of a Parquet file with these rows, and with a column for each of these layers.
///
/// # Errors
/// If a layer has the name of another column, or the file would pass the limits of the format.
pub fn rows_to_parquet(
    rows: &[ReleasedRow],
    layers: &BTreeSet<String>,
) -> Result<Vec<u8>, RowsWriteError> {
    let labels: Vec<Option<&ShapeLabels>> = rows.iter().map(|row| row.labels.as_ref()).collect();
    let mut columns = shape_columns(rows);
    columns.extend(face_columns(&labels, layers));
    columns.extend(edge_columns(&labels));
    let metadata = schema_metadata("released-labels", LABELS_VERSION);
    Ok(table_to_parquet(&Table::new(columns)?, &metadata)?)
}

/// The reason why rows cannot be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RowsWriteError {
    /// A layer has the name of another column.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The file would pass the limits of the format.
    #[error(transparent)]
    Parquet(#[from] ParquetWriteError),
}

fn shape_columns(rows: &[ReleasedRow]) -> Vec<Column> {
    let text = |name: &str, cell: fn(&ReleasedShape) -> Option<&String>| {
        let cells = rows.iter().map(|row| cell(&row.shape).cloned());
        Column::of_cells(name, cells.map(|cell| cell.map(Text::Owned)))
    };
    let number = |name: &str, cell: fn(&ReleasedShape) -> Option<u64>| {
        Column::of_cells(name, rows.iter().map(|row| cell(&row.shape)))
    };
    vec![
        text("id", |shape| Some(&shape.id)),
        text("file_id", |shape| Some(&shape.file_id)),
        text("source", |shape| shape.source.as_ref()),
        text("source_sha256", |shape| Some(&shape.source_sha256)),
        number("solid_step_id", |shape| shape.solid_step_id),
        text("status", |shape| Some(&shape.status)),
        number("n_faces", |shape| Some(shape.n_faces)),
        number("n_parts", |shape| Some(shape.n_parts)),
        number("n_labels", |shape| Some(shape.n_labels)),
        text("labels_sha256", |shape| shape.labels_sha256.as_ref()),
        text("parts_sha256", |shape| shape.parts_sha256.as_ref()),
        text("content_hash", |shape| shape.content_hash.as_ref()),
    ]
}

/// The rows in the bytes of a Parquet file.
///
/// # Errors
/// If the bytes are damaged, or are not those of released labels.
pub fn rows_from_parquet(bytes: Vec<u8>) -> Result<Vec<ReleasedRow>, RowsError> {
    let mut table = table_from_parquet(bytes, Columns::All)?.table;
    let shapes = shapes_of(&mut table)?;
    let labels = labels_of_table(table)?;
    let row = |(shape, labels)| ReleasedRow { shape, labels };
    Ok(shapes.into_iter().zip(labels).map(row).collect())
}

/// The rows without their lists. The lists are not decoded.
///
/// # Errors
/// The same as for [`rows_from_parquet`].
pub fn shapes_from_parquet(bytes: Vec<u8>) -> Result<Vec<ReleasedShape>, RowsError> {
    let mut table = table_from_parquet(bytes, Columns::Named(&SHAPE_COLUMNS))?.table;
    shapes_of(&mut table)
}

/// A field of a shape, to be filled from a column.
type Field<T> = fn(&mut ReleasedShape) -> &mut T;

fn shapes_of(table: &mut Table) -> Result<Vec<ReleasedShape>, RowsError> {
    let n_rows = table.n_rows();
    let mut shapes = vec![ReleasedShape::default(); n_rows];
    fill(&mut shapes, table, "id", |shape, id| shape.id = id)?;
    fill(&mut shapes, table, "file_id", |shape, id| {
        shape.file_id = id
    })?;
    fill(&mut shapes, table, "source_sha256", |shape, hash| {
        shape.source_sha256 = hash;
    })?;
    fill(&mut shapes, table, "status", |shape, status| {
        shape.status = status;
    })?;
    let numbers: [(&'static str, Field<u64>); 3] = [
        ("n_faces", |shape| &mut shape.n_faces),
        ("n_parts", |shape| &mut shape.n_parts),
        ("n_labels", |shape| &mut shape.n_labels),
    ];
    for (column, field) in numbers {
        for (row, cell) in table.take_cells::<u64>(column)?.into_iter().enumerate() {
            *field(&mut shapes[row]) = cell.ok_or(RowsError::MissingValue { row, column })?;
        }
    }
    let solids = table.take_cells::<u64>("solid_step_id")?;
    for (shape, solid) in shapes.iter_mut().zip(solids) {
        shape.solid_step_id = solid;
    }
    let optional: [(&str, Field<Option<String>>); 4] = [
        ("source", |shape| &mut shape.source),
        ("labels_sha256", |shape| &mut shape.labels_sha256),
        ("parts_sha256", |shape| &mut shape.parts_sha256),
        ("content_hash", |shape| &mut shape.content_hash),
    ];
    for (column, field) in optional {
        for (shape, cell) in shapes.iter_mut().zip(table.take_cells::<Text>(column)?) {
            *field(shape) = cell.map(Text::into_owned);
        }
    }
    Ok(shapes)
}

/// Fills a text that every row has.
fn fill(
    shapes: &mut [ReleasedShape],
    table: &mut Table,
    column: &'static str,
    set: impl Fn(&mut ReleasedShape, String),
) -> Result<(), RowsError> {
    let cells = table.take_cells::<Text>(column)?;
    for (row, (shape, cell)) in shapes.iter_mut().zip(cells).enumerate() {
        let text = cell.ok_or(RowsError::MissingValue { row, column })?;
        set(shape, text.into_owned());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::FaceType;

    fn rows() -> Vec<ReleasedRow> {
        let labels = ShapeLabels {
            step_id: vec![10, 20],
            instance: vec![0, 0],
            face_type: vec![FaceType::Plane, FaceType::Torus],
            canonical_type: vec![FaceType::Plane; 2],
            part: vec![0, 1],
            label: vec![0, 0],
            layers: [("smooth-12".to_owned(), vec![0, 0])].into(),
            edge_faces: vec![[0, 1]],
            phi_deg: vec![None],
        };
        let mut solid = ReleasedRow::with_labels("a__s3", "a", "ab", labels);
        solid.shape.solid_step_id = Some(7);
        solid.shape.source = Some("a.step".to_owned());
        vec![
            solid,
            ReleasedRow::without_labels("b", "b", "cd", "over-budget"),
        ]
    }

    #[test]
    fn rows_round_trip_with_and_without_their_lists() {
        let layers = BTreeSet::from(["smooth-12".to_owned()]);
        let bytes = rows_to_parquet(&rows(), &layers).unwrap();
        assert_eq!(rows_from_parquet(bytes.clone()).unwrap(), rows());
        let shapes: Vec<ReleasedShape> = rows().into_iter().map(|row| row.shape).collect();
        assert_eq!(shapes_from_parquet(bytes).unwrap(), shapes);
        assert_eq!((shapes[0].n_parts, shapes[0].n_labels), (2, 1));
    }

    #[test]
    fn tables_of_something_else_are_refused() {
        let table = Table::new(vec![Column::of_cells("id", [Some(1)])]).unwrap();
        let bytes = table_to_parquet(&table, &schema_metadata("other", 1)).unwrap();
        let refused = rows_from_parquet(bytes.clone()).unwrap_err();
        assert_eq!(refused.to_string(), "column `id` does not hold texts");
        let refused = shapes_from_parquet(bytes).unwrap_err();
        assert_eq!(
            refused.to_string(),
            "the Parquet file has no column `file_id`"
        );
    }
}
