//! Makes the meshes that PartField reads, and the map from its results back to the carriers.

pub(crate) mod map;
pub(crate) mod mesh;
pub(crate) mod names;
