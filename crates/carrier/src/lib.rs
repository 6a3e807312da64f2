//! The values that partprobe's stages exchange, and what is pure arithmetic on them:
//! `FaceGraph → Partition → Carrier → PointSample`, beside `Labels` and `Embeddings`.
//!
//! Nothing here reads STEP, opens a file, prints, asks the clock or knows about networks.
//! Lengths are millimeters, areas square millimeters, angles degrees unless a name says otherwise.
//! Face order is the order of the file's shells, at every stage.

mod carrier;
mod embeddings;
mod face;
mod face_graph;
mod face_type;
mod form;
mod labels;
mod mesh;
mod partition;
mod point_sample;
mod random;
mod refine;
mod sha256;
mod signature;
mod surface_attributes;
mod tau_min;
mod vector;
mod weld;

pub use carrier::{Carrier, CarrierError, CarrierMeta, Units};
pub use embeddings::{Embeddings, EmbeddingsError};
pub use face::{Color, Face, Instance};
pub use face_graph::{Edge, FaceGraph, SameTypePair};
pub use face_type::FaceType;
pub use labels::{IGNORE, Labels};
pub use mesh::Mesh;
pub use partition::{ANGLE_TIE_DEG, Partition};
pub use point_sample::{NormalKind, PointSample, SampleError, sample_by_area};
pub use random::{Rng, keyed_rng};
pub use refine::{REFINE_FRACTION, Refined, refine, refined_triangle_counts};
pub use sha256::{hexadecimal, sha256_hex};
pub use signature::{Family, Signature, signature};
pub use surface_attributes::SurfaceAttributes;
pub use tau_min::{TauMin, absorb_small_parts};
pub use vector::{
    Point, bounding_box, bounding_diagonal, cross, distance, dot, norm, subtract, triangle_area,
};
pub use weld::{SolidMesh, Welded, border_sides, solid_mesh, weld};
