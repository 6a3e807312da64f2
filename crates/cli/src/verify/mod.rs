//! `partprobe verify`: our kernel against a reference reading of the same files.
//!
//! What goes in is a file of reference lines and a folder of STEP files; what comes out is a table by group,
//! and on request every disagreement with its `#` numbers. Nothing is written.

mod compare;
mod observed;
mod reference;
mod table;
mod verb;

pub use compare::{AreaCount, Verdict, compare};
pub use observed::{Observed, ObservedFace};
pub use reference::{ReferenceFile, read_reference};
pub use table::{GroupCounts, table};
pub use verb::{VerifyArgs, verify};
