//! Supervises a batch: it sends files to workers, writes their results to disk and into the journal, and finally writes the
//! index.

use super::input_files::input_files;
use super::job::LabelJob;
use super::producer::{ExpectedFiles, Producer};
use super::protocol::{EmittedFile, WorkerSettings};
use super::record::Recorder;
use super::released::{EmittedShape, ReleasedLabels};
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
use crate::progress::Progress;
use anyhow::{Context, Result, bail};
use partprobe_dataset::{FileKind, FileLayout, FileRecord, IndexEntry, ShapeFiles, WrittenFile};
use std::path::PathBuf;
use std::thread::ScopedJoinHandle;

/// Batches with more inputs than this, or with archives, write their carriers into sub-folders.
const MAX_FLAT_FILES: usize = 1000;

/// The user has stopped a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StoppedBatch {
    /// The number of finished files.
    pub(crate) n_files: usize,
}

impl std::fmt::Display for StoppedBatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let files = counted(self.n_files, "file", "files");
        write!(
            f,
            "stopped after {files}; what is done is kept, continue with --resume"
        )
    }
}

impl std::error::Error for StoppedBatch {}

/// Labels every file. A file that fails becomes a line of the index.
///
/// # Errors
/// If there is no file, the folder has other content or cannot be written to, or the user stops the batch.
pub(crate) fn label_paths(job: &LabelJob, interrupt: &Interrupt) -> Result<Summary> {
    let sources = input_files(&job.paths, &job.lists)?.not_empty()?;
    warn_of_repeated(&sources.repeated);
    let files = &sources.files;
    // The lock is held for the whole batch.
    let (target, _lock) = prepare(job, files, interrupt)?;
    let mut writer = match target {
        Target::Open(writer) => writer,
        Target::Finished(dataset) => return Ok(Summary::of(dataset.entries())),
    };
    let expected = ExpectedFiles::of(&sources, job.shard);
    writer
        .journal_mut()
        .begin_session(unix_seconds(), expected.n_files, expected.has_more)?;
    let bar = Progress::on_terminal().bar(
        "label",
        usize::try_from(expected.n_files).unwrap_or(usize::MAX),
    );
    let queue = TaskQueue::default();
    let recorder = Recorder::new(writer, bar);
    let has_archive = files.iter().any(|file| file.archive.is_some());
    let layout = if has_archive || files.len() > MAX_FLAT_FILES {
        FileLayout::SubFolders
    } else {
        FileLayout::Flat
    };
    let batch = Batch {
        files: ShapeFiles::new(&job.out, layout),
        settings: WorkerSettings {
            label: job.config.label.clone(),
            sample: job.config.sample.clone(),
        },
        program: std::env::current_exe().context("finding this program, to start workers")?,
        queue: &queue,
        recorder: &recorder,
        interrupt,
        released: job.released.as_deref(),
    };
    let max_bytes = job.config.label.max_file_mb << 20;
    let producer = Producer {
        sources: &sources,
        shard: job.shard,
        max_bytes,
        queue: &queue,
        recorder: &recorder,
        interrupt,
        released: job.released.as_deref(),
    };
    let is_done = batch.run(&producer, job.n_workers)?;
    let writer = recorder.into_writer();
    if !is_done {
        bail!(StoppedBatch {
            n_files: writer.journal().n_files()
        });
    }
    let mut summary = Summary::default();
    writer.finish_visiting(|entries| summary.add(entries))?;
    Ok(summary)
}

/// The kind of file that a data set has for this setting.
fn file_kind(emit: Emit) -> FileKind {
    match emit {
        Emit::Carrier => FileKind::Carrier,
        Emit::Labels => FileKind::Labels,
        Emit::Points => FileKind::Points,
    }
}

/// The data that the threads of a batch share.
struct Batch<'a> {
    files: ShapeFiles,
    settings: WorkerSettings,
    program: PathBuf,
    queue: &'a TaskQueue,
    recorder: &'a Recorder,
    interrupt: &'a Interrupt,
    released: Option<&'a ReleasedLabels>,
}

impl Batch<'_> {
    /// Labels all files. Returns whether none is left.
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

    /// Sends files to one worker, and starts a new one if it dies. Returns whether it reached the end of the queue.
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

    /// Writes the result of a file. The returned record describes what was written.
    fn store(&self, task: Task, answer: Result<Reply, Failure>) -> Result<FileRecord> {
        let seconds = answer.as_ref().ok().map(|reply| reply.seconds);
        let mut written = Vec::new();
        let entries = match answer {
            Ok(reply) => self
                .checked(&task, reply.shapes)?
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

    /// The shapes, after a comparison with the package if the batch has one.
    fn checked(&self, task: &Task, shapes: Vec<EmittedShape>) -> Result<Vec<EmittedShape>> {
        match self.released {
            Some(released) => released.checked(&task.id, &task.source, shapes),
            None => Ok(shapes),
        }
    }

    /// The hash of a text that no worker could label. With it, --resume detects that the file was edited.
    fn hash_of(&self, text: TaskText) -> Option<String> {
        let max_bytes = self.settings.label.max_file_mb << 20;
        match text {
            TaskText::Path(path) => hash_of_file(&path, max_bytes),
            TaskText::Bytes(bytes) => hash_of_member(bytes, max_bytes),
        }
    }

    /// Writes the files of a shape, and records their paths.
    fn store_shape(
        &self,
        mut entry: IndexEntry,
        emitted: Vec<EmittedFile>,
        written: &mut Vec<WrittenFile>,
    ) -> Result<IndexEntry> {
        for EmittedFile { emit, bytes } in emitted {
            written.push(self.files.write(&mut entry, file_kind(emit), &bytes)?);
        }
        Ok(entry)
    }
}

/// The answer of a thread. A panic becomes an ordinary error.
fn joined(thread: ScopedJoinHandle<'_, Result<bool>>) -> Result<bool> {
    thread
        .join()
        .unwrap_or_else(|_| bail!("a thread of the batch panicked"))
}
