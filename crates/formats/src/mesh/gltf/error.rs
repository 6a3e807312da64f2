//! Defines the reasons why bytes are not a glTF file that partprobe reads.

use crate::mesh::foreign::MeshFileError;

/// The reason why bytes are not a glTF file that partprobe reads.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GltfError {
    /// The header of a binary file has another version.
    #[error("glTF version {0} is not read; export the file as glTF 2.0")]
    Version(String),
    /// A chunk of a binary file is missing or cut off.
    #[error("the chunk at byte {0} is not whole; the file may be cut off")]
    Chunk(usize),
    /// The JSON is not a glTF document.
    #[error("not a glTF document: {0}")]
    Json(String),
    /// The file cannot be understood without this extension.
    #[error(
        "the extension {0} is not read; export the file without it, for example without compression"
    )]
    Extension(String),
    /// The element with this index does not exist.
    #[error("{what} {index} does not exist")]
    Missing {
        /// The kind of element, for example `node`.
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// A node has two parents, or is its own ancestor.
    #[error("node {0} is a child of two nodes, or of itself")]
    NotATree(usize),
    /// An accessor cannot be read.
    #[error("accessor {index} cannot be read: {reason}")]
    Accessor {
        /// Its index.
        index: usize,
        /// A description of the problem.
        reason: &'static str,
    },
    /// A buffer cannot be read.
    #[error("buffer {index} cannot be read: {reason}")]
    Buffer {
        /// Its index.
        index: usize,
        /// A description of the problem.
        reason: String,
    },
    /// A primitive is not valid according to the specification.
    #[error("mesh {mesh}: {reason}")]
    Primitive {
        /// The index of the mesh.
        mesh: usize,
        /// A description of the problem.
        reason: &'static str,
    },
    /// The scene is larger than this reader accepts.
    #[error("the scene has more than {0} vertices or triangles; export one shape per file")]
    TooLarge(usize),
    /// The surface itself is damaged, or there is none.
    #[error("{0}")]
    Mesh(#[from] MeshFileError),
}
