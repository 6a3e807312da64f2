//! `partprobe calibrate`: what the dihedral angles of a corpus say about the threshold θ.
//!
//! STEP files, carriers and data sets go in; tables come out on stdout, and with `--out` as Markdown, CSV, JSON and SVG.
//! Every number is made by `eval`; this module reads shapes, draws, and writes.

mod histogram_svg;
mod plot;
mod shapes;
mod sweep_svg;
mod verb;

pub use verb::{CalibrateArgs, calibrate};
