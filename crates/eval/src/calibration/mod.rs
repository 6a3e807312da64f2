//! What the dihedral angles of a corpus say about the threshold θ: carriers in, histogram, shares, sweep and range out.
//!
//! The paper's §4.2 for any corpus: how the angles between faces of one primitive type are distributed, what the parts
//! are like at several thresholds, and between which thresholds hardly any shape changes. Nothing here reads a file,
//! and the answer does not depend on the order in which shapes are added, except for the order of sums.

mod angles;
mod histogram;
mod part_statistics;
mod report;
mod stable_range;
mod text;

pub use angles::{ShapeAngles, shape_angles};
pub use histogram::{AngleCounts, AngleHistogram, N_ANGLE_BINS, TypeShare};
pub use part_statistics::{PartStatistics, part_statistics};
pub use report::{
    Calibration, CalibrationSettings, CalibrationTables, Quartiles, ShapeCalibration, SweepRow,
};
pub use stable_range::{StableRange, stable_range};
