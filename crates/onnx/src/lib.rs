//! Runs a user's ONNX model on a shape and clusters its features: the label source `onnx`.
//!
//! A model takes the positions and normals of points or triangles, and returns one row of numbers for each. The rows are
//! clustered by k-means, or by Ward linkage over neighboring triangles or faces. Each cluster is a label.
//!
//! ```
//! use partprobe_onnx::{ONNX, OnnxError};
//! use partprobe_sources::SourceContext;
//!
//! // What `[sources.NAME]` with `type = "onnx"` understands. `path` must be set, and no other key may be.
//! let keys: Vec<&str> = ONNX.keys.iter().map(|key| key.name).collect();
//! assert!(keys.starts_with(&["path", "runtime", "per", "points"]));
//! let error = ONNX.open(&SourceContext::default()).err().map(|error| error.to_string());
//! assert_eq!(error.as_deref(), Some("type `onnx` needs the key `path`; set it"));
//! ```
//!
//! # What it guarantees
//!
//! - The same model, shape and settings give the same labels for any number of threads: a model runs on the thread that
//!   calls it. Another runtime, or another processor, may give features that differ in the last digits.
//! - A missing runtime, a missing tensor, a dimension that does not fit, a NaN and an unknown operator are messages, which
//!   name the model, the tensor, what was found and expected, and what to do.
//!
//! # What it does not do
//!
//! It trains nothing, prints nothing, and opens no file except the library of ONNX Runtime. It does not search for that library:
//! the program that uses this crate names it.
//!
//! # Runtime
//!
//! The cargo feature `ort`, which is on by default, loads ONNX Runtime 1.17 or newer when the first model is opened. tract, a
//! runtime in Rust, was also considered. It compiles for fifteen minutes and changes features of crates that burn shares.
//!
//! [`open_model`] opens only the model. Another runtime implements [`Model`], and [`labels_by_model`] makes labels with it.

mod clustering;
mod error;
mod features;
mod frame;
mod items;
mod layout;
mod model;
mod runtime;
mod settings;
mod source_type;
mod tensor;

pub use error::OnnxError;
pub use model::Model;
pub use runtime::open_model;
pub use source_type::{ONNX, labels_by_model};
pub use tensor::{Element, InputTensor, InputValues, OutputTensor, TensorSpec};
