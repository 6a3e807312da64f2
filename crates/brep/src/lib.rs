//! Reads STEP files (ISO 10303-21) into boundary representations, and makes triangle meshes of them.
//!
//! [`read()`] turns a text into a [`Brep`]: solids, shells, faces, loops, edges and vertices, with exact surfaces and curves.
//! [`tessellate`] turns a B-Rep into a [`Mesh`] in which each triangle records its face, and a [`FaceGraph`]: areas of faces, and
//! dihedral angles and lengths of shared edges.
//!
//! ```
//! use partprobe_brep::geometry::Surface;
//! use partprobe_brep::{ReadBudget, TessellationOptions, read, tessellate};
//! # let part = partprobe_synth::part(&partprobe_synth::SynthSettings { seed: 1, min_parts: 4, max_parts: 9 }, 0);
//! # let text = part.step.as_bytes();
//!
//! let brep = read(text, &ReadBudget::default())?;
//! for face in &brep.faces {
//!     if let Surface::Cylinder { frame, radius } = &*face.surface {
//!         println!("#{}: radius {radius} mm about {:?}", face.step_id, frame.z);
//!     }
//! }
//!
//! let tessellation = tessellate(&brep, &TessellationOptions::default());
//! for edge in &tessellation.graph.edges {
//!     println!("faces {:?} meet at {:.1} degrees", edge.faces, edge.phi);
//! }
//! println!("{} triangles", tessellation.mesh.triangles.len());
//! for lost in &tessellation.lost {
//!     println!("lost: {lost}");
//! }
//! # assert_eq!(brep.faces.len(), part.n_faces as usize);
//! # assert!(!tessellation.mesh.triangles.is_empty());
//! # Ok::<(), partprobe_brep::ReadError>(())
//! ```
//!
//! # What it guarantees
//!
//! - Everything that cannot be read is named in the result: each lost face, loop and entity with its `#` number.
//! - Lengths are in millimeters and angles in radians, for any units of the file. Dihedral angles are in degrees.
//! - Neighboring faces meet in bit-equal points, so meshes of closed solids close.
//! - The same text gives the same bits on every machine: transcendental functions come from `libm`.
//! - No text makes it panic. A [`ReadBudget`] limits the work of reading, and [`TessellationOptions`] limits the mesh.
//!
//! # What it does not do
//!
//! It opens no file and prints nothing. It does not write or change models: there are no Boolean operations, fillets or offsets,
//! and solids that a file defines by such operations are named but not evaluated. It does not sew or repair. `partprobe-label`
//! labels the parts of a shape.
//!
//! # Modules
//!
//! [`geometry`] has the curves and surfaces, and [`part21`] reads the instances of any STEP text.

mod bounds;
mod canonical;
mod extract;
mod face_surfaces;
#[cfg(test)]
mod fixtures;
pub mod geometry;
mod graph;
mod instances;
mod mesh;
mod model;
mod motion;
pub mod part21;
mod read;
mod tessellation;

pub use partprobe_shape::{
    Color, Edge, Face, FaceGraph, FaceType, Instance, Mesh, Point, SurfaceAttributes, Units,
};

pub use extract::{Extract, ExtractError, Numbering, extract};
pub use face_surfaces::{FaceSurfaces, SurfacePoint};
pub use graph::{ShapeFlags, closed_solids, face_graph};
pub use instances::{first_instances, tessellate_instances};
pub use mesh::AttributeChoice;
pub use model::{
    Brep, BrepEdge, BrepFace, Component, EdgeUse, InstanceStyle, Loop, LostEntity, LostKind, Note,
    Shell, Solid, Vertex,
};
pub use read::{ReadBudget, ReadError, read};
pub use tessellation::{Tessellation, TessellationOptions, tessellate, tessellation_without_mesh};
