//! Runs `partprobe render`: it draws pictures of labeled shapes.
//!
//! Carriers go in, and one file comes out: pixels (PNG), or areas and lines (SVG, PDF). `partprobe_render` draws everything.

mod page;
mod verb;

pub(crate) use verb::{RenderArgs, render};
