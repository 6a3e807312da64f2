//! Labels the parts of a STEP file: text in, carriers out, in one call.
//!
//! A *carrier* is a triangle mesh in which every triangle records its B-Rep face and its part. Two adjacent faces belong
//! to one part if they have the same primitive type and their normals differ by at most θ along the shared edge
//! (STEP-Parts, section 3).
//!
//! ```
//! use partprobe_label::{LabelOptions, label};
//!
//! let settings = partprobe_synth::SynthSettings { seed: 7, min_parts: 4, max_parts: 10 };
//! let bracket = partprobe_synth::part(&settings, 0);
//! let file = label(bracket.step.as_bytes(), "bracket", &LabelOptions::default())?;
//! for shape in &file.shapes {
//!     let Ok(carrier) = &shape.carrier else { continue };
//!     println!("{}: {} faces, {} parts", shape.id, carrier.graph().faces.len(), carrier.n_parts());
//! }
//! # assert_eq!(file.shapes.len(), 1);
//! # Ok::<(), partprobe_label::LabelError>(())
//! ```
//!
//! # What it guarantees
//!
//! - The same text and options give the same carriers on every machine.
//! - A damaged face does not end a file: it is named in the carrier's `lost` list with its `#` number.
//! - A solid without a carrier is part of the answer, with its reason. The other solids of the file have theirs.
//!
//! # What it does not do
//!
//! It opens no file, prints nothing, and does not read the clock. It limits the work by the counts of [`LabelOptions`]. If you
//! also need a limit on time or memory, run it in a separate process.

mod equal_solids;
mod error;
mod file;
mod layers;
mod options;
mod second_kernel;

pub use error::LabelError;
pub use file::{LabeledFile, LabeledShape, Visitor, label, label_given, label_visiting};
pub use options::{Kernel, LabelOptions, Unit};
