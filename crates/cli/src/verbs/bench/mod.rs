//! Runs `partprobe bench`: measures the times of parts of the program on this machine.
//!
//! Settings go in, and a table or JSON on stdout comes out. Nothing is written, and no test checks a time, because times can only
//! be compared with others of the same run.

mod sources;
#[cfg(feature = "train")]
mod step;
mod timing;
mod verb;

pub(crate) use verb::{BenchArgs, bench};
