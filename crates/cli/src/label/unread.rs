//! Warns on stderr about files that are not read, for verbs that write no index.

use super::reason_counts::ReasonCounts;
use crate::counted::counted;
use crate::stderr;
use partprobe_dataset::IndexEntry;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The number of reasons that are shown.
const MAX_REASONS: usize = 10;

/// Prints one line per path that was given more than once, up to a limit.
pub(crate) fn warn_of_repeated(repeated: &[PathBuf]) {
    let mut counts: BTreeMap<&Path, usize> = BTreeMap::new();
    for path in repeated {
        *counts.entry(path).or_insert(1) += 1;
    }
    for (path, n) in counts.iter().take(MAX_REASONS) {
        stderr::print_line(format_args!(
            "warning: {} is given {n} times and is read once",
            path.display()
        ));
    }
    if counts.len() > MAX_REASONS {
        let more = counted(
            counts.len() - MAX_REASONS,
            "other file is",
            "other files are",
        );
        stderr::print_line(format_args!("warning: and {more} given more than once"));
    }
}

/// Prints one line per reason why a file is not read.
pub(crate) fn warn_of_unread<'a>(entries: impl Iterator<Item = &'a IndexEntry>) {
    let mut counts = ReasonCounts::default();
    for entry in entries {
        counts.add(
            entry.status,
            entry.reason.as_deref().unwrap_or_default(),
            entry.n_skipped.unwrap_or(1),
            &entry.source,
        );
    }
    let rows = counts.ranked();
    for row in rows.iter().take(MAX_REASONS) {
        stderr::print_line(format_args!(
            "{} {}: {} (first {})",
            row.kind.name(),
            row.n,
            row.reason,
            row.first
        ));
    }
    if rows.len() > MAX_REASONS {
        let more = counted(rows.len() - MAX_REASONS, "other reason", "other reasons");
        stderr::print_line(format_args!("and {more}; `label` lists them all"));
    }
}
