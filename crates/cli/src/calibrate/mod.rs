//! `partprobe calibrate`: what the dihedral angles of a corpus say about the threshold θ.
//!
//! Whatever `label` reads, carriers and data sets go in; tables come out on stdout, and with `--out` as Markdown, CSV, JSON and SVG.
//! Every number is made by `eval`; this module draws and writes.

mod histogram_svg;
mod plot;
mod sweep_svg;
mod verb;

pub use verb::{CalibrateArgs, calibrate};
