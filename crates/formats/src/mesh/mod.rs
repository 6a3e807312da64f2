//! Reads foreign mesh files, and writes labeled meshes.
//!
//! All readers use [`foreign`]. The writers of OBJ and PLY take a [`labeled_mesh`], and the readers of labeled meshes return a
//! [`marked_mesh`].

pub(crate) mod foreign;
pub(crate) mod glb;
pub(crate) mod gltf;
pub(crate) mod labeled_mesh;
pub(crate) mod marked_mesh;
pub(crate) mod obj;
pub(crate) mod off;
pub(crate) mod ply;
pub(crate) mod stl;
