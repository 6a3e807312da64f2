//! Runs `partprobe compare`: how well label sources agree with a reference source, without any training (paper §4.4).
//!
//! What goes in are shapes and names of sources; tables come out on stdout, and with `--out` as Markdown, CSV, JSON and
//! SVG. Every score and table is made by `partprobe_eval`, every transfer of labels by `partprobe_transfer`; this module
//! reads shapes, draws figures and writes files.

mod colors;
mod complexity_svg;
mod counts_svg;
mod curve_svg;
mod distribution_svg;
mod measure;
mod verb;

pub(crate) use measure::positions_of;
pub(crate) use verb::{CompareArgs, compare};
