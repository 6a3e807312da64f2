//! Runs `partprobe bench`: how long the parts of the program take on this machine.
//!
//! What goes in are settings; what comes out is a table or JSON on stdout. Nothing is written, and no test asks for
//! a time: figures are to be compared with others of the same run only.

mod sources;
#[cfg(feature = "train")]
mod step;
mod timing;
mod verb;

pub(crate) use verb::{BenchArgs, bench};
