//! Runs `partprobe check`: whether a folder for another program is what that program needs, and whether label files fit a
//! data set.
//!
//! What goes in is a folder that `export` or anybody else wrote; what comes out is a line for each problem.
//! Nothing is written or mended.

mod labels;
mod pointcept;
mod verb;

#[cfg(feature = "train")]
pub(crate) use labels::types_that_join;
pub(crate) use verb::{CheckArgs, check};
