//! What the kernel is asked, and what it answers.

use partprobe_shape::{FaceGraph, Mesh};
use std::fmt;

/// What truck does not read by itself, and how finely it meshes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruckSettings {
    /// Millimeters in one length unit of the file.
    pub mm_per_unit: f64,
    /// Radians in one angle unit of the file.
    pub rad_per_unit: f64,
    /// Chord tolerance as a part of the diagonal; truck has no tolerance of angles.
    pub chord_fraction: f64,
}

/// What kind of thing was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LostKind {
    /// A shell with all of its faces.
    Shell,
    /// A face, or its triangles.
    Face,
    /// A loop of a face that was read without it.
    Loop,
}

/// Something that the file holds and truck does not give.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lost {
    /// What it is.
    pub kind: LostKind,
    /// `#` number of the shell or face.
    pub step_id: u64,
    /// Why it was lost.
    pub reason: String,
}

impl fmt::Display for Lost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            LostKind::Shell => "shell",
            LostKind::Face => "face",
            LostKind::Loop => "loop of face",
        };
        write!(f, "{kind} #{}: {}", self.step_id, self.reason)
    }
}

/// A file as truck understands it, in millimeters.
///
/// Every shell of the file is there once, where it was drawn: truck knows no assemblies. Shells come in the order of
/// their `#` numbers. Areas are those of the mesh, and no face knows its solid.
#[derive(Clone, Debug)]
pub struct TruckShape {
    /// Faces and the edges between them.
    pub graph: FaceGraph,
    /// The triangles.
    pub mesh: Mesh,
    /// What was lost.
    pub lost: Vec<Lost>,
    /// The chord tolerance that was used, in millimeters.
    pub chord_mm: f64,
    /// The diagonal of the box around the edges, in millimeters.
    pub diagonal_mm: f64,
}

/// Why there is no shape.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
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

/// Reads and meshes the text of one file.
///
/// # Errors
/// If the kernel is not built in, or truck finds no face in the text.
pub fn shape(text: &str, settings: &TruckSettings) -> Result<TruckShape, TruckError> {
    #[cfg(feature = "truck")]
    return crate::reading::shape_of(text, settings);
    #[cfg(not(feature = "truck"))]
    {
        let _ = (text, settings);
        Err(TruckError::NotBuilt)
    }
}

#[cfg(all(test, not(feature = "truck")))]
mod tests {
    use super::*;

    #[test]
    fn a_build_without_truck_says_so() {
        let settings = TruckSettings {
            mm_per_unit: 1.0,
            rad_per_unit: 1.0,
            chord_fraction: 0.002,
        };
        assert_eq!(
            shape("ISO-10303-21;", &settings).err(),
            Some(TruckError::NotBuilt)
        );
    }
}
