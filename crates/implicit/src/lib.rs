//! Fits a small network to one shape, and scores its surface and its labels (paper §4.5).
//!
//! A mesh and the labels of points on it go in. A network comes out, whose trunk says how far a point is from the surface and
//! whose head says which label is there. Its surface becomes a mesh again, and both are compared with the shape.

#[cfg(test)]
mod fixtures;
mod geometry;
mod kernels;
mod network;
#[cfg(test)]
mod testing;
mod training;

pub use geometry::{Frame, OffSurfacePoints, PoolSizes, Pools, Reference, ReferenceError, SurfacePoints};
pub use network::{Network, Trunk, UnknownTrunk};
pub use training::{LabelError, Losses, Mode, PointLabels, SegGrad, Settings, Training};
