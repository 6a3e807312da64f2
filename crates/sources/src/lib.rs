//! Label sources: rules and segmentations behind one trait, `Carrier → SourceLabels`.
//!
//! A source is asked for by the name that stands in configs, scores and folders.
//! Nothing here reads a file, prints or trains; a source that needs random numbers keys them by seed and shape.
//! What a caller asks of the labels is the label of each sampled point, so a later source may label a finer mesh
//! than the carrier's own and stay behind the same trait.

mod face_rules;
mod normal_kmeans;
mod region_merging;
mod registry;
mod source;

pub use normal_kmeans::NormalKMeans;
pub use registry::{KnownSource, known_sources, source_named};
pub use source::{LabelSource, SourceError, SourceLabels};
