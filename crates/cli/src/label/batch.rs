//! The supervisor: files go to workers, what they return goes to disk and into the journal, and the index comes last.

use super::input_files::input_files;
use super::job::LabelJob;
use super::producer::{Expected, Producer};
use super::protocol::{Emitted, WorkerSettings};
use super::record::Recorder;
use super::summary::Summary;
use super::target::{Target, prepare};
use super::task_queue::{Task, TaskQueue, TaskText};
use super::text_hash::{hash_of_file, hash_of_member};
use super::unread::warn_of_repeated;
use super::worker_process::{Failure, Reply, WorkerProcess};
use crate::clock::unix_seconds;
use crate::config::Emit;
use crate::counted::counted;
use crate::interrupt::Interrupt;
use crate::output_folder::make_folder;
use crate::progress::Progress;
use anyhow::{Context, Result, bail};
use partprobe_dataset::{
    FileRecord, INDEX_FILE, IndexEntry, Journal, TIMING_FILE, Timing, WrittenFile, json_lines,
    write_atomically, write_atomically_with,
};
use sha2::{Digest, Sha256};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::thread::ScopedJoinHandle;

/// Batches with more inputs than this, or with archives, keep their carriers in sub-folders.
const MAX_FLAT_FILES: usize = 1000;

/// The user has stopped a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stopped {
    /// Files that are done.
    pub(crate) n_files: usize,
}

impl std::fmt::Display for Stopped {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let files = counted(self.n_files, "file", "files");
        write!(
            f,
            "stopped after {files}; what is done is kept, continue with --resume"
        )
    }
}

impl std::error::Error for Stopped {}

/// Labels every file; one that fails is a line of the index.
///
/// # Errors
/// If there is no file, the folder holds something else or cannot be written to, or the user stops the batch.
pub(crate) fn label_paths(job: &LabelJob, interrupt: &Interrupt) -> Result<Summary> {
    let sources = input_files(&job.paths, &job.lists)?.not_empty()?;
    warn_of_repeated(&sources.repeated);
    let files = &sources.files;
    // The lock lives as long as the batch.
    let (target, _lock) = prepare(job, files, interrupt)?;
    let mut journal = match target {
        Target::Open(journal) => journal,
        Target::Finished(dataset) => return Ok(Summary::of(dataset.entries())),
    };
    let expected = Expected::of(&sources, job.shard);
    journal.begin_session(unix_seconds(), expected.n_files, expected.has_more)?;
    let bar = Progress::on_terminal().bar(
        "label",
        usize::try_from(expected.n_files).unwrap_or(usize::MAX),
    );
    let queue = TaskQueue::default();
    let recorder = Recorder::new(journal, bar);
    let has_archive = files.iter().any(|file| file.archive.is_some());
    let batch = Batch {
        out: &job.out,
        settings: WorkerSettings {
            label: job.config.label.clone(),
            sample: job.config.sample.clone(),
        },
        has_sub_folders: has_archive || files.len() > MAX_FLAT_FILES,
        program: std::env::current_exe().context("finding this program, to start workers")?,
        queue: &queue,
        recorder: &recorder,
        interrupt,
    };
    let max_bytes = job.config.label.max_file_mb << 20;
    let producer = Producer {
        sources: &sources,
        shard: job.shard,
        max_bytes,
        queue: &queue,
        recorder: &recorder,
        interrupt,
    };
    let is_done = batch.run(&producer, job.n_workers)?;
    let journal = recorder.into_journal();
    if !is_done {
        bail!(Stopped {
            n_files: journal.n_files()
        });
    }
    finish(&job.out, journal)
}

/// Makes the index out of the journal.
fn finish(out: &Path, mut journal: Journal) -> Result<Summary> {
    let mut summary = Summary::default();
    write_atomically_with(&out.join(TIMING_FILE), |file| {
        journal.for_each_record(|record| {
            anyhow::Ok(file.write_all(&json_lines([Timing::of(&record)])?)?)
        })
    })?;
    write_atomically_with(&out.join(INDEX_FILE), |file| {
        journal.for_each_record(|record| {
            summary.add(&record.entries);
            anyhow::Ok(file.write_all(&json_lines(&record.entries)?)?)
        })
    })?;
    // A folder with an index and no journal is complete.
    journal.remove()?;
    Ok(summary)
}

/// The field of the index that names the shape's file of this kind.
fn file_of_entry(entry: &mut IndexEntry, emit: Emit) -> &mut Option<String> {
    match emit {
        Emit::Carrier => &mut entry.file,
        Emit::Labels => &mut entry.labels_file,
        Emit::Points => &mut entry.points_file,
    }
}

