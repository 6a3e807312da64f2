//! `partprobe verify`: our kernel against a reference reading of the same files.
//!
//! What goes in is a file of reference lines, perhaps one of volumes, and a folder of STEP files; what comes out is a table by group,
//! and on request every disagreement with its `#` numbers. Nothing is written.

mod compare;
mod observed;
mod reference;
mod table;
mod verb;
mod volumes;

pub use compare::{AreaCount, Verdict, compare};
pub use observed::{Observed, ObservedFace};
pub use reference::{ReferenceFile, read_reference};
pub use table::{GroupCounts, table};
pub use verb::{VerifyArgs, verify};
pub use volumes::{ReferenceSolid, ReferenceVolumes, VolumeCount, compare_volumes, read_volumes};
