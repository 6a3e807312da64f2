//! Reads foreign mesh files, and writes labeled meshes.
//!
//! [`foreign`] is what all readers share, [`labeled_mesh`] is what the writers of OBJ and PLY get, and [`marked_mesh`] is
//! what the readers of labeled meshes return.

pub(crate) mod foreign;
pub(crate) mod glb;
pub(crate) mod gltf;
pub(crate) mod labeled_mesh;
pub(crate) mod marked_mesh;
pub(crate) mod obj;
pub(crate) mod off;
pub(crate) mod ply;
pub(crate) mod stl;
