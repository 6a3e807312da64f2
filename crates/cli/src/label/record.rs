//! Defines the data that the threads of a batch share: the writer of the data set, the bar, and the line of a file that was never
//! labeled.

use crate::clock::unix_seconds;
use anyhow::Result;
use indicatif::ProgressBar;
use partprobe_dataset::{DatasetWriter, FileRecord, IndexEntry};
use std::sync::{Mutex, PoisonError};

/// The writer of the data set with a lock, and the progress bar.
pub(super) struct Recorder {
    writer: Mutex<DatasetWriter>,
    bar: ProgressBar,
}

impl Recorder {
    pub(super) fn new(writer: DatasetWriter, bar: ProgressBar) -> Self {
        bar.set_position(writer.journal().n_files() as u64);
        Self {
            writer: Mutex::new(writer),
            bar,
        }
    }

    /// Whether a file is already done.
    pub(super) fn has(&self, source: &str) -> bool {
        self.writer
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .journal()
            .has(source)
    }

    /// Records that a file is done.
    pub(super) fn record(&self, record: FileRecord) -> Result<()> {
        let mut writer = self.writer.lock().unwrap_or_else(PoisonError::into_inner);
        writer.record(record)?;
        self.bar.set_position(writer.journal().n_files() as u64);
        Ok(())
    }

    /// Records a file that no worker gets.
    pub(super) fn record_without_worker(&self, entry: IndexEntry) -> Result<()> {
        self.record(FileRecord {
            source: entry.source.clone(),
            position: entry.member.unwrap_or(0),
            entries: vec![entry],
            written: Vec::new(),
            seconds: None,
            ended: unix_seconds(),
        })
    }

    /// The writer, once all threads have ended.
    pub(super) fn into_writer(self) -> DatasetWriter {
        self.bar.finish_and_clear();
        self.writer
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
    }
}
