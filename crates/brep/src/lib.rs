//! Reads STEP files (ISO 10303-21) into boundary representations, and makes triangle meshes of them.
//!
//! ```
//! use partprobe_brep::geometry::Surface;
//! use partprobe_brep::{ReadBudget, read};
//!
//! let part = partprobe_synth::part(&partprobe_synth::SynthSettings { seed: 1, min_parts: 4, max_parts: 9 }, 0);
//! let brep = read(part.step.as_bytes(), &ReadBudget::default())?;
//! for face in &brep.faces {
//!     if let Surface::Cylinder { frame, radius } = &*face.surface {
//!         println!("#{}: radius {radius} mm about {:?}", face.step_id, frame.z);
//!     }
//! }
//! # assert_eq!(brep.faces.len(), part.n_faces as usize);
//! # Ok::<(), partprobe_brep::ReadError>(())
//! ```
//!
//! # What it guarantees
//!
//! - What cannot be read is part of the answer: each lost face, loop and entity is named with its `#` number.
//! - Lengths are in millimeters and angles in radians, whatever the units of the file.
//! - The same text gives the same bits on every machine: transcendental functions come from `libm`.
//! - No text makes it panic, and a [`ReadBudget`] bounds what a text may cost.
//!
//! # What it does not do
//!
//! It opens no file, prints nothing, and does not write or change models: there are no Boolean operations, fillets or
//! offsets. Labels of parts are the business of `partprobe-label`.

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
mod part21;
mod read;
mod tessellation;

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
