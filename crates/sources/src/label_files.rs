//! Defines how a source reads files that it does not open itself.
//!
//! A source with imported labels needs bytes. The program gives it a [`SourceFiles`], so this crate and the crates that use it do
//! not depend on a file system. A test gives it a map of texts.

use std::fmt::Debug;

/// Reads files and lists folders on behalf of a source.
pub trait SourceFiles: Debug + Send + Sync {
    /// The kind of item at a path.
    fn kind(&self, path: &str) -> PathKind;

    /// The bytes of a file.
    ///
    /// # Errors
    /// If the file cannot be read. The message names it.
    fn read(&self, path: &str) -> Result<Vec<u8>, FileError>;

    /// The files below a folder, as paths relative to it with `/` between names, sorted.
    ///
    /// # Errors
    /// If the folder cannot be listed. The message names it.
    fn list(&self, folder: &str) -> Result<Vec<String>, FileError>;
}

/// The kind of item at a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathKind {
    /// A file.
    File,
    /// A folder.
    Folder,
    /// Nothing that can be read.
    Missing,
}

/// A file or folder that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {reason}")]
pub struct FileError {
    /// The path.
    pub path: String,
    /// Why it cannot be read.
    pub reason: String,
}
