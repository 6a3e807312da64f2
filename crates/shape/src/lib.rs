//! Defines what a reader of STEP files returns: faces, the edges between them, and a mesh with source faces.
//!
//! A [`FaceGraph`] holds the faces of a shape and their shared edges with dihedral angles. A [`Mesh`] holds triangles,
//! and each triangle records its face.
//!
//! ```
//! use partprobe_shape::{Mesh, solid_mesh, weld};
//!
//! // A tetrahedron with three edges of length 1 at a right angle. Each face has vertices of its own.
//! let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
//! let mesh = Mesh {
//!     vertices: faces.iter().flatten().map(|&corner: &usize| corners[corner]).collect(),
//!     vertex_face: (0..4).flat_map(|face| [face; 3]).collect(),
//!     triangles: (0..4).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect(),
//!     tri_face: (0..4).collect(),
//!     vertex_normal: Vec::new(),
//! };
//!
//! let welded = weld(&mesh);
//! assert_eq!(welded.vertices.len(), 4);
//!
//! let solid = solid_mesh(&mesh, &welded, |_face| true);
//! assert!(solid.watertight);
//! assert!((solid.volume - 1.0 / 6.0).abs() < 1e-15);
//! ```
//!
//! # What it guarantees
//!
//! - Lengths are millimeters, areas square millimeters, and angles degrees, unless a name says otherwise.
//! - Faces are in the order of the file's shells.
//! - The same values give the same bits on every machine.
//! - The only dependency is `thiserror`.
//!
//! # What it does not do
//!
//! It does not read STEP, open a file, print, or draw random numbers.

mod face;
mod face_graph;
mod face_type;
mod mesh;
mod smooth_normals;
mod surface_attributes;
mod units;
mod vector;
mod weld;

pub use face::{Color, Face, Instance};
pub use face_graph::{Edge, FaceGraph, SameTypePair};
pub use face_type::{FaceType, UnknownFaceType};
pub use mesh::Mesh;
pub use smooth_normals::smooth_normals;
pub use surface_attributes::SurfaceAttributes;
pub use units::Units;
pub use vector::{
    Point, bounding_box, bounding_diagonal, centroid, cross, distance, dot, norm,
    rotation_of_quaternion, subtract, triangle_area, unit_normal,
};
pub use weld::{SolidMesh, WeldedMesh, border_sides, solid_mesh, weld};
