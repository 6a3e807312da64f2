//! Defines an entity of a file that truck drops, and the reason.

use std::fmt;

/// The kind of a dropped entity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DroppedKind {
    /// A shell with all of its faces.
    Shell,
    /// A face, or only its triangles.
    Face,
    /// A loop of a face. The face was read without this loop.
    Loop,
}

/// An entity that is in the file, but not in truck's result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DroppedEntity {
    /// Its kind.
    pub kind: DroppedKind,
    /// `#` number of the shell or face.
    pub step_id: u64,
    /// The reason.
    pub reason: String,
}

impl fmt::Display for DroppedEntity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            DroppedKind::Shell => "shell",
            DroppedKind::Face => "face",
            DroppedKind::Loop => "loop of face",
        };
        write!(f, "{kind} #{}: {}", self.step_id, self.reason)
    }
}
