//! Makes and reads packages of released labels, which contain no geometry.
//!
//! The labels of shapes go in ([`ReleasedRow`]), and the bytes of the files of a package come out: Parquet tables, a [`Manifest`]
//! with the hash of every file, a [`datasheet()`], and a [`license_note()`]. The same bytes become rows again.
//! [`first_difference`] compares the labels of a package with current labels, and [`Registry`] joins several packages by the hash
//! of the STEP text.
//!
//! ```
//! use partprobe_release::{ReleasedRow, first_difference, rows_from_parquet, rows_to_parquet};
//! use partprobe_tables::ShapeLabels;
//!
//! let text = partprobe_synth::fixtures::cuboid([3.0, 2.0, 1.0]);
//! let file = partprobe_label::label(text.as_bytes(), "block", &Default::default())?;
//! let labels = ShapeLabels::of(file.shapes[0].carrier.as_ref().unwrap());
//! let row = ReleasedRow::with_labels("block", "block", &file.sha256, labels);
//!
//! let bytes = rows_to_parquet(&[row.clone()], &Default::default())?;
//! let released = rows_from_parquet(bytes)?;
//! assert_eq!(released, [row]);
//! let now = released[0].labels.as_ref().unwrap();
//! assert_eq!(first_difference(now, now), None);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Limits: it opens no file and never reads STEP. The caller who makes the rows decides what is released.

mod datasheet;
mod difference;
mod digest;
#[cfg(test)]
mod fixtures;
mod license_note;
mod manifest;
mod registry;
mod rows;

pub use datasheet::{DatasheetFacts, Unlabeled, datasheet};
pub use difference::{LabelDifference, first_difference};
pub use digest::{labels_sha256, parts_sha256};
pub use license_note::license_note;
pub use manifest::{
    Counts, DATASHEET_FILE, FileFacts, LICENSE_NOTE_FILE, MANIFEST_FILE, Manifest, ManifestError,
    PACKAGE_VERSION, labels_file,
};
pub use registry::{
    Disagreement, JoinedShape, LabelSet, PackageFacts, PackagePair, PackageShapes, Registry,
    joined_table,
};
pub use rows::{
    ReleasedRow, ReleasedShape, RowsError, RowsWriteError, rows_from_parquet, rows_to_parquet,
    shapes_from_parquet,
};
