//! Off-screen pictures of labelled meshes, drawn in software.
//!
//! What goes in is a mesh with a group for each triangle; what comes out is an RGB image or a PNG of it.
//! Nothing here reads files; the verb below hands bytes to the caller's path.

mod camera;
mod palette;
mod raster;
mod verb;

pub use palette::color_of_group;
pub use raster::{Image, Picture, draw};
pub use verb::{RenderArgs, render};
