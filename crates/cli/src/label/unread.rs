//! What is said on stderr of files that are not read, by verbs that write no index.

use super::reason_counts::ReasonCounts;
use crate::dataset::IndexEntry;
use crate::stderr;

/// So many reasons are shown.
const MAX_REASONS: usize = 10;

/// Prints a line for each reason why a file is not read.
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
        stderr::print_line(format_args!("{} {}: {} (first {})", row.kind.name(), row.n, row.reason, row.first));
    }
    if rows.len() > MAX_REASONS {
        stderr::print_line(format_args!("and {} other reasons; `label` lists them all", rows.len() - MAX_REASONS));
    }
}
