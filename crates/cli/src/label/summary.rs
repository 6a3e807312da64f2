//! What a batch came to.

use crate::dataset::{IndexEntry, Status};
use std::collections::BTreeMap;
use std::fmt;

/// Reasons beyond these are counted together.
const MAX_REASONS: usize = 20;

/// Files, shapes, parts, and failures by reason; its text is what `label` prints.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Files that were given.
    pub n_files: usize,
    /// Shapes that were labelled.
    pub n_labelled: usize,
    /// Solids that are equal to a labelled one of their file.
    pub n_equal_solids: usize,
    /// Parts, by the predicate alone.
    pub n_parts: usize,
    /// Parts after small ones were absorbed.
    pub n_labels: usize,
    /// Faces of the carriers.
    pub n_faces: usize,
    /// Faces, loops and entities that were lost in labelled files.
    pub n_lost: usize,
    /// Files, or solids of labelled files, without a carrier, by what became of them and why.
    pub failures: BTreeMap<(Status, String), usize>,
}

impl Summary {
    /// Adds up the lines of an index.
    #[must_use]
    pub fn of(entries: &[IndexEntry]) -> Self {
        let mut summary = Self::default();
        entries.chunk_by(|a, b| a.source == b.source && b.member.is_none()).for_each(|file| summary.add(file));
        summary
    }

    /// Adds the lines of one file.
    pub fn add(&mut self, entries: &[IndexEntry]) {
        self.n_files += 1;
        for entry in entries {
            self.n_labelled += usize::from(entry.status == Status::Ok);
            self.n_equal_solids += entry.n_equal_solids;
            self.n_parts += entry.n_parts;
            self.n_labels += entry.n_labels;
            self.n_faces += entry.n_faces;
            self.n_lost += entry.lost.len();
            if let Some(reason) = &entry.reason {
                *self.failures.entry((entry.status, folded(reason))).or_default() += 1;
            }
        }
    }

    /// Files, or solids of labelled files, without a carrier.
    #[must_use]
    pub fn n_failed(&self) -> usize {
        self.failures.values().sum()
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "files: {}", self.n_files)?;
        writeln!(f, "without a carrier: {}", self.n_failed())?;
        let mut failures: Vec<_> = self.failures.iter().collect();
        failures.sort_by_key(|&(reason, count)| (std::cmp::Reverse(count), reason));
        for ((status, reason), count) in failures.iter().take(MAX_REASONS) {
            writeln!(f, "  {count} {}: {reason}", status.name())?;
        }
        if failures.len() > MAX_REASONS {
            writeln!(f, "  and {} other reasons, see index.jsonl", failures.len() - MAX_REASONS)?;
        }
        writeln!(
            f,
            "shapes: {} labelled, {} equal solids counted but not labelled again",
            self.n_labelled, self.n_equal_solids
        )?;
        writeln!(f, "faces: {} ({} faces, loops or entities lost)", self.n_faces, self.n_lost)?;
        write!(f, "parts: {} ({} after small ones were absorbed)", self.n_parts, self.n_labels)
    }
}

/// The reason with its numbers taken out, so that the same thing in two files counts as the same.
#[must_use]
pub fn folded(reason: &str) -> String {
    let mut folded = String::with_capacity(reason.len());
    for c in reason.chars() {
        if !c.is_ascii_digit() {
            folded.push(c);
        } else if !folded.ends_with('…') {
            folded.push('…');
        }
    }
    folded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_are_counted_by_reason() {
        let failed = |id: &str, reason: &str| IndexEntry::without_carrier(id, id, Status::Failed, reason.to_owned());
        let good = IndexEntry {
            reason: None,
            status: Status::Ok,
            file: Some("c.npz".to_owned()),
            n_parts: 7,
            ..failed("c", "")
        };
        let summary = Summary::of(&[failed("a", "#12 is empty"), failed("b", "#3 is empty"), good]);
        assert_eq!((summary.n_labelled, summary.n_failed(), summary.n_parts), (1, 2, 7));
        assert!(summary.to_string().contains("  2 failed: #… is empty\n"), "{summary}");
    }
}
