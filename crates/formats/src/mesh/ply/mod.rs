//! Reads and writes PLY: point clouds and meshes.
//!
//! [`read`] understands any properties in any encoding, and [`marked`] keeps those that may be labels. [`points`] is a point cloud with parts, in the one layout that
//! partprobe writes. [`mod@write`] is a labeled mesh.

pub(crate) mod header;
pub(crate) mod marked;
pub(crate) mod points;
pub(crate) mod read;
pub(crate) mod write;
