//! Defines how a source reads files that it does not open itself.
//!
//! A source with imported labels needs bytes. The program gives it a [`SourceFiles`], so that this crate and those on
//! top of it stay free of file systems, and a test gives it a map of texts.

use std::fmt::Debug;

/// Reads files and lists folders on behalf of a source.
pub trait SourceFiles: Debug + Send + Sync {
    /// What a path leads to.
    fn kind(&self, path: &str) -> PathKind;

    /// The bytes of a file.
    ///
    /// # Errors
    /// If the file cannot be read; the message names it.
    fn read(&self, path: &str) -> Result<Vec<u8>, FileError>;

    /// The files below a folder, as paths relative to it with `/` between names, sorted.
    ///
    /// # Errors
    /// If the folder cannot be listed; the message names it.
    fn list(&self, folder: &str) -> Result<Vec<String>, FileError>;
}

/// What a path leads to.
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
