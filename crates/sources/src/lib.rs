//! Labels carriers by rules and segmentations, all behind one trait: `Carrier → SourceLabels`.
//!
//! Each source has a name, which configs, score files and folders use. [`SOURCES`] lists them all.
//! Nothing here reads a file, prints or trains; a source that needs random numbers keys them by seed and shape.
//!
//! A source of your own needs no change here: implement [`LabelSource`], or make a [`SourceFactory`] of a function and
//! look names up with [`source_among`]. `tests/custom_source.rs` does both.

mod degraded;
mod dihedral_grow;
mod face_rules;
mod factory;
mod file_groups;
mod given;
mod label_files;
mod line_kmeans;
mod normal_kmeans;
mod pieces;
mod primitive_fit;
mod ransac;
mod ray_tree;
mod region_merging;
mod registry;
mod sdf;
mod source;
mod step_flipped;
mod step_jittered;
mod step_merged;
mod step_parts;
mod step_split;
mod surface;
mod triangle_normal;
mod vsa;
mod ward;

pub use factory::{BoxedSource, NumberedRule, Rule, SourceContext, SourceFactory};
pub use label_files::{FileError, PathKind, SourceFiles};
pub use pieces::{PieceLabels, Pieces};
pub use region_merging::{Border, welded_borders};
pub use registry::{SOURCES, face_source_named, source_among, source_named};
pub use sdf::shape_diameters;
pub use source::{LabelSource, Origin, PointRule, SourceError, SourceLabels};
pub use step_parts::StepParts;
pub use step_parts::absorption::{absorb_parts_below, absorb_small_parts};
pub use step_parts::rule::{
    ANGLE_TIE_DEG, partition_by_canonical_type_and_angle, partition_by_type_and_angle,
};
