//! Keeps the journal of an unfinished batch. A file gets a line as soon as its results are on disk.
//!
//! An incomplete last line is dropped, so everything that the journal lists is done, even if the program was killed. When the
//! batch ends, the index is made from the journal, in the order of the inputs, and the journal is deleted.

use crate::{
    IndexEntry, OutputError, Status, is_locked_elsewhere, json_lines, write_atomically_with,
};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The journal's name in the folder of its data set.
pub const JOURNAL_FILE: &str = ".unfinished.jsonl";
/// A power cut loses the results of at most this number of seconds. A killed program loses none.
const SYNC_EVERY_S: f64 = 5.0;

/// The reason why a journal cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// Another program writes to the journal in this folder.
    #[error("another partprobe is labeling into {}", .0.display())]
    InUse(PathBuf),
    /// The file cannot be opened, written or removed.
    #[error("{doing} {}", path.display())]
    File {
        /// What was done with it, for example `opening`.
        doing: &'static str,
        /// The journal.
        path: PathBuf,
        /// Why it failed.
        source: io::Error,
    },
    /// The lines cannot be read.
    #[error("reading the journal")]
    Read(#[source] io::Error),
    /// The incomplete end cannot be cut off.
    #[error("cutting off the journal's torn end")]
    Cut(#[source] io::Error),
    /// A line has changed since it was written.
    #[error("the journal changed meanwhile")]
    Changed(#[source] serde_json::Error),
    /// A line cannot be written as JSON.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
}

/// One line of the journal.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(tag = "line", rename_all = "kebab-case")]
pub enum JournalLine {
    /// The batch was started, or resumed.
    Session {
        /// Seconds since 1970.
        started: f64,
        /// The total number of files, as far as they can be counted beforehand.
        n_files: u64,
        /// Whether there may be more: a tar archive has no list of its files.
        has_more: bool,
    },
    /// A file is done, with or without success.
    File(FileRecord),
}

/// The result of one file.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct FileRecord {
    /// The file's name in the index.
    pub source: String,
    /// 0, or a number that distinguishes refused members with the same name.
    pub position: u64,
    /// The file's lines of the index.
    pub entries: Vec<IndexEntry>,
    /// The files that were written for it.
    pub written: Vec<WrittenFile>,
    /// Seconds in the worker, or `None` if it did not answer.
    pub seconds: Option<f64>,
    /// When it was done, in seconds since 1970.
    pub ended: f64,
}

/// A file of the data set.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub struct WrittenFile {
    /// Its path in the data set.
    pub file: String,
    /// Its size.
    pub bytes: u64,
}

/// The key of a record: its source and its position. Records are sorted by it.
#[derive(Clone, Debug, PartialEq, Eq)]
struct RecordKey {
    source: String,
    position: u64,
}

impl Ord for RecordKey {
    /// Sources are in the order of a walk through the folders.
    fn cmp(&self, other: &Self) -> Ordering {
        compare_paths(&self.source, &other.source).then(self.position.cmp(&other.position))
    }
}

impl PartialOrd for RecordKey {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The order of the index: component by component of the source's path.
#[must_use]
pub fn compare_paths(a: &str, b: &str) -> Ordering {
    a.split('/').cmp(b.split('/'))
}

/// The position of a line in the journal.
#[derive(Clone, Copy, Debug)]
struct Span {
    start: u64,
    len: usize,
}

/// An open journal. No other program writes to it.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    end: u64,
    records: BTreeMap<RecordKey, Span>,
    /// The number of records of files, without those about skipped files.
    n_files: usize,
    /// When lines were last forced to the disk, in seconds since 1970, by the times of the lines themselves.
    synced: Option<f64>,
}

