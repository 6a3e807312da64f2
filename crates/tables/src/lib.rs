//! Converts tables of labeled shapes to Parquet files, and back.
//!
//! A [`Table`] has named columns, whose cells are values or lists of values. [`table_to_parquet`] gives the bytes of a file, and
//! [`table_from_parquet`] gives the table again. [`shape_table`] makes the columns of labeled shapes: one row per shape, with
//! lists per face and per edge.
//!
//! ```
//! use partprobe_tables::{Columns, ShapeOrigin, ShapeRow, shape_table, table_from_parquet, table_to_parquet};
//!
//! let text = partprobe_synth::fixtures::cuboid([3.0, 2.0, 1.0]);
//! let file = partprobe_label::label(text.as_bytes(), "block", &Default::default())?;
//! let carrier = file.shapes[0].carrier.as_ref().unwrap();
//! let origin = ShapeOrigin { id: "block".to_owned(), ..ShapeOrigin::default() };
//! let table = shape_table(&[ShapeRow::new(origin, carrier)], &Default::default())?;
//! let bytes = table_to_parquet(&table, &Default::default())?;
//!
//! let mut read = table_from_parquet(bytes, Columns::Named(&["face_part"]))?.table;
//! let parts = read.take_lists::<i32>("face_part")?;
//! assert_eq!(parts[0].as_ref().unwrap().len(), 6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Guarantees: the bytes depend only on the table and the metadata. Damaged bytes give an error, never a panic.
//!
//! Limits: it opens no file, and labels nothing. It reads the files that it writes, but not every Parquet file.

mod labels;
mod parquet_file;
mod read;
mod shapes;
mod table;
#[cfg(test)]
mod tests;
mod write;

pub use labels::{
    LabelRowError, ShapeLabels, edge_columns, face_columns, labels_of_table, layers_of,
};
pub use read::{Columns, ParquetReadError, ParquetTable, table_from_parquet};
pub use shapes::{
    SCHEMA_KEY, SCHEMA_VERSION_KEY, ShapeOrigin, ShapeRow, schema_metadata, shape_metadata,
    shape_table,
};
pub use table::{Column, Element, Elements, ListCell, Table, TableError, Text};
pub use write::{ParquetWriteError, table_to_parquet};
