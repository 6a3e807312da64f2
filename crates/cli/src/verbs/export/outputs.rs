//! Names the files that a format writes.

/// The files that one format writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Outputs {
    /// The endings of its files, without the dot.
    pub(super) extensions: &'static [&'static str],
    /// The whole names of its files that are not covered by an ending.
    pub(super) file_names: &'static [&'static str],
}
