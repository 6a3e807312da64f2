//! Defines the values that partprobe's stages exchange, and pure arithmetic on them.
//!
//! A [`Carrier`] is a triangle mesh in which every triangle records its face, with the graph of the faces and one [`LabelLayer`]
//! per label source. A [`PointSample`] is drawn from it. [`Labels`] belong to its triangles, and [`Embeddings`] are rows of
//! numbers for tokens or points. Faces and meshes are defined in [`partprobe_shape`]. Its items are also exported here.
//!
//! ```
//! use partprobe_carrier::{
//!     Carrier, CarrierMeta, Edge, Face, FaceGraph, FaceType, LabelLayer, Mesh, NormalKind, STEP_PARTS,
//!     STEP_PARTS_RAW, Units, keyed_rng, sample_by_area,
//! };
//!
//! // Two triangles at a right angle. Each is a planar face of its own.
//! let mesh = Mesh {
//!     vertices: vec![
//!         [0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0],
//!         [0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0],
//!     ],
//!     vertex_face: vec![0, 0, 0, 1, 1, 1],
//!     triangles: vec![[0, 1, 2], [3, 4, 5]],
//!     tri_face: vec![0, 1],
//!     vertex_normal: Vec::new(),
//! };
//! let graph = FaceGraph {
//!     faces: vec![Face::new(11, FaceType::Plane, 2.0), Face::new(12, FaceType::Plane, 2.0)],
//!     edges: vec![Edge { faces: [0, 1], phi: 90.0, length: 2.0 }],
//! };
//! let meta = CarrierMeta {
//!     id: "corner".to_owned(),
//!     source_sha256: String::new(),
//!     theta_deg: 8.0,
//!     tau_min: 0,
//!     chord_mm: 0.01,
//!     angle_rad: 0.3,
//!     diagonal_mm: mesh.diagonal(),
//!     units: Units::millimeters_and_radians(),
//!     lost: Vec::new(),
//!     notes: Vec::new(),
//!     instances: Vec::new(),
//! };
//!
//! // The two faces are two parts. `partprobe_sources::StepParts` computes these layers by the rule.
//! let parts = LabelLayer::from(vec![0, 1]);
//! let layers = [(STEP_PARTS_RAW, parts.clone()), (STEP_PARTS, parts)];
//! let carrier = Carrier::new(mesh, graph, layers, meta)?;
//! assert_eq!(carrier.triangle_labels().of_triangle(), [0, 1]);
//!
//! let mut rng = keyed_rng(0, &["example", "corner"]);
//! let sample = sample_by_area(carrier.mesh(), 100, NormalKind::Triangle, &mut rng)?;
//! assert_eq!(sample.points.len(), 100);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What it guarantees
//!
//! - Lengths are millimeters, areas square millimeters, angles degrees, unless a name says otherwise.
//! - Faces are in the order of the file's shells, at every stage.
//! - A carrier was checked when it was made: every index in it is valid, and every layer has one label per face.
//! - All random numbers come from [`keyed_rng`], so the same seed and key give the same numbers on every machine.
//!
//! # What it does not do
//!
//! It does not read STEP, decide which faces belong together, open a file, print, or read the clock, and it knows nothing
//! about networks.

mod carrier;
mod descriptor;
mod eigen;
mod embeddings;
mod estimated_normals;
mod form;
mod given;
mod label_layer;
mod labels;
mod nearest_points;
mod partition;
mod point_sample;
mod random;
mod refine;
mod sha256;
mod shape_kind;
mod signature;

pub use carrier::{Carrier, CarrierError, CarrierMeta};
pub use descriptor::Descriptor;
pub use embeddings::{Embeddings, EmbeddingsError};
pub use estimated_normals::estimated_normals;
pub use given::{GivenError, GivenShape, carrier_of_given};
pub use label_layer::{GIVEN, LabelLayer, STEP_PARTS, STEP_PARTS_RAW};
pub use labels::{IGNORE, Labels};
pub use nearest_points::{NearestPoints, nearest_points};
pub use partition::Partition;
pub use point_sample::{NormalKind, PointSample, SampleError, sample_by_area};
pub use random::{Rng, keyed_rng, unit_interval};
pub use refine::{REFINE_FRACTION, RefinedMesh, refine, refined_triangle_counts};
pub use sha256::{hexadecimal, sha256_hex};
pub use shape_kind::ShapeKind;
pub use signature::{Family, Signature, signature, signature_of_carrier};

pub use partprobe_shape::{
    Color, Edge, Face, FaceGraph, FaceType, Instance, Mesh, Point, SameTypePair, SolidMesh,
    SurfaceAttributes, Units, WeldedMesh, border_sides, bounding_box, bounding_diagonal, centroid,
    cross, distance, dot, norm, rotation_of_quaternion, smooth_normals, solid_mesh, subtract,
    triangle_area, unit_normal, weld,
};
