//! Makes label sources of labels that another program made: files of labels, joined to the carriers that they belong to.
//!
//! Takes the parameters of an import and a way to read files. Returns a label source, and for each shape a report of how its
//! labels were joined. Each type of import is one file with an [`ImportType`], and one line in [`IMPORT_TYPES`]. A type may also
//! be in another crate: it implements [`Import`], and [`import_type_among`] finds it.
//!
//! [`given_shape`] reads meshes and point clouds that have no B-Rep, with their own labels.
//!
//! ```
//! use partprobe_imports::{Import, open_import};
//! use partprobe_sources::{FileError, PathKind, SourceContext, SourceFiles};
//! use std::sync::Arc;
//!
//! // The labels of one shape. A program would read the folder `labels/` here.
//! #[derive(Debug)]
//! struct Labels;
//! impl SourceFiles for Labels {
//!     fn kind(&self, path: &str) -> PathKind {
//!         if path == "labels" { PathKind::Folder } else { PathKind::File }
//!     }
//!     fn list(&self, _folder: &str) -> Result<Vec<String>, FileError> {
//!         Ok(vec!["block.csv".to_owned()])
//!     }
//!     fn read(&self, _path: &str) -> Result<Vec<u8>, FileError> {
//!         Ok(b"index,label\n0,top\n1,top\n2,side\n3,side\n4,side\n5,side\n".to_vec())
//!     }
//! }
//!
//! let text = partprobe_synth::fixtures::cuboid([3.0, 2.0, 1.0]);
//! let file = partprobe_label::label(text.as_bytes(), "block", &Default::default())?;
//! let carrier = file.shapes[0].carrier.as_ref().unwrap();
//!
//! let context = SourceContext::default().with_files(Arc::new(Labels)).with("path", "labels");
//! let joined = open_import("faces", &context)?.join(carrier)?;
//! println!("{}", joined.report);
//! assert_eq!(joined.report.n_matched, 6);
//! // Names are numbered in alphabetical order: `side` is 0, and `top` is 1.
//! assert_eq!(joined.labels.of_faces().unwrap().of_face(), [1, 1, 0, 0, 0, 0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What it guarantees
//!
//! - A label is never silently given to a wrong element: if two joins are possible, or a count differs, the shape is refused with
//!   the reason.
//! - A label that is not found is counted, and the report names the files that were read.
//!
//! # What it does not do
//!
//! It opens no file itself, prints nothing and draws no random numbers. It does not judge labels: `partprobe-eval` does.

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
