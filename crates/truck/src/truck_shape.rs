//! Defines the settings of the kernel, its result, and its errors.

use crate::dropped_entity::DroppedEntity;
use partprobe_shape::{FaceGraph, Mesh};

/// The units of the file, which truck does not read, and the fineness of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruckSettings {
    /// Millimeters in one length unit of the file.
    pub mm_per_unit: f64,
    /// Radians in one angle unit of the file.
    pub rad_per_unit: f64,
    /// Chord tolerance as a fraction of the diagonal. truck has no angular tolerance.
    pub chord_fraction: f64,
}

/// The content of a file as truck reads it, in millimeters.
///
/// Every shell of the file occurs once, in its own coordinate system, since truck does not read assemblies. Shells are in the
/// order of their `#` numbers. Areas are measured on the mesh. Faces do not say which solid they belong to.
#[derive(Clone, Debug)]
pub struct TruckShape {
    /// Faces and the edges between them.
    pub graph: FaceGraph,
    /// The triangles.
    pub mesh: Mesh,
    /// The entities that truck drops.
    pub lost: Vec<DroppedEntity>,
    /// The chord tolerance that was used, in millimeters.
    pub chord_mm: f64,
    /// The diagonal of the bounding box of the edges, in millimeters.
    pub diagonal_mm: f64,
}

/// The reason why a text has no shape.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TruckError {
    /// This build does not have the cargo feature `truck`.
    #[error(
        "this program was built without truck; build it with --features truck, or use --kernel own"
    )]
    NotBuilt,
    /// truck's parser refuses the text.
    #[error("truck cannot parse the text; use --kernel own")]
    Unreadable,
    /// truck panicked before any shell was read.
    #[error("truck panicked while it read the text; use --kernel own")]
    Panicked,
    /// The text has no shell with a face that truck can convert.
    #[error("truck finds no face in the file; use --kernel own")]
    NoFace,
}
