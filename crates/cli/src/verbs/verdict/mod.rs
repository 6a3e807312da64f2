//! Runs `partprobe verdict`: finds out whether one label source trains better backbones than another.
//!
//! `budget` computes the number of updates of a training, `verb` trains and evaluates the scores, and `sentence` describes the
//! result.

mod budget;
mod mine;
mod sentence;
mod verb;

pub(super) use verb::{VerdictArgs, verdict};