/// What the threads of a batch share.
struct Batch<'a> {
    out: &'a Path,
    settings: WorkerSettings,
    has_sub_folders: bool,
    program: PathBuf,
    queue: &'a TaskQueue,
    recorder: &'a Recorder,
    interrupt: &'a Interrupt,
}

impl Batch<'_> {
    /// Labels all files; says whether none is left.
    fn run(&self, producer: &Producer<'_>, n_workers: usize) -> Result<bool> {
        std::thread::scope(|scope| {
            let feeding = scope.spawn(|| {
                let fed = producer.run();
                if fed.is_err() {
                    self.queue.abandon()
                } else {
                    self.queue.close()
                }
                fed
            });
            let supervisors: Vec<_> = (0..n_workers)
                .map(|_| scope.spawn(|| self.supervise()))
                .collect();
            let ended: Vec<Result<bool>> = supervisors.into_iter().map(joined).collect();
            let is_fed = joined(feeding)?;
            let are_done: Vec<bool> = ended.into_iter().collect::<Result<_>>()?;
            Ok(is_fed && are_done.into_iter().all(|is_done| is_done))
        })
    }

    /// Feeds one worker, and a new one wherever it dies; says whether it came to the end of the queue.
    fn supervise(&self) -> Result<bool> {
        let ended = self.supervise_until_interrupted();
        if !matches!(ended, Ok(true)) {
            self.queue.abandon();
        }
        ended
    }

    fn supervise_until_interrupted(&self) -> Result<bool> {
        let mut worker = None;
        while !self.interrupt.is_set() {
            let Some(task) = self.queue.pop() else {
                return Ok(true);
            };
            let running = match &mut worker {
                Some(running) => running,
                none => none.insert(WorkerProcess::start(&self.program, &self.settings)?),
            };
            let answer = running.label(&task);
            if answer.as_ref().is_err_and(|failure| failure.is_fatal) {
                worker = None;
            }
            self.recorder.record(self.store(task, answer)?)?;
        }
        Ok(false)
    }

    /// Writes what came of a file; its record says what was written.
    fn store(&self, task: Task, answer: Result<Reply, Failure>) -> Result<FileRecord> {
        let seconds = answer.as_ref().ok().map(|reply| reply.seconds);
        let mut written = Vec::new();
        let entries = match answer {
            Ok(reply) => reply
                .shapes
                .into_iter()
                .map(|(entry, emitted)| self.store_shape(entry, emitted, &mut written))
                .collect::<Result<_>>()?,
            Err(failure) => {
                let entry = IndexEntry::without_carrier(
                    &task.id,
                    &task.source,
                    failure.status,
                    failure.reason,
                );
                vec![IndexEntry {
                    sha256: self.hash_of(task.text),
                    ..entry
                }]
            }
        };
        Ok(FileRecord {
            source: task.source,
            position: 0,
            entries,
            written,
            seconds,
            ended: unix_seconds(),
        })
    }

    /// The hash of a text that no worker could label: by it, --resume notices that the file was edited.
    fn hash_of(&self, text: TaskText) -> Option<String> {
        let max_bytes = self.settings.label.max_file_mb << 20;
        match text {
            TaskText::Path(path) => hash_of_file(&path, max_bytes),
            TaskText::Bytes(bytes) => hash_of_member(bytes, max_bytes),
        }
    }

    /// Writes the files of a shape, and notes where.
    fn store_shape(
        &self,
        mut entry: IndexEntry,
        emitted: Vec<Emitted>,
        written: &mut Vec<WrittenFile>,
    ) -> Result<IndexEntry> {
        for Emitted { emit, bytes } in emitted {
            let file = self.file_of(&entry.id, emit);
            let path = self.out.join(&file);
            let folder = path.parent().unwrap_or(self.out);
            make_folder(folder)?;
            write_atomically(&path, &bytes)?;
            written.push(WrittenFile {
                file: file.clone(),
                bytes: bytes.len() as u64,
            });
            *file_of_entry(&mut entry, emit) = Some(file);
        }
        Ok(entry)
    }

    /// The name of a shape's file in the data set; it depends on the id and the inputs, never on other shapes.
    fn file_of(&self, id: &str, emit: Emit) -> String {
        let folder = match emit {
            Emit::Carrier => "",
            Emit::Labels => "labels/",
            Emit::Points => "points/",
        };
        if self.has_sub_folders {
            format!("{folder}{:02x}/{id}.npz", Sha256::digest(id)[0])
        } else {
            format!("{folder}{id}.npz")
        }
    }
}

/// The answer of a thread; one that panicked is an error like any other.
fn joined(thread: ScopedJoinHandle<'_, Result<bool>>) -> Result<bool> {
    thread
        .join()
        .unwrap_or_else(|_| bail!("a thread of the batch panicked"))
}
