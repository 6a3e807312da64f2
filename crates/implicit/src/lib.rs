//! Fits a small network to one shape, and scores its surface and its labels (paper §4.5).
//!
//! A mesh and the labels of points on it go in. A network comes out. Its trunk gives the distance of a point from the surface,
//! and its head gives the label of the point. Its surface is extracted as a mesh, and both are compared with the shape.
//!
//! ```
//! use partprobe_implicit::{
//!     Mode, PointLabels, PoolSizes, Pools, Reconstruction, Reference, Resolution, Settings, Training, Trunk,
//! };
//! use partprobe_carrier::Mesh;
//!
//! // A tetrahedron, whose four triangles are four labels.
//! let mesh = Mesh {
//!     vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
//!     vertex_face: vec![0; 4],
//!     triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
//!     tri_face: vec![0, 1, 2, 3],
//!     vertex_normal: Vec::new(),
//! };
//! let reference = Reference::new(&mesh)?;
//! let sizes = PoolSizes { surface: 2_000, near: 2_000, uniform: 1_000 };
//! let pools = Pools::new(&reference, sizes, "tetrahedron")?;
//! let labels = pools.surface.sample.triangles.iter().map(|&triangle| triangle as i32).collect();
//! let labels = PointLabels::new(labels, &pools)?;
//!
//! let settings = Settings {
//!     trunk: Trunk::Siren64x4,
//!     iterations: 100,
//!     points: [192, 192, 96],
//!     ..Settings::of_mode(Mode::OracleSdf)
//! };
//! let mut training = Training::new(&pools, Some(&labels), &settings, 0);
//! while training.n_updates() < settings.iterations {
//!     training.update();
//! }
//! let network = training.finish();
//! assert_eq!(network.n_labels(), 4);
//!
//! let resolution = Resolution::new(32).unwrap();
//! let surface = Reconstruction::new(&network, &reference, resolution, 1_000, "tetrahedron")?;
//! assert_eq!(surface.labels.len(), 1_000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What it guarantees
//!
//! - Same input, settings and seed: same bytes, for any number of threads and any vector unit.
//! - The initial trunk and the points of each update do not depend on the labels. With [`SegGrad::Stop`], the trunk is
//!   that of a training without labels, bit by bit.
//! - The network after the last update is the result. Nothing is chosen by its score.
//! - A shape without an inside gives a [`ReferenceError`].
//!
//! # What it does not do
//!
//! It opens no file, prints nothing, and makes no labels.

#[cfg(test)]
mod fixtures;
mod geometry;
mod kernels;
mod network;
mod scores;
mod surface;
#[cfg(test)]
mod testing;
mod training;

pub use geometry::{
    Frame, OffSurfacePoints, PoolSizes, Pools, Reference, ReferenceError, SurfacePoints,
};
pub use network::{Network, Trunk, UnknownTrunk};
pub use scores::{
    LabelScores, PointScores, Reconstruction, SurfaceScores, cons_knn, cons_normal,
    reference_sample, sampling_floor, shared_label_scores, surface_scores,
};
pub use surface::{Resolution, SurfaceError, surface};
pub use training::{LabelError, Losses, Mode, PointLabels, SegGrad, Settings, Training};
