//! The supervisor: files go to workers, what they return goes to disk, and the index is written last.

use super::source_files::{SourceFile, source_files};
use super::summary::Summary;
use super::worker_process::{Failure, Reply, WorkerProcess};
use crate::atomic_write::write_atomically;
use crate::config::LabelConfig;
use crate::dataset::{INDEX_FILE, IndexEntry, SETTINGS_FILE, TIMING_FILE};
use crate::interrupt::Interrupt;
use crate::json_lines::{json_document, json_lines};
use crate::progress::Progress;
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use indicatif::ProgressBar;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Batches with more files than this keep their carriers in sub-folders.
const MAX_FLAT_FILES: usize = 1000;

/// What is labelled, how, and to where.
#[derive(Clone, Debug)]
pub struct LabelJob {
    paths: Vec<PathBuf>,
    out: PathBuf,
    config: LabelConfig,
    n_workers: usize,
    replaces: bool,
}

impl LabelJob {
    /// A job that labels these paths into a new or empty folder.
    #[must_use]
    pub fn in_folder(paths: &[PathBuf], out: &Path, config: &LabelConfig, n_workers: usize) -> Self {
        let (paths, config) = (paths.to_vec(), config.clone());
        Self { paths, out: out.to_owned(), config, n_workers: n_workers.max(1), replaces: false }
    }

    /// The same job, which removes the data set that stands in the folder once its own files are known.
    #[must_use]
    pub fn replacing(self) -> Self {
        Self { replaces: true, ..self }
    }
}

/// Labels every file; one that fails is a line of the index.
///
/// # Errors
/// If there is no file, the folder is not empty or cannot be written to, or the user stops the batch.
pub fn label_paths(job: &LabelJob, interrupt: &Interrupt) -> Result<Summary> {
    let files = source_files(&job.paths)?;
    ensure!(!files.is_empty(), UsageError("there is no .step, .stp or .p21 file in what was given".to_owned()));
    if job.replaces {
        remove_dataset(&job.out, &files)?;
    }
    prepare_folder(&job.out)?;
    write_atomically(&job.out.join(SETTINGS_FILE), &json_document(&Settings::of(&job.config))?)?;
    let bar = Progress::on_terminal().bar("label", files.len());
    let batch = Batch {
        files: &files,
        job,
        program: std::env::current_exe().context("finding this program, to start workers")?,
        next: AtomicUsize::new(0),
        done: Mutex::new(files.iter().map(|_| None).collect()),
        interrupt,
        bar,
    };
    let done = batch.run()?;
    write_atomically(&job.out.join(TIMING_FILE), &json_lines(done.iter().map(|file| &file.timing))?)?;
    let entries: Vec<IndexEntry> = done.into_iter().flat_map(|file| file.entries).collect();
    // The index comes last: a folder that has one is complete.
    write_atomically(&job.out.join(INDEX_FILE), &json_lines(&entries)?)?;
    Ok(Summary::of(&entries, files.len()))
}

/// Removes what labelling has written into the folder, finished or not; anything else in it is a reason to refuse.
fn remove_dataset(out: &Path, files: &[SourceFile]) -> Result<()> {
    if !out.exists() {
        return Ok(());
    }
    let out = &out.canonicalize().with_context(|| out.display().to_string())?;
    let inside = |file: &&SourceFile| file.path.canonicalize().is_ok_and(|path| path.starts_with(out));
    if let Some(file) = files.iter().find(inside) {
        bail!(UsageError(format!("{} lies in --out; --force would remove it", file.path.display())));
    }
    let foreign = foreign_files(out)?;
    if let Some(path) = foreign.first() {
        bail!(UsageError(format!("{} was not written by `label`, so --force removes nothing", path.display())));
    }
    fs::remove_dir_all(out).with_context(|| format!("removing {}", out.display()))
}

/// Files below a folder that are neither carriers nor the three lists of a data set.
fn foreign_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut foreign = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))? {
        let path = entry?.path();
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if path.is_dir() {
            foreign.extend(foreign_files(&path)?);
        } else if ![INDEX_FILE, SETTINGS_FILE, TIMING_FILE].contains(&name.as_str())
            && !name.ends_with(".npz")
            && !(name.starts_with('.') && (name.ends_with(".part") || name.ends_with(".unfinished")))
        {
            foreign.push(path);
        }
    }
    Ok(foreign)
}

fn prepare_folder(out: &Path) -> Result<()> {
    fs::create_dir_all(out).with_context(|| format!("making {}", out.display()))?;
    let is_empty = fs::read_dir(out).with_context(|| format!("reading {}", out.display()))?.next().is_none();
    ensure!(
        is_empty,
        UsageError(format!("{} is not empty; choose another --out, or replace it with --force", out.display()))
    );
    Ok(())
}

