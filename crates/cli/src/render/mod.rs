//! Off-screen pictures of labeled carriers, drawn in software.
//!
//! What goes in are carriers; what comes out is an RGB image or a PNG of it, the same bytes on every call.
//! A view is made once (which face each sample of the picture sees) and painted by any labels.

mod camera;
mod glyphs;
mod image;
mod picture;
mod verb;
mod view;

pub use image::Image;
pub use verb::{RenderArgs, render};
