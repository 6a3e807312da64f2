//! Runs `partprobe export`: it writes labeled shapes in the formats of other programs.
//!
//! Carriers (or files, which are labeled first) go in, and a folder comes out. It has the files of each shape, `export.json` with
//! the settings and, written last, `shapes.jsonl` with one line per shape. `predict` writes the same kind of folder. No label of
//! an export is computed here: part, type, face and layers are those of the carrier.

mod batch;
mod common_args;
mod exporter;
mod face_files;
mod folder;
mod formats;
mod mesh_files;
mod outputs;
mod parquet;
mod part_files;
mod partfield_input;
mod pointcept;
#[cfg(feature = "train")]
mod predicted_labels;
#[cfg(feature = "train")]
mod predictions;
mod session;
mod shape_facts;
mod shape_line;
mod verb;
mod webdataset;

pub(crate) use pointcept::SIDES;
#[cfg(feature = "train")]
pub(crate) use predictions::{PredictArgs, predict};
pub(crate) use shape_line::ShapeLine;
pub(crate) use verb::{ExportArgs, export};
