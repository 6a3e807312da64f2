//! Reads and writes the meshes of Wavefront OBJ.

pub(crate) mod read;
pub(crate) mod write;
