//! Defines what the threads of a batch share: the journal, the bar, and the line of a file that was never labeled.

use crate::clock::unix_seconds;
use anyhow::Result;
use indicatif::ProgressBar;
use partprobe_dataset::{FileRecord, IndexEntry, Journal};
use std::sync::{Mutex, PoisonError};

/// The journal behind a lock, with the bar that follows it.
pub(super) struct Recorder {
    journal: Mutex<Journal>,
    bar: ProgressBar,
}

impl Recorder {
    pub(super) fn new(journal: Journal, bar: ProgressBar) -> Self {
        bar.set_position(journal.n_files() as u64);
        Self {
            journal: Mutex::new(journal),
            bar,
        }
    }

    /// Whether a file is done already.
    pub(super) fn has(&self, source: &str) -> bool {
        self.journal
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .has(source)
    }

    /// Notes that a file is done.
    pub(super) fn record(&self, record: FileRecord) -> Result<()> {
        let mut journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        journal.record(record)?;
        self.bar.set_position(journal.n_files() as u64);
        Ok(())
    }

    /// Notes a file that no worker will see.
    pub(super) fn record_without_worker(&self, entry: IndexEntry) -> Result<()> {
        let (source, position) = (entry.source.clone(), entry.member.unwrap_or(0));
        let (written, seconds, ended) = (Vec::new(), None, unix_seconds());
        self.record(FileRecord {
            source,
            position,
            entries: vec![entry],
            written,
            seconds,
            ended,
        })
    }

    /// The journal, once all threads have ended.
    pub(super) fn into_journal(self) -> Journal {
        self.bar.finish_and_clear();
        self.journal
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
    }
}
