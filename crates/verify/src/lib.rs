//! Compares the reading of a STEP file with itself, and with that of another kernel.
//!
//! ```
//! use partprobe_verify::{MeasureSettings, MeasuredFile, self_check};
//!
//! let generated = partprobe_synth::SynthSettings { seed: 7, min_parts: 4, max_parts: 10 };
//! let text = partprobe_synth::part(&generated, 0).step;
//!
//! let settings = MeasureSettings::default();
//! let file = MeasuredFile::from_step(text.as_bytes(), &settings)?;
//! let (count, findings) = self_check(&file, settings.options.angle_rad);
//! println!("{} of {} faces agree with themselves", count.n_faces_agreeing, count.n_faces);
//! # assert!(findings.is_empty() && count.n_faces > 0);
//! # Ok::<(), partprobe_brep::ReadError>(())
//! ```
//!
//! [`self_check()`] needs no reference: each area and each volume is computed from the true surfaces and from the triangles.
//! [`compare()`] takes two [`FileReading`]s and counts what agrees. [`FileComparison`] does both for one file,
//! [`GroupCounts`] adds files up, and [`table()`], [`own_table`] and [`VerificationReport`] show the result.
//!
//! Guarantees: each disagreement names its `#` number. Limits: faces and solids are matched by their `#` numbers, so both
//! readings must be of the same text. Nothing here opens a file, prints, or reads the clock.

mod compare;
mod file_comparison;
mod measured_file;
mod reading;
mod reference;
mod report;
mod self_check;
mod table;
mod volumes;

pub use compare::{Agreement, AreaCount, compare};
pub use file_comparison::FileComparison;
pub use measured_file::{MeasureSettings, MeasuredFile, MeasuredSolid};
pub use reading::{FaceReading, FileReading};
pub use reference::ReferenceFile;
pub use report::{Counts, FindingRow, TextRow, VerificationReport};
pub use self_check::{Finding, Quantity, SelfCount, self_check};
pub use table::{GroupCounts, own_table, table};
pub use volumes::{ReferenceSolid, VolumeCount, VolumesLine, compare_volumes};
