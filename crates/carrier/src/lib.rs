//! The values that partprobe's stages exchange, and what is pure arithmetic on them:
//! `FaceGraph → Partition → Carrier → PointSample`, beside `Labels` and `Embeddings`.
//!
//! Nothing here reads STEP, opens a file, prints, asks the clock or knows about networks.
//! Lengths are millimeters, areas square millimeters, angles degrees unless a name says otherwise.
//! Face order is the order of the file's shells, at every stage.

mod carrier;
mod embeddings;
mod form;
mod labels;
mod partition;
mod point_sample;
mod random;
mod refine;
mod sha256;
mod signature;
mod tau_min;

pub use carrier::{Carrier, CarrierError, CarrierMeta};
pub use embeddings::{Embeddings, EmbeddingsError};
pub use labels::{IGNORE, Labels};
pub use partition::{ANGLE_TIE_DEG, Partition};
pub use point_sample::{NormalKind, PointSample, SampleError, sample_by_area};
pub use random::{Rng, keyed_rng, unit_interval};
pub use refine::{REFINE_FRACTION, Refined, refine, refined_triangle_counts};
pub use sha256::{hexadecimal, sha256_hex};
pub use signature::{Family, Signature, signature};
pub use tau_min::{TauMin, absorb_parts_below, absorb_small_parts};

pub use partprobe_shape::{
    Color, Edge, Face, FaceGraph, FaceType, Instance, Mesh, Point, SameTypePair, SolidMesh,
    SurfaceAttributes, Units, Welded, border_sides, bounding_box, bounding_diagonal, cross,
    distance, dot, norm, solid_mesh, subtract, triangle_area, weld,
};
