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
    /// Carriers that were written.
    pub n_carriers: usize,
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
    pub fn of(entries: &[IndexEntry], n_files: usize) -> Self {
        let mut summary = Self { n_files, ..Self::default() };
        for entry in entries {
            summary.n_carriers += usize::from(entry.file.is_some());
            summary.n_equal_solids += entry.n_equal_solids;
            summary.n_parts += entry.n_parts;
            summary.n_labels += entry.n_labels;
            summary.n_faces += entry.n_faces;
            summary.n_lost += entry.lost.len();
            if let Some(reason) = &entry.reason {
                *summary.failures.entry((entry.status, reason.clone())).or_default() += 1;
            }
        }
        summary
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
            writeln!(f, "  {count} {}: {reason}", name_of(*status))?;
        }
        if failures.len() > MAX_REASONS {
            writeln!(f, "  and {} other reasons, see index.jsonl", failures.len() - MAX_REASONS)?;
        }
        writeln!(
            f,
            "shapes: {} carriers, {} equal solids counted but not labelled again",
            self.n_carriers, self.n_equal_solids
        )?;
        writeln!(f, "faces: {} ({} faces, loops or entities lost)", self.n_faces, self.n_lost)?;
        write!(f, "parts: {} ({} after small ones were absorbed)", self.n_parts, self.n_labels)
    }
}

fn name_of(status: Status) -> &'static str {
    match status {
        Status::Ok => "labelled",
        Status::Failed => "failed",
        Status::Crashed => "crashed",
        Status::TimedOut => "timed out",
    }
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
        let summary = Summary::of(&[failed("a", "the file is empty"), failed("b", "the file is empty"), good], 3);
        assert_eq!((summary.n_carriers, summary.n_failed(), summary.n_parts), (1, 2, 7));
        assert!(summary.to_string().contains("  2 failed: the file is empty\n"), "{summary}");
    }
}