/// What `dataset.json` says: all that decides the bytes of the data set, and nothing else.
#[derive(Serialize)]
struct Settings<'a> {
    format_version: u32,
    program_version: &'static str,
    label: &'a LabelConfig,
}

impl<'a> Settings<'a> {
    fn of(label: &'a LabelConfig) -> Self {
        Self { format_version: formats::FORMAT_VERSION, program_version: env!("CARGO_PKG_VERSION"), label }
    }
}

/// A file that went through a worker.
struct Done {
    entries: Vec<IndexEntry>,
    timing: Timing,
}

/// A line of `timing.jsonl`.
#[derive(Serialize)]
struct Timing {
    path: PathBuf,
    /// Seconds in the worker; null where it did not answer.
    seconds: Option<f64>,
}

struct Batch<'a> {
    files: &'a [SourceFile],
    job: &'a LabelJob,
    program: PathBuf,
    next: AtomicUsize,
    done: Mutex<Vec<Option<Done>>>,
    interrupt: &'a Interrupt,
    bar: ProgressBar,
}

impl Batch<'_> {
    /// Labels all files; the answers stand in the files' order, whichever worker was faster.
    fn run(self) -> Result<Vec<Done>> {
        let n_workers = self.job.n_workers.min(self.files.len());
        let ended: Vec<Result<()>> = std::thread::scope(|scope| {
            let supervisors: Vec<_> = (0..n_workers).map(|_| scope.spawn(|| self.supervise())).collect();
            supervisors
                .into_iter()
                .map(|thread| thread.join().unwrap_or_else(|_| bail!("a supervisor panicked")))
                .collect()
        });
        ended.into_iter().collect::<Result<()>>()?;
        let done = self.done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
        let n_done = done.iter().flatten().count();
        if n_done < self.files.len() {
            let out = self.job.out.display();
            bail!(
                "stopped after {n_done} of {} files; {out} has no index yet, label again with --force",
                self.files.len()
            );
        }
        Ok(done.into_iter().flatten().collect())
    }

    /// Feeds one worker, and a new one wherever it dies.
    fn supervise(&self) -> Result<()> {
        let mut worker = None;
        while let Some((idx, file)) = self.next_file() {
            let running = match &mut worker {
                Some(running) => running,
                none => none.insert(WorkerProcess::start(&self.program, &self.job.config)?),
            };
            let answer = running.label(file);
            if answer.as_ref().is_err_and(|failure| failure.is_fatal) {
                worker = None;
            }
            let stored =
                self.store(file, answer).inspect_err(|_| self.next.store(self.files.len(), Ordering::Relaxed))?;
            self.done.lock().unwrap_or_else(|poisoned| poisoned.into_inner())[idx] = Some(stored);
            self.bar.inc(1);
        }
        Ok(())
    }

    fn next_file(&self) -> Option<(usize, &SourceFile)> {
        if self.interrupt.is_set() {
            return None;
        }
        let idx = self.next.fetch_add(1, Ordering::Relaxed);
        self.files.get(idx).map(|file| (idx, file))
    }

    fn store(&self, file: &SourceFile, answer: Result<Reply, Failure>) -> Result<Done> {
        let timing = Timing { path: file.path.clone(), seconds: answer.as_ref().ok().map(|reply| reply.seconds) };
        let entries = match answer {
            Ok(reply) => {
                let store = |(entry, carrier)| self.store_carrier(entry, carrier);
                reply.shapes.into_iter().map(store).collect::<Result<_>>()?
            }
            Err(failure) => vec![IndexEntry::without_carrier(&file.id, &file.name, failure.status, failure.reason)],
        };
        Ok(Done { entries, timing })
    }

    /// Writes the carrier, if there is one, and notes where.
    fn store_carrier(&self, mut entry: IndexEntry, carrier: Option<Vec<u8>>) -> Result<IndexEntry> {
        let Some(bytes) = carrier else { return Ok(entry) };
        let file = if self.files.len() > MAX_FLAT_FILES {
            let folder = format!("{:02x}", Sha256::digest(&entry.id)[0]);
            fs::create_dir_all(self.job.out.join(&folder)).with_context(|| format!("making {folder}"))?;
            format!("{folder}/{}.npz", entry.id)
        } else {
            format!("{}.npz", entry.id)
        };
        write_atomically(&self.job.out.join(&file), &bytes)?;
        entry.file = Some(file);
        Ok(entry)
    }
}
