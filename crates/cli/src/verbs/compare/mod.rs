//! Runs `partprobe compare`: measures the agreement of label sources with a reference source, without any training (paper §4.4).
//!
//! Shapes and names of sources go in. Tables come out on stdout, and with `--out` as Markdown, CSV, JSON and SVG.
//! `partprobe_eval` makes every score and table, and `partprobe_transfer` transfers labels. This module reads shapes, draws
//! figures and writes files.

mod colors;
mod complexity_svg;
mod counts_svg;
mod curve_svg;
mod distribution_svg;
mod measure;
mod verb;

pub(crate) use measure::positions_of;
pub(crate) use verb::{CompareArgs, compare};
