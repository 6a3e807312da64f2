//! The worker: a process that labels the files that it is told, until its input ends.

use super::emit::emitted;
use super::frames::{read_frame, write_frame};
use super::path_text::path_of_bytes;
use super::shape::{IndexedShape, OverBudget, label_text};
use super::step_text::{step_text, unpacked};
use crate::config::{Emit, LabelConfig, SampleConfig};
use crate::interrupt::Interrupt;
use anyhow::{Context, Result, anyhow};
use partprobe_dataset::IndexEntry;
use serde::{Deserialize, Serialize};
use std::io::{BufWriter, stdin, stdout};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// Deep files need more stack than the 8 MiB of a main thread.
const STACK_BYTES: usize = 64 << 20;

/// Label files for `partprobe label`; it starts this by itself.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct WorkerArgs {}

/// What a worker must know before its first file.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(super) struct WorkerSettings {
    pub(super) label: LabelConfig,
    /// How points are drawn, where they are asked for.
    pub(super) sample: SampleConfig,
}

/// One file to label.
#[derive(Debug, Deserialize, Serialize)]
pub(super) struct Request {
    /// What the block holds that follows: a path is bytes, and need not be text.
    pub(super) follows: Follows,
    pub(super) id: String,
    pub(super) source: String,
}

/// What follows a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub(super) enum Follows {
    /// Where the file is.
    Path,
    /// The bytes of the file.
    Bytes,
}

/// What became of it; a block of bytes follows for each file that was emitted.
#[derive(Debug, Deserialize, Serialize)]
pub(super) struct ReplyHead {
    pub(super) outcome: Outcome,
    /// Wall-clock seconds in the worker.
    pub(super) seconds: f64,
}

/// A line of the index, and which files follow for it.
#[derive(Debug, Deserialize, Serialize)]
pub(super) struct ReplyShape {
    pub(super) entry: IndexEntry,
    pub(super) emits: Vec<Emit>,
}

/// The bytes of a file for the data set.
#[derive(Debug)]
pub(super) struct Emitted {
    pub(super) emit: Emit,
    pub(super) bytes: Vec<u8>,
}

/// How a request ended inside a worker that lives on.
#[derive(Debug, Deserialize, Serialize)]
pub(super) enum Outcome {
    Labeled(Vec<ReplyShape>),
    Failed(String),
    OverBudget(String),
    Panicked(String),
}

/// Answers requests on stdin until it ends.
///
/// # Errors
/// If the pipes break, or the limits cannot be set.
pub(crate) fn worker(_: &WorkerArgs) -> Result<()> {
    // Ctrl-C reaches the whole group of processes; the supervisor decides when a worker ends.
    Interrupt::listen()?;
    let thread = std::thread::Builder::new()
        .stack_size(STACK_BYTES)
        .spawn(serve)
        .context("starting the worker's thread")?;
    thread
        .join()
        .map_err(|_| anyhow!("the worker panicked outside a file"))?
}

fn serve() -> Result<()> {
    let mut requests = stdin().lock();
    let mut replies = BufWriter::new(stdout().lock());
    let Some(settings) = read_frame(&mut requests)? else {
        return Ok(());
    };
    let settings: WorkerSettings = serde_json::from_slice(&settings)?;
    let limit = settings.label.memory_mb << 20;
    rlimit::Resource::AS
        .set(limit, limit)
        .context("limiting the address space")?;
    while let Some(request) = read_frame(&mut requests)? {
        let request: Request = serde_json::from_slice(&request)?;
        let block = read_frame(&mut requests)?.context("the pipe ends behind a request")?;
        let started = Instant::now();
        let (outcome, files) = answer(&request, block, &settings);
        let head = ReplyHead {
            outcome,
            seconds: started.elapsed().as_secs_f64(),
        };
        write_frame(&mut replies, &serde_json::to_vec(&head)?)?;
        for file in &files {
            write_frame(&mut replies, &file.bytes)?;
        }
    }
    Ok(())
}

fn answer(request: &Request, block: Vec<u8>, settings: &WorkerSettings) -> (Outcome, Vec<Emitted>) {
    // A panic is a defect of ours; it costs this file, not the batch.
    match catch_unwind(AssertUnwindSafe(|| labeled(request, block, settings))) {
        Ok(Ok((shapes, files))) => (Outcome::Labeled(shapes), files),
        Ok(Err(error)) if error.is::<OverBudget>() => {
            (Outcome::OverBudget(format!("{error:#}")), Vec::new())
        }
        Ok(Err(error)) => (Outcome::Failed(format!("{error:#}")), Vec::new()),
        Err(payload) => {
            let text = payload.downcast_ref::<String>().cloned();
            let text = text.or_else(|| {
                payload
                    .downcast_ref::<&str>()
                    .map(|text| (*text).to_owned())
            });
            (
                Outcome::Panicked(text.unwrap_or_else(|| "no message".to_owned())),
                Vec::new(),
            )
        }
    }
}

fn labeled(
    request: &Request,
    block: Vec<u8>,
    settings: &WorkerSettings,
) -> Result<(Vec<ReplyShape>, Vec<Emitted>)> {
    let max_bytes = settings.label.max_file_mb << 20;
    let text = match request.follows {
        Follows::Path => step_text(&path_of_bytes(&block), max_bytes)?,
        Follows::Bytes => unpacked(block, max_bytes)?,
    };
    let mut shapes = Vec::new();
    let mut files = Vec::new();
    for IndexedShape { carrier, mut entry } in
        label_text(&text, &request.id, &request.source, &settings.label)?
    {
        let first = files.len();
        if let Some(carrier) = carrier {
            files.extend(emitted(&carrier, settings, &mut entry)?);
        }
        let emits = files[first..]
            .iter()
            .map(|file: &Emitted| file.emit)
            .collect();
        shapes.push(ReplyShape { entry, emits });
    }
    Ok((shapes, files))
}
