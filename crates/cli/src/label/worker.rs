//! Labels requested files in a separate process, until its input ends.

use super::emit::emitted;
use super::frames::{read_frame, write_frame};
use super::input_bytes::InputBytes;
use super::over_budget::OverBudget;
use super::path_text::path_of_bytes;
use super::protocol::{
    EmittedFile, Follows, Outcome, ReplyHead, ReplyShape, Request, WorkerSettings,
};
use super::shape::{IndexedShape, label_input};
use super::step_text::unpacked;
use crate::interrupt::Interrupt;
use anyhow::{Context, Result, anyhow};
use std::io::{BufWriter, stdin, stdout};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// The size of the stack. Deeply nested files need more stack than the 8 MiB of a main thread.
const STACK_BYTES: usize = 64 << 20;

/// Label files for `partprobe label`; it starts this by itself.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct WorkerArgs {}

/// Answers requests on stdin until it ends.
///
/// # Errors
/// If the pipes break, or the limits cannot be set.
pub(crate) fn worker(_: &WorkerArgs) -> Result<()> {
    // Ctrl-C reaches the whole group of processes, but the supervisor decides when a worker ends.
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

fn answer(
    request: &Request,
    block: Vec<u8>,
    settings: &WorkerSettings,
) -> (Outcome, Vec<EmittedFile>) {
    // A panic is a bug of partprobe. Only this file fails then, and not the batch.
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
) -> Result<(Vec<ReplyShape>, Vec<EmittedFile>)> {
    let max_bytes = settings.label.max_file_mb << 20;
    let input = match request.follows {
        Follows::Path => InputBytes::of_path(&path_of_bytes(&block), max_bytes)?,
        Follows::Bytes => InputBytes::Step(unpacked(block, max_bytes)?),
    };
    let mut shapes = Vec::new();
    let mut files = Vec::new();
    for IndexedShape { carrier, mut entry } in
        label_input(&input, &request.id, &request.source, &settings.label)?
    {
        let first = files.len();
        if let Some(carrier) = carrier {
            files.extend(emitted(&carrier, settings, &mut entry)?);
        }
        let emits = files[first..]
            .iter()
            .map(|file: &EmittedFile| file.emit)
            .collect();
        shapes.push(ReplyShape { entry, emits });
    }
    Ok((shapes, files))
}
