//! STEP Part 21 text to B-Rep, face graph and mesh: `text → Brep → Shape { FaceGraph, Mesh }`.
//!
//! Nothing here opens a file, prints, asks the clock or knows about labels and networks.
//! What cannot be read is part of the answer: every lost face, loop and entity is named with its `#` number.
//! Transcendental functions come from `libm`, so that any machine gives the same bits.

mod bounds;
mod canonical;
mod extract;
mod face_surfaces;
#[cfg(test)]
mod fixtures;
mod geometry;
mod graph;
mod instances;
mod mesh;
mod model;
mod part21;
mod read;
mod shape;

pub use extract::{Extract, ExtractError, Numbering, extract};
pub use face_surfaces::{FaceSurfaces, SurfacePoint};
pub use graph::{ShapeFlags, closed_solids, face_graph};
pub use instances::{first_instances, shape_of_instances};
pub use model::{
    Brep, BrepFace, Component, EdgeUse, InstanceStyle, Loop, Loss, LossKind, Note, Shell, Solid, TopoEdge, Vertex,
};
pub use read::{ReadBudget, ReadError, read};
pub use shape::{AttributeChoice, Shape, ShapeOptions, shape, shape_without_mesh};
