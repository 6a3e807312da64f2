//! The surface of a network as a mesh: where its distance is 0.

mod cube;
mod extract;
mod grid;

pub use extract::{SurfaceError, surface};
pub use grid::Resolution;
