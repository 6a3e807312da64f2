//! Draws labeled carriers: a mesh with labels goes in, and an image of pixels or a drawing of areas and lines comes out.
//!
//! ```
//! use partprobe_label::{LabelOptions, label};
//! use partprobe_render::PictureStyle;
//!
//! let settings = partprobe_synth::SynthSettings { seed: 7, min_parts: 4, max_parts: 10 };
//! let text = partprobe_synth::part(&settings, 0).step;
//! let file = label(text.as_bytes(), "bracket", &LabelOptions::default())?;
//! let style = PictureStyle { size: 240, ..PictureStyle::default() };
//! for shape in &file.shapes {
//!     let Ok(carrier) = &shape.carrier else { continue };
//!     let image = style.picture(carrier)?.with_caption(&shape.id, "", style.text_scale());
//!     let png = image.to_png()?;
//!     # assert!(png.starts_with(b"\x89PNG"));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Guarantees: the same carrier and style give the same bytes on every call. A view stores which
//! triangle each sample of the picture shows, and can be painted with any labels.
//!
//! Limits: the camera is orthographic. The typeface of images has only ASCII characters, and that of PDF files has those of
//! Latin-1. Nothing here opens a file, prints, or reads the clock.

mod areas;
mod background;
mod camera;
mod drawing;
mod face_label;
mod glyphs;
mod helvetica;
mod image;
mod label_view;
mod legend;
mod outlines;
mod palette;
mod pdf;
mod picture;
mod sight;
mod svg;
mod view;
mod viewpoint;

pub use background::{Background, NotABackground};
pub use drawing::Drawing;
pub use face_label::{FaceLabel, MissingLayer};
pub use image::{Image, PngError};
pub use label_view::{LabelView, colors_of_triangle_labels};
pub use legend::{Legend, LegendRow};
pub use palette::{Rgb, color_of_type, colors_of_labels};
pub use picture::PictureStyle;
pub use viewpoint::{NotAViewpoint, NotAnAxis, UpAxis, Viewpoint};
