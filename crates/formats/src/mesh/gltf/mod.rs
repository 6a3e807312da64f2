//! Reads glTF 2.0, as JSON (`.gltf`) or in one binary file (`.glb`).
//!
//! [`container`] finds the JSON and the binary chunk, [`document`] defines the JSON, [`accessor`] reads numbers from the buffers,
//! and [`read`] walks the scene. The `gltf` crate is not used: its iterators over accessors panic if strides and counts do not
//! fit, and it changes the features of `serde_json`. [`crate::mesh::glb`] writes.

pub(crate) mod accessor;
pub(crate) mod container;
pub(crate) mod document;
pub(crate) mod error;
pub(crate) mod pose;
pub(crate) mod read;
