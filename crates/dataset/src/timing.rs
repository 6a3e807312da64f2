//! Defines a line of `timing.jsonl`: the time that a file took, and the number of bytes that were written for it.

use crate::FileRecord;
use serde::{Deserialize, Serialize};

/// The file with wall-clock times; they are not part of the data set.
pub const TIMING_FILE: &str = "timing.jsonl";

/// A line of `timing.jsonl`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Timing {
    /// The file's name in the index.
    pub source: String,
    /// Seconds in the worker, or null if it did not answer.
    pub seconds: Option<f64>,
    /// Bytes that were written for it.
    pub bytes: u64,
    /// When it was done, in seconds since 1970.
    pub ended: f64,
}

impl Timing {
    /// The times of a file.
    #[must_use]
    pub fn of(record: &FileRecord) -> Self {
        let bytes = record.written.iter().map(|written| written.bytes).sum();
        Self {
            source: record.source.clone(),
            seconds: record.seconds,
            bytes,
            ended: record.ended,
        }
    }
}
