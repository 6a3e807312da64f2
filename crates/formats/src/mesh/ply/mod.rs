//! Reads and writes PLY: point clouds and meshes.
//!
//! [`read`] reads any properties in any encoding, and [`marked`] keeps those that may be labels. [`points`] reads and writes
//! point clouds with parts, in the layout of partprobe. [`mod@write`] writes labeled meshes.

pub(crate) mod header;
pub(crate) mod marked;
pub(crate) mod points;
pub(crate) mod read;
pub(crate) mod write;
