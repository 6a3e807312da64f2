//! Runs `partprobe embed`: a trained backbone on any STEP file, carrier, mesh or point cloud.

mod input;
mod verb;

pub(crate) use verb::{EmbedArgs, embed};
