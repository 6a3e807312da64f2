//! Measures what the dihedral angles of a corpus say about the threshold θ of its parts.
//!
//! Two adjacent faces of one primitive type belong to one part if their normals differ by at most θ along the shared edge
//! (STEP-Parts, section 3). This crate repeats the measurements of section 4.2 of that paper on any corpus. It measures
//! the distribution of the angles, statistics of the parts at several thresholds, and the range of thresholds over which
//! hardly any partition changes.
//!
//! ```
//! use partprobe_calibration::{Calibration, CalibrationSettings, ShapeCalibration};
//! use partprobe_label::{LabelOptions, label};
//!
//! let settings = CalibrationSettings { theta_deg: 8.0, thetas_deg: vec![4.0, 8.0, 12.0], tolerance: 0.05 };
//! let mut corpus = Calibration::new(settings.clone());
//!
//! let generated = partprobe_synth::SynthSettings { seed: 7, min_parts: 4, max_parts: 10 };
//! for index in 0..3 {
//!     let text = partprobe_synth::part(&generated, index).step;
//!     let file = label(text.as_bytes(), "part", &LabelOptions::default())?;
//!     for carrier in file.shapes.iter().filter_map(|shape| shape.carrier.as_ref().ok()) {
//!         corpus.add(ShapeCalibration::of(carrier, &settings));
//!     }
//! }
//! let tables = corpus.tables();
//! println!("{}", tables.to_markdown());
//! # assert_eq!((tables.n_shapes, tables.sweep.len()), (3, 3));
//! # Ok::<(), partprobe_label::LabelError>(())
//! ```
//!
//! Guarantees: the same shapes in the same order give the same bytes. Another order may change the last digits.
//! Limits: parts are counted before small parts are absorbed. The crate does not read files, print, or read the clock.

mod angles;
mod histogram;
mod histogram_svg;
mod part_statistics;
pub mod plot;
mod report;
mod stable_range;
mod sweep_svg;
mod text;

pub use angles::{ShapeAngles, shape_angles};
pub use histogram::{AngleCounts, AngleHistogram, N_ANGLE_BINS, TypeShare};
pub use histogram_svg::histogram_svg;
pub use part_statistics::{PartStatistics, part_statistics};
pub use report::{
    Calibration, CalibrationSettings, CalibrationTables, Quartiles, ShapeCalibration, SweepRow,
};
pub use stable_range::{StableRange, stable_range};
pub use sweep_svg::sweep_svg;
