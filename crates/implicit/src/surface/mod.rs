//! Extracts the surface of a network, where its distance is 0, as a mesh.

mod cube;
mod extract;
mod grid;

pub use extract::{SurfaceError, surface};
pub use grid::Resolution;
