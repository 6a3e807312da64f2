//! Reads and writes the files of a carrier: the NPZ archive with its JSON settings, and tables of its faces and edges.

pub(crate) mod face_tables;
pub(crate) mod meta;
pub(crate) mod npz;
