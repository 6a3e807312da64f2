//! Says what a shape was read from.

use std::fmt;

/// What a shape was read from, and so what its carrier can tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ShapeKind {
    /// A B-Rep: faces with types, edges with angles, and a mesh of them.
    #[default]
    Brep,
    /// A mesh alone. A face is a set of triangles that came with the same label.
    Mesh,
    /// A point cloud. A face is a set of points that came with the same label.
    Cloud,
}

impl ShapeKind {
    /// The name in files: `brep`, `mesh` or `cloud`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Brep => "brep",
            Self::Mesh => "mesh",
            Self::Cloud => "cloud",
        }
    }
}

impl fmt::Display for ShapeKind {
    /// In words, with an article.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Brep => "a B-Rep",
            Self::Mesh => "a mesh without a B-Rep",
            Self::Cloud => "a point cloud",
        })
    }
}
