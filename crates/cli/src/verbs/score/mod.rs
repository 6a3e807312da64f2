//! Runs `partprobe score`: it scores predictions of other programs, from one NPZ file per shape.

mod shape_file;
mod verb;

pub(crate) use verb::{ScoreArgs, score};
