//! The worker: a process that labels the files that it is told, until its input ends.

use super::frames::{read_frame, write_frame};
use super::shape::{LabelledShape, label_text, read_step};
use crate::config::LabelConfig;
use crate::dataset::IndexEntry;
use crate::interrupt::Interrupt;
use anyhow::{Context, Result, anyhow};
use formats::{Compression, carrier_to_npz};
use serde::{Deserialize, Serialize};
use std::io::{BufWriter, stdin, stdout};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::Instant;

/// Deep files need more stack than the 8 MiB of a main thread.
const STACK_BYTES: usize = 64 << 20;

/// Label files for `partprobe label`; it starts this by itself.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct WorkerArgs {}

/// One file to label.
#[derive(Debug, Deserialize, Serialize)]
pub(super) struct Request {
    pub(super) path: PathBuf,
    pub(super) id: String,
    pub(super) name: String,
}

/// What became of it; a block of bytes follows for each entry whose status is `Ok`.
#[derive(Debug, Deserialize, Serialize)]
pub(super) struct ReplyHead {
    pub(super) outcome: Outcome,
    /// Wall-clock seconds in the worker.
    pub(super) seconds: f64,
}

/// How a request ended inside a worker that lives on.
#[derive(Debug, Deserialize, Serialize)]
pub(super) enum Outcome {
    Labelled(Vec<IndexEntry>),
    Failed(String),
    Panicked(String),
}

/// Answers requests on stdin until it ends.
///
/// # Errors
/// If the pipes break, or the limits cannot be set.
pub fn worker(_: &WorkerArgs) -> Result<()> {
    // Ctrl-C reaches the whole group of processes; the supervisor decides when a worker ends.
    Interrupt::listen()?;
    let thread =
        std::thread::Builder::new().stack_size(STACK_BYTES).spawn(serve).context("starting the worker's thread")?;
    thread.join().map_err(|_| anyhow!("the worker panicked outside a file"))?
}

fn serve() -> Result<()> {
    let mut requests = stdin().lock();
    let mut replies = BufWriter::new(stdout().lock());
    let Some(settings) = read_frame(&mut requests)? else { return Ok(()) };
    let config: LabelConfig = serde_json::from_slice(&settings)?;
    let limit = config.memory_mb << 20;
    rlimit::Resource::AS.set(limit, limit).context("limiting the address space")?;
    while let Some(request) = read_frame(&mut requests)? {
        let request: Request = serde_json::from_slice(&request)?;
        let started = Instant::now();
        let (outcome, carriers) = answer(&request, &config);
        let head = ReplyHead { outcome, seconds: started.elapsed().as_secs_f64() };
        write_frame(&mut replies, &serde_json::to_vec(&head)?)?;
        for carrier in &carriers {
            write_frame(&mut replies, carrier)?;
        }
    }
    Ok(())
}

fn answer(request: &Request, config: &LabelConfig) -> (Outcome, Vec<Vec<u8>>) {
    // A panic is a defect of ours; it costs this file, not the batch.
    match catch_unwind(AssertUnwindSafe(|| labelled(request, config))) {
        Ok(Ok((entries, carriers))) => (Outcome::Labelled(entries), carriers),
        Ok(Err(error)) => (Outcome::Failed(format!("{error:#}")), Vec::new()),
        Err(payload) => {
            let text = payload.downcast_ref::<String>().cloned();
            let text = text.or_else(|| payload.downcast_ref::<&str>().map(|text| (*text).to_owned()));
            (Outcome::Panicked(text.unwrap_or_else(|| "no message".to_owned())), Vec::new())
        }
    }
}

fn labelled(request: &Request, config: &LabelConfig) -> Result<(Vec<IndexEntry>, Vec<Vec<u8>>)> {
    let text = read_step(&request.path, config)?;
    let compression = if config.compress { Compression::Deflated } else { Compression::Stored };
    let mut entries = Vec::new();
    let mut carriers = Vec::new();
    for LabelledShape { carrier, entry } in label_text(&text, &request.id, &request.name, config)? {
        if let Some(carrier) = carrier {
            carriers.push(carrier_to_npz(&carrier, compression)?);
        }
        entries.push(entry);
    }
    Ok((entries, carriers))
}
