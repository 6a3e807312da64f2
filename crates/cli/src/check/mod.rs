//! `partprobe check`: whether a folder for another program is what that program needs.
//!
//! What goes in is a folder that `export` or anybody else wrote; what comes out is a line for each problem.
//! Nothing is written or mended.

mod pointcept;
mod verb;

pub(crate) use verb::{CheckArgs, check};
