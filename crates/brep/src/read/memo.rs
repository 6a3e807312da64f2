//! Remembers results by the instance from which they were read.

/// The index of each instance that was read for a root, so that an instance shared by two faces is read once.
///
/// Instances are known only for the root for which they were read, because another root may have another position.
pub(super) struct Memo {
    /// Root (counted from 1) and index of each instance.
    entries: Vec<(u32, u32)>,
}

impl Memo {
    /// A memo for `n_records` instances. None of them is known yet.
    pub(super) fn new(n_records: usize) -> Self {
        Self {
            entries: vec![(0, 0); n_records],
        }
    }

    /// The index of the instance at this slot, if the root has read it.
    pub(super) fn index(&self, root: u32, slot: usize) -> Option<u32> {
        self.entries
            .get(slot)
            .filter(|entry| entry.0 == root)
            .map(|entry| entry.1)
    }

    /// Remembers the index of the instance at this slot.
    pub(super) fn remember(&mut self, root: u32, slot: usize, index: u32) {
        if let Some(entry) = self.entries.get_mut(slot) {
            *entry = (root, index);
        }
    }
}
