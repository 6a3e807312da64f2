//! Makes label sources of labels that another program made: files of labels, joined to the carriers that they belong to.
//!
//! Takes the parameters of an import and a way to read files. Returns a label source, and for each shape a report of how
//! its labels were joined. A label never moves silently: if two joins are possible, or a count differs, the shape
//! is refused with the reason.
//!
//! [`given_shape`] reads meshes and point clouds that have no B-Rep, with the labels that they came with.
//!
//! Each type of import is one file with an [`ImportType`], and one line in [`IMPORT_TYPES`]. A type may be in another
//! crate, too: it implements [`Import`], and [`import_type_among`] finds it. Nothing here opens a file
//! itself, prints or draws random numbers.

mod entries;
mod faces;
mod given;
mod import;
mod import_type;
mod import_types;
mod mesh;
mod nearest_label;
pub mod parameters;
mod partfield;
mod points;
mod position;
mod shape_key;

pub use given::{
    GivenFileError, NamedBytes, given_shape, given_stem, holds_rows_of_numbers, is_given_name,
    label_names_of,
};
pub use import::{Import, ImportError, ImportedSource, JoinProblem, JoinReport, JoinedLabels};
pub use import_type::{ImportType, ParameterKey};
pub use import_types::{IMPORT_TYPES, import_type_among, open_import};
