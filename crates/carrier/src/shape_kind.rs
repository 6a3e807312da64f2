//! Defines the kinds of data from which a shape is read.

use std::fmt;

/// The kind of data from which a shape was read. It decides which data its carrier has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ShapeKind {
    /// A B-Rep: faces with types, edges with angles, and a mesh of them.
    #[default]
    Brep,
    /// A mesh without a B-Rep. A face is a set of triangles with the same given label.
    Mesh,
    /// A point cloud. A face is a set of points with the same given label.
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
    /// Writes the kind in words, with an article.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Brep => "a B-Rep",
            Self::Mesh => "a mesh without a B-Rep",
            Self::Cloud => "a point cloud",
        })
    }
}
