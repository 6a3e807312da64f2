//! Defines the messages between `label` and its workers through pipes.

use crate::config::{Emit, LabelConfig, SampleConfig};
use partprobe_dataset::IndexEntry;
use serde::{Deserialize, Serialize};

/// The settings that a worker needs before its first file.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(super) struct WorkerSettings {
    pub(super) label: LabelConfig,
    /// The settings of sampling, if points are requested.
    pub(super) sample: SampleConfig,
}

/// One file to label.
#[derive(Debug, Deserialize, Serialize)]
pub(super) struct Request {
    /// The content of the following block. A path is bytes and need not be text.
    pub(super) follows: Follows,
    pub(super) id: String,
    pub(super) source: String,
}

/// The kind of the block after a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub(super) enum Follows {
    /// The path of the file.
    Path,
    /// The bytes of the file.
    Bytes,
}

/// The result of a file. One block of bytes per emitted file follows.
#[derive(Debug, Deserialize, Serialize)]
pub(super) struct ReplyHead {
    pub(super) outcome: Outcome,
    /// Wall-clock seconds in the worker.
    pub(super) seconds: f64,
}

/// A line of the index, and the kinds of the files that follow for it.
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

/// The result of a request in a worker that continues to run.
#[derive(Debug, Deserialize, Serialize)]
pub(super) enum Outcome {
    Labeled(Vec<ReplyShape>),
    Failed(String),
    OverBudget(String),
    Panicked(String),
}
