//! Compares a reconstructed surface and its labels with the reference.

mod consistency;
mod distances;
mod labels;
mod reconstruction;

pub use consistency::{cons_knn, cons_normal};
pub use distances::{PointScores, SurfaceScores, sampling_floor, surface_scores};
pub use labels::{LabelScores, shared_label_scores};
pub use reconstruction::{Reconstruction, reference_sample};
