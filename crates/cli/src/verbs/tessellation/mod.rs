//! Runs `partprobe tessellation`: measures whether label sources give a shape the same labels on a finer and on a coarser mesh
//! (paper §4.3).
//!
//! STEP files and names of sources go in. Tables come out on stdout, and with `--out` as Markdown, CSV and JSON with one PNG per
//! picture grid. Each shape is meshed three times: T0 with the given settings, T1 with half and T2 with twice the chord, the
//! angle and the longest edge. Points are drawn once, on T0.

mod carriers;
mod grid;
mod measure;
mod verb;

pub(crate) use verb::{TessellationArgs, tessellation};
