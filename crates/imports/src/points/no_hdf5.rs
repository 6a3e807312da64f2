//! Refuses HDF5 files in a program that was built without the crate that reads them.

use std::convert::Infallible;
use std::ops::Range;

/// An HDF5 file. It cannot exist in this program.
#[derive(Debug)]
pub(super) struct Hdf5File(Infallible);

/// The reason why an HDF5 file cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Hdf5Error {
    /// The program cannot read HDF5 files.
    #[error(
        "this program was built without the feature `hdf5`; build it with `--features hdf5`, or save the arrays as .npy"
    )]
    NotBuilt,
}

impl Hdf5File {
    /// Refuses the file.
    ///
    /// # Errors
    /// Always.
    pub(super) fn open(_bytes: Vec<u8>) -> Result<Self, Hdf5Error> {
        Err(Hdf5Error::NotBuilt)
    }

    pub(super) fn names(&self) -> Result<Vec<String>, Hdf5Error> {
        match self.0 {}
    }

    pub(super) fn shape(&self, _name: &str) -> Result<Vec<u64>, Hdf5Error> {
        match self.0 {}
    }

    pub(super) fn rows(&self, _name: &str, _rows: Range<u64>) -> Result<Vec<f64>, Hdf5Error> {
        match self.0 {}
    }
}
