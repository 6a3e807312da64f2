//! Runs `partprobe embed`: applies a trained backbone to any STEP file, carrier, mesh or point cloud. Runs `partprobe nearest` on
//! the result.

mod form;
mod index;
mod input;
mod library_model;
mod nearest;
mod verb;

pub(crate) use nearest::{NearestArgs, nearest};
pub(crate) use verb::{EmbedArgs, embed};
