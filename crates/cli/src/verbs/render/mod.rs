//! Runs `partprobe render`: it draws pictures of labeled shapes.
//!
//! Carriers go in, one file comes out: pixels (PNG), or areas and lines (SVG, PDF). All is drawn by `partprobe_render`.

mod page;
mod verb;

pub(crate) use verb::{RenderArgs, render};
