//! Label sources: rules and segmentations behind one trait, `Carrier → SourceLabels`.
//!
//! A source is asked for by the name that stands in configs, scores and folders; [`SOURCES`] lists them all.
//! Nothing here reads a file, prints or trains; a source that needs random numbers keys them by seed and shape.
//!
//! A source of your own needs no change here: implement [`LabelSource`], or make a [`SourceFactory`] of a function and
//! look names up with [`source_among`]. `tests/custom_source.rs` does both.

mod dihedral_grow;
mod face_rules;
mod factory;
mod file_groups;
mod normal_kmeans;
mod primitive_fit;
mod ransac;
mod region_merging;
mod registry;
mod source;
mod source_files;
mod step_flipped;
mod step_jittered;
mod step_merged;
mod step_parts;
mod step_split;
mod surface;
mod triangle_normal;
mod vsa;
mod ward;
mod ward_linkage;

pub use factory::{BoxedSource, NumberedRule, Rule, SourceContext, SourceFactory};
pub use registry::{SOURCES, source_among, source_named};
pub use source::{LabelSource, Origin, PointRule, SourceError, SourceLabels};
pub use source_files::{FileError, PathKind, SourceFiles};
