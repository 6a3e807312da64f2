//! Runs `partprobe verdict`: does one label source train better backbones than another?
//!
//! `budget` decides how many updates a training gets, `verb` trains and looks, `sentence` says what was found.

mod budget;
mod mine;
mod sentence;
mod verb;

pub(super) use verb::{VerdictArgs, verdict};
