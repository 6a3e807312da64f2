//! Reads STEP text with the crates of truck, as a second kernel. The result has the same types as that of partprobe-brep:
//! `FaceGraph` and `Mesh`.
//!
//! ```
//! use partprobe_truck::{IS_BUILT_IN, TruckError, TruckSettings, shape};
//!
//! let part = partprobe_synth::part(&partprobe_synth::SynthSettings { seed: 1, min_parts: 4, max_parts: 9 }, 0);
//! let settings = TruckSettings { mm_per_unit: 1.0, rad_per_unit: 1.0, chord_fraction: 0.002 };
//! match shape(&part.step, &settings) {
//!     Ok(shape) => assert_eq!(shape.graph.faces.len(), part.n_faces as usize),
//!     // The text is valid, so the only possible error is that this build does not contain truck.
//!     Err(error) => assert!(!IS_BUILT_IN && error == TruckError::NotBuilt),
//! }
//! ```
//!
//! Tests compare it with the own kernel, and `--kernel truck` uses it. It is not the default kernel: truck does not read
//! units and assemblies, knows fewer entities, and drops what it cannot read.
//!
//! # What it guarantees
//!
//! - What truck drops is named: each [`DroppedEntity`] has its `#` number and the reason.
//! - Lengths are in millimeters and angles in radians. The caller passes the units of the file.
//! - A panic of truck never reaches the caller: it becomes a [`DroppedEntity`] or a [`TruckError`].
//! - Without the cargo feature `truck`, nothing of truck is compiled, and [`shape()`] returns [`TruckError::NotBuilt`].
//!
//! # What it does not do
//!
//! It opens no file, prints nothing and does not read the clock, though truck itself writes complaints to stderr. Some
//! files send truck into an endless loop. The caller needs a watchdog for these.

mod agreement;
#[cfg(feature = "truck")]
mod dihedral;
mod dropped_entity;
#[cfg(feature = "truck")]
mod reading;
mod rewriting;
mod shape;
#[cfg(feature = "truck")]
mod source;
#[cfg(feature = "truck")]
mod tessellation;
mod truck_shape;

pub use agreement::{KernelAgreement, Reading};
pub use dropped_entity::{DroppedEntity, DroppedKind};
pub use rewriting::rewritten;
pub use shape::shape;
pub use truck_shape::{TruckError, TruckSettings, TruckShape};

/// Whether this build contains the kernel.
pub const IS_BUILT_IN: bool = cfg!(feature = "truck");
