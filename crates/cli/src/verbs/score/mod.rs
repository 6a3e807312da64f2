//! Runs `partprobe score`: it scores what others predicted, from one NPZ file per shape.

mod shape_file;
mod verb;

pub(crate) use verb::{ScoreArgs, score};
