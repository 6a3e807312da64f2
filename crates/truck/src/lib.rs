//! The second kernel: STEP text through the crates truck-stepio and truck-meshalgo, to the same `FaceGraph` and `Mesh`.
//!
//! It is a witness in tests and a choice for the curious (`--kernel truck`), not the labeler: truck knows no units, no
//! assemblies and fewer entities, and drops what it cannot read. What it drops is named here, lengths become millimeters
//! and angles radians, and its panics become losses; only its endless loops are left to the caller's watchdog.
//! Nothing here opens a file, prints, or asks the clock, though truck itself writes complaints to stderr.
//!
//! Without the cargo feature `truck` nothing of truck is compiled, and [`shape()`] says how to build it in.

mod agreement;
#[cfg(feature = "truck")]
mod dihedral;
#[cfg(feature = "truck")]
mod reading;
mod rewriting;
mod shape;
#[cfg(feature = "truck")]
mod source;
#[cfg(feature = "truck")]
mod tessellation;

pub use agreement::{Agreement, Reading};
pub use rewriting::rewritten;
pub use shape::{Lost, LostKind, TruckError, TruckSettings, TruckShape, shape};

/// Whether this build holds the kernel.
pub const IS_BUILT_IN: bool = cfg!(feature = "truck");