impl Journal {
    /// Opens the journal in a folder, or makes a new one. A record counts if `is_whole` returns true. An incomplete end is cut
    /// off.
    ///
    /// # Errors
    /// If another program writes to it, or it cannot be read.
    pub fn open(
        folder: &Path,
        is_whole: impl Fn(&FileRecord) -> bool,
    ) -> Result<Self, JournalError> {
        let path = folder.join(JOURNAL_FILE);
        let opened = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path);
        let file = opened.map_err(|source| JournalError::File {
            doing: "opening",
            path: path.clone(),
            source,
        })?;
        if is_locked_elsewhere(&file) {
            return Err(JournalError::InUse(folder.to_owned()));
        }
        let mut journal = Self {
            path,
            file,
            end: 0,
            records: BTreeMap::new(),
            n_files: 0,
            synced: None,
        };
        journal.register(is_whole)?;
        journal
            .file
            .set_len(journal.end)
            .map_err(JournalError::Cut)?;
        Ok(journal)
    }

    fn register(&mut self, is_whole: impl Fn(&FileRecord) -> bool) -> Result<(), JournalError> {
        let Self {
            file,
            end,
            records,
            n_files,
            ..
        } = self;
        for_each_line(file, |line, start, len| {
            *end = start + len as u64;
            if let JournalLine::File(record) = line
                && is_whole(&record)
            {
                let is_new = records.insert(record.key(), Span { start, len }).is_none();
                *n_files += usize::from(is_new && !record.is_skipped());
            }
        })
    }

    /// Whether a file that was given to a worker is done.
    #[must_use]
    pub fn has(&self, source: &str) -> bool {
        self.records.contains_key(&RecordKey {
            source: source.to_owned(),
            position: 0,
        })
    }

    /// The number of files that are done. Skipped files do not count.
    #[must_use]
    pub fn n_files(&self) -> usize {
        self.n_files
    }

    /// Records that work begins, at a time in seconds since 1970.
    ///
    /// # Errors
    /// If the line cannot be written.
    pub fn begin_session(
        &mut self,
        started: f64,
        n_files: u64,
        has_more: bool,
    ) -> Result<(), JournalError> {
        let line = JournalLine::Session {
            started,
            n_files,
            has_more,
        };
        self.append(&line, started).map(|_| ())
    }

    /// Records that a file is done. Its results must already be on disk.
    ///
    /// # Errors
    /// If the line cannot be written.
    pub fn record(&mut self, record: FileRecord) -> Result<(), JournalError> {
        let key = record.key();
        let is_skipped = record.is_skipped();
        let ended = record.ended;

        let span = self.append(&JournalLine::File(record), ended)?;
        let is_new = self.records.insert(key, span).is_none();
        self.n_files += usize::from(is_new && !is_skipped);
        Ok(())
    }

    fn append(&mut self, line: &JournalLine, now: f64) -> Result<Span, JournalError> {
        let bytes = json_lines([line])?;
        let span = Span {
            start: self.end,
            len: bytes.len(),
        };
        self.file
            .seek(SeekFrom::Start(self.end))
            .and_then(|_| self.file.write_all(&bytes))
            .map_err(|source| self.file_error("writing", source))?;
        self.end += bytes.len() as u64;
        self.sync(now)?;
        Ok(span)
    }

    /// Forces the lines to the disk if the last time was long ago, or if the clock was set back.
    fn sync(&mut self, now: f64) -> Result<(), JournalError> {
        let since = now - *self.synced.get_or_insert(now);
        if !(0.0..SYNC_EVERY_S).contains(&since) {
            self.file
                .sync_data()
                .map_err(|source| self.file_error("writing", source))?;
            self.synced = Some(now);
        }
        Ok(())
    }

    fn file_error(&self, doing: &'static str, source: io::Error) -> JournalError {
        JournalError::File {
            doing,
            path: self.path.clone(),
            source,
        }
    }

    /// Visits the records in the order of the index.
    ///
    /// # Errors
    /// If a line cannot be read again, or the visitor fails.
    pub fn for_each_record<E: From<JournalError>>(
        &mut self,
        mut visit: impl FnMut(FileRecord) -> Result<(), E>,
    ) -> Result<(), E> {
        for span in self.records.values() {
            let mut line = vec![0; span.len];
            self.file
                .seek(SeekFrom::Start(span.start))
                .and_then(|_| self.file.read_exact(&mut line))
                .map_err(JournalError::Read)?;
            let line = serde_json::from_slice(&line).map_err(JournalError::Changed)?;
            if let JournalLine::File(record) = line {
                visit(record)?;
            }
        }
        Ok(())
    }

    /// Removes the journal, because the batch is finished.
    ///
    /// # Errors
    /// If the file cannot be removed.
    pub fn remove(self) -> Result<(), JournalError> {
        std::fs::remove_file(&self.path).map_err(|source| self.file_error("removing", source))
    }
}

