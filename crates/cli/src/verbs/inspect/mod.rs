//! Runs `partprobe inspect`: it describes one STEP file, as JSON for a program or as text for a person.

mod report;
mod surface;
mod text;
mod verb;

pub(crate) use verb::{InspectArgs, inspect};
