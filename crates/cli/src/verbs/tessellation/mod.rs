//! Runs `partprobe tessellation`: whether label sources say the same of one shape on a finer and on a coarser mesh (paper
//! §4.3).
//!
//! What goes in are STEP files and names of sources; tables come out on stdout, and with `--out` as Markdown, CSV and JSON
//! with a PNG for each picture grid. Each shape is meshed three times: T0 with the settings as they are, T1 with half and
//! T2 with twice the chord, the angle and the longest edge. Points are drawn once, on T0.

mod carriers;
mod grid;
mod measure;
mod verb;

pub(crate) use verb::{TessellationArgs, tessellation};
