//! Defines the reference shape in its frame, and points with their exact signed distances.

mod pools;
mod reference;
mod winding;

pub use pools::{OffSurfacePoints, PoolSizes, Pools, SurfacePoints};
pub use reference::{Frame, Reference, ReferenceError};
