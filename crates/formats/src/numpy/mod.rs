//! Reads and writes NumPy's files: arrays (`.npy`) and archives of named arrays (`.npz`), and a hash of the content of an
//! archive.
//!
//! Bytes go in and [`array::Array`]s come out, and back. This module does not interpret the arrays.

pub(crate) mod array;
pub(crate) mod content_hash;
pub(crate) mod half;
pub(crate) mod members;
pub(crate) mod npy;
pub(crate) mod npy_header;
pub(crate) mod npz;