impl FileRecord {
    fn key(&self) -> RecordKey {
        RecordKey {
            source: self.source.clone(),
            position: self.position,
        }
    }

    fn is_skipped(&self) -> bool {
        self.entries
            .iter()
            .all(|entry| entry.status == Status::Skipped)
    }
}

/// Whether a program is writing to the journal in this folder.
#[must_use]
pub fn is_being_written(folder: &Path) -> bool {
    let opened = File::open(folder.join(JOURNAL_FILE));
    opened.is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// Visits the complete lines of a journal, each with its offset and length. Text after an incomplete line is left out.
///
/// # Errors
/// If the file cannot be read.
pub fn for_each_line(
    file: &mut File,
    mut visit: impl FnMut(JournalLine, u64, usize),
) -> Result<(), JournalError> {
    file.seek(SeekFrom::Start(0)).map_err(JournalError::Read)?;
    let mut reader = BufReader::new(file);
    let (mut start, mut line) = (0, Vec::new());
    loop {
        line.clear();
        let len = reader
            .read_until(b'\n', &mut line)
            .map_err(JournalError::Read)?;
        let Some(text) = line.strip_suffix(b"\n") else {
            return Ok(());
        };
        let Ok(parsed) = serde_json::from_slice(text) else {
            return Ok(());
        };
        visit(parsed, start, len);
        start += len as u64;
    }
}

/// Replaces the journal by one with these records.
///
/// # Errors
/// If it cannot be written.
pub fn write_journal(
    folder: &Path,
    records: impl IntoIterator<Item = FileRecord>,
) -> Result<(), OutputError> {
    write_atomically_with(&folder.join(JOURNAL_FILE), |file| -> io::Result<()> {
        for record in records {
            file.write_all(&json_lines([JournalLine::File(record)])?)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(source: &str) -> FileRecord {
        let entry = IndexEntry::without_carrier("a", source, Status::Failed, "why".to_owned());
        let (written, seconds) = (Vec::new(), None);
        FileRecord {
            source: source.to_owned(),
            position: 0,
            entries: vec![entry],
            written,
            seconds,
            ended: 0.0,
        }
    }

    fn sources(journal: &mut Journal) -> Vec<String> {
        let mut sources = Vec::new();
        let noted = journal.for_each_record(|record| {
            sources.push(record.source);
            Ok::<_, JournalError>(())
        });
        noted.unwrap();
        sources
    }

    #[test]
    fn records_round_trip_in_order_and_a_truncated_end_is_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::open(folder.path(), |_| true).unwrap();
        journal.begin_session(0.0, 3, false).unwrap();
        for source in ["d/b/x", "d/b.step", "c", "d/a"] {
            journal.record(record(source)).unwrap();
        }
        assert!(matches!(
            Journal::open(folder.path(), |_| true),
            Err(JournalError::InUse(_))
        ));
        assert!(is_being_written(folder.path()));
        drop(journal);
        let path = folder.path().join(JOURNAL_FILE);
        let whole = std::fs::read(&path).unwrap();
        for cut in [whole.len(), whole.len() - 1, whole.len() - 40] {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let mut journal = Journal::open(folder.path(), |record| record.source != "c").unwrap();
            assert!(!journal.has("c"));
            let expected = if cut == whole.len() {
                vec!["d/a", "d/b/x", "d/b.step"]
            } else {
                vec!["d/b/x", "d/b.step"]
            };
            assert_eq!(sources(&mut journal), expected);
            journal.record(record("d/b.step")).unwrap();
            assert_eq!(sources(&mut journal), expected);
        }
        Journal::open(folder.path(), |_| true)
            .unwrap()
            .remove()
            .unwrap();
        assert!(!is_being_written(folder.path()) && !path.exists());
    }
}
