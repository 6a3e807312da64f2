//! Labels carriers by rules and segmentations, all behind one trait: `Carrier → SourceLabels`.
//!
//! Each source has a name, which configs, score files and folders use. [`SOURCES`] lists them all.
//!
//! Your own source needs no change here: implement [`LabelSource`], or make a [`SourceFactory`] from a function and look up names
//! with [`source_among`]. `tests/custom_source.rs` does both.
//!
//! ```
//! use partprobe_label::{LabelOptions, label};
//! use partprobe_sources::{LabelSource, source_named};
//!
//! let text = partprobe_synth::fixtures::cuboid([3.0, 2.0, 1.0]);
//! let file = label(text.as_bytes(), "block", &LabelOptions::default())?;
//! let carrier = file.shapes[0].carrier.as_ref().unwrap();
//!
//! // Every face of a block is a region of its own, because its normals differ by 90 degrees.
//! let labels = source_named("dihedral-grow-30")?.labels(carrier, 0)?;
//! let of_triangles = labels.of_triangles();
//! assert_eq!(of_triangles.of_triangle().len(), carrier.mesh().triangles.len());
//! assert_eq!(of_triangles.of_triangle().iter().max(), Some(&5));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What it guarantees
//!
//! - The same carrier, name and seed give the same labels on every machine. A source that needs random numbers keys them
//!   by seed and shape.
//! - A source that cannot label a carrier gives a [`SourceError`] with the reason.
//!
//! # What it does not do
//!
//! It opens no file, prints nothing and does not train. A source whose labels come from files asks [`SourceFiles`] for
//! their bytes.

mod basis;
mod capped;
mod cone_fit;
mod controls;
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

pub use controls::{CONTROLS, SourceControl};
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
