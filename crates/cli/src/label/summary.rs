//! Summarizes a batch.

use super::reason_counts::ReasonCounts;
use crate::counted::counted;
use anyhow::{Result, ensure};
use partprobe_dataset::{INDEX_FILE, IndexEntry, Status};
use std::fmt;
use std::path::Path;

/// The largest number of reasons. Further reasons are counted together.
const MAX_REASONS: usize = 20;

/// Files, shapes, parts, and failures by reason. `label` prints its text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Summary {
    /// Files that were given.
    pub(crate) n_files: usize,
    /// Shapes that were labeled.
    pub(crate) n_labeled: usize,
    /// Solids that are equal to a labeled one of their file.
    pub(crate) n_equal_solids: usize,
    /// Parts, by the predicate alone.
    pub(crate) n_parts: usize,
    /// Parts after small ones were absorbed.
    pub(crate) n_labels: usize,
    /// Faces of the carriers.
    pub(crate) n_faces: usize,
    /// Faces, loops and entities that were lost in labeled files.
    pub(crate) n_lost: usize,
    /// Files, or solids of labeled files, without a carrier, by status and reason.
    pub(crate) failures: ReasonCounts<Status>,
    /// Files that are not read because they are neither STEP nor archives, by reason.
    pub(crate) skipped: ReasonCounts<Status>,
}

impl Summary {
    /// Adds up the lines of an index.
    #[must_use]
    pub(crate) fn of(entries: &[IndexEntry]) -> Self {
        let mut summary = Self::default();
        entries
            .chunk_by(|a, b| a.source == b.source && b.member.is_none())
            .for_each(|file| summary.add(file));
        summary
    }

    /// Adds the lines of one file.
    pub(crate) fn add(&mut self, entries: &[IndexEntry]) {
        self.n_files += usize::from(entries.iter().any(|entry| entry.status != Status::Skipped));
        for entry in entries {
            self.n_labeled += usize::from(entry.status == Status::Ok);
            self.n_equal_solids += entry.n_equal_solids;
            self.n_parts += entry.n_parts;
            self.n_labels += entry.n_labels;
            self.n_faces += entry.n_faces;
            self.n_lost += entry.lost.len();
            if let Some(reason) = &entry.reason {
                let counts = if entry.status == Status::Skipped {
                    &mut self.skipped
                } else {
                    &mut self.failures
                };
                counts.add(
                    entry.status,
                    reason,
                    entry.n_skipped.unwrap_or(1),
                    &entry.source,
                );
            }
        }
    }

    /// Files, or solids of labeled files, without a carrier.
    #[must_use]
    pub(crate) fn n_failed(&self) -> u64 {
        self.failures.total()
    }
}

impl Summary {
    /// Refuses a finished batch in which no file has a shape; the folder has its index.
    ///
    /// # Errors
    /// If nothing was labeled.
    pub(crate) fn ensure_labeled(&self, folder: &Path) -> Result<()> {
        ensure!(
            self.n_files > 0,
            "there is no file to label: the folders and archives that were given are empty"
        );
        ensure!(
            self.n_labeled > 0,
            "no file could be labeled; {} says why",
            folder.join(INDEX_FILE).display()
        );
        Ok(())
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "files: {}", self.n_files)?;
        writeln!(f, "without a carrier: {}", self.n_failed())?;
        let failures = self.failures.ranked();
        for row in failures.iter().take(MAX_REASONS) {
            writeln!(f, "  {} {}: {}", row.n, row.kind.name(), row.reason)?;
        }
        if failures.len() > MAX_REASONS {
            let more = counted(
                failures.len() - MAX_REASONS,
                "other reason",
                "other reasons",
            );
            writeln!(f, "  and {more}, see index.jsonl")?;
        }
        let skipped = self.skipped.ranked();
        if !skipped.is_empty() {
            writeln!(f, "skipped: {}", self.skipped.total())?;
        }
        for row in skipped.iter().take(MAX_REASONS) {
            writeln!(f, "  {}: {}", row.n, row.reason)?;
        }
        if skipped.len() > MAX_REASONS {
            let more = counted(skipped.len() - MAX_REASONS, "other reason", "other reasons");
            writeln!(f, "  and {more}, see index.jsonl")?;
        }
        writeln!(
            f,
            "shapes: {} labeled, {} counted but not labeled again",
            self.n_labeled,
            counted(self.n_equal_solids, "equal solid", "equal solids")
        )?;
        let lost = counted(
            self.n_lost,
            "face, loop or entity",
            "faces, loops or entities",
        );
        writeln!(f, "faces: {} ({lost} lost)", self.n_faces)?;
        write!(
            f,
            "parts: {} ({} after small ones were absorbed)",
            self.n_parts, self.n_labels
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_are_counted_by_reason() {
        let failed = |id: &str, reason: &str| {
            IndexEntry::without_carrier(id, id, Status::Failed, reason.to_owned())
        };
        let good = IndexEntry {
            reason: None,
            status: Status::Ok,
            file: Some("c.npz".to_owned()),
            n_parts: 7,
            ..failed("c", "")
        };
        let summary = Summary::of(&[
            failed("a", "#12 is empty"),
            failed("b", "#3 is empty"),
            good,
        ]);
        assert_eq!(
            (summary.n_labeled, summary.n_failed(), summary.n_parts),
            (1, 2, 7)
        );
        assert!(
            summary.to_string().contains("  2 failed: #… is empty\n"),
            "{summary}"
        );
        assert!(!summary.to_string().contains("skipped"), "{summary}");
        let line = IndexEntry {
            status: Status::Skipped,
            n_skipped: Some(5),
            ..failed("d/*.txt", "not read")
        };
        let summary = Summary::of(&[failed("a", "empty"), line]);
        assert_eq!((summary.n_files, summary.n_failed()), (1, 1));
        assert!(
            summary.to_string().contains("skipped: 5\n  5: not read\n"),
            "{summary}"
        );
    }
}
