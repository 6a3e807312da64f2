//! Defines the settings of the kernel, its result, and its errors.

use crate::lost_entity::DroppedEntity;
use partprobe_shape::{FaceGraph, Mesh};

/// The units of the file, which truck does not read, and the fineness of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruckSettings {
    /// Millimeters in one length unit of the file.
    pub mm_per_unit: f64,
    /// Radians in one angle unit of the file.
    pub rad_per_unit: f64,
    /// Chord tolerance as a fraction of the diagonal; truck has no tolerance of angles.
    pub chord_fraction: f64,
}

/// A file as truck understands it, in millimeters.
///
/// Every shell of the file is there once, where it was drawn, since truck does not read assemblies. Shells are in the
/// order of their `#` numbers. Areas are those of the mesh, and faces do not name their solid.
#[derive(Clone, Debug)]
pub struct TruckShape {
    /// Faces and the edges between them.
    pub graph: FaceGraph,
    /// The triangles.
    pub mesh: Mesh,
    /// The entities that truck does not give.
    pub lost: Vec<DroppedEntity>,
    /// The chord tolerance that was used, in millimeters.
    pub chord_mm: f64,
    /// The diagonal of the box around the edges, in millimeters.
    pub diagonal_mm: f64,
}

/// Why there is no shape.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TruckError {
    /// The feature is off.
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
    /// No shell, or none with a face.
    #[error("truck finds no face in the file; use --kernel own")]
    NoFace,
}
