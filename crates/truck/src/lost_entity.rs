//! Names entities of a file that truck does not give, and the reasons.

use std::fmt;

/// The kind of a lost entity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DroppedKind {
    /// A shell with all of its faces.
    Shell,
    /// A face, or its triangles.
    Face,
    /// A loop of a face that was read without it.
    Loop,
}

/// An entity that the file contains and truck does not give.
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
