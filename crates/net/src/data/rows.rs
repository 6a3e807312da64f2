//! Defines lists of rows to gather.

use std::sync::Arc;

/// A list of rows to gather, in groups that belong together.
pub(crate) struct Rows {
    pub(crate) indices: Arc<[u32]>,
    pub(crate) group: usize,
}

impl Rows {
    /// Takes `indices` in groups of `group`.
    ///
    /// # Shapes
    /// - indices: `[n, group]`
    pub(crate) fn new(indices: &[u32], group: usize) -> Self {
        Self {
            indices: indices.into(),
            group,
        }
    }
}
