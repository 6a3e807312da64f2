//! Runs `partprobe inspect`: it describes one STEP file, mesh or point cloud, as JSON for a program or as text for a reader.

mod given;
mod report;
mod surface;
mod text;
mod verb;

pub(crate) use verb::{InspectArgs, inspect};
