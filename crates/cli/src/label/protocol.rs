//! Defines what `label` and its workers say to each other through pipes.

use crate::config::{Emit, LabelConfig, SampleConfig};
use partprobe_dataset::IndexEntry;
use serde::{Deserialize, Serialize};

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
pub(super) struct EmittedFile {
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
