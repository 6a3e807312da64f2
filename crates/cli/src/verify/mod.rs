//! `partprobe verify`: our kernel against itself, and against a reference reading of the same files.
//!
//! What goes in is a folder of STEP files, perhaps a file of reference lines and one of volumes; what comes out is a table by
//! group, or one JSON document, each face and solid that contradicts itself, and on request every other disagreement with its `#` numbers. Nothing
//! is written.

mod compare;
mod json;
mod observed;
mod reference;
mod self_check;
mod table;
mod verb;
mod volumes;

pub use compare::{AreaCount, Verdict, compare};
pub use observed::{Observed, ObservedFace};
pub use reference::{ReferenceFile, read_reference};
pub use self_check::{Finding, Quantity, SelfCount, self_check};
pub use table::{GroupCounts, own_table, table};
pub use verb::{VerifyArgs, verify};
pub use volumes::{ReferenceSolid, ReferenceVolumes, VolumeCount, compare_volumes, read_volumes};
