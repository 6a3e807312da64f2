//! Runs `partprobe check`: checks whether a folder for another program is valid, and whether label files fit a data set.
//!
//! A folder from `export` or any other program goes in, and one line per problem comes out. Nothing is written or repaired.

mod labels;
mod pointcept;
mod verb;

#[cfg(feature = "train")]
pub(crate) use labels::{JoiningType, types_that_join};
pub(crate) use verb::{CheckArgs, check};
