//! Reads and writes NumPy's files: arrays (`.npy`) and archives of named arrays (`.npz`), and a hash of what an archive
//! holds.
//!
//! Bytes go in and [`array::Array`]s come out, and back. Nothing here knows what an array means.

pub(crate) mod array;
pub(crate) mod content_hash;
pub(crate) mod half;
pub(crate) mod members;
pub(crate) mod npy;
pub(crate) mod npy_header;
pub(crate) mod npz;
