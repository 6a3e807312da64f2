//! Runs `partprobe embed`: a trained backbone on any STEP file, carrier, mesh or point cloud. Runs `partprobe nearest` on what it has written.

mod form;
mod index;
mod input;
mod library_model;
mod nearest;
mod verb;

pub(crate) use nearest::{NearestArgs, nearest};
pub(crate) use verb::{EmbedArgs, embed};
