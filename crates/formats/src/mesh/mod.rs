//! Reads foreign mesh files, and writes labeled meshes.
//!
//! [`foreign`] is what all readers share, and [`labeled_mesh`] is what the writers of OBJ and PLY get.

pub(crate) mod foreign;
pub(crate) mod glb;
pub(crate) mod labeled_mesh;
pub(crate) mod obj;
pub(crate) mod off;
pub(crate) mod ply;
pub(crate) mod stl;
