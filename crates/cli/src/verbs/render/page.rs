//! Draws the shapes of one picture file, as pixels or as areas and lines, and makes the bytes of the file.

use anyhow::Result;
use partprobe_carrier::Carrier;
use partprobe_render::{Drawing, Image, PictureStyle};
use std::path::Path;

/// The formats of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PictureFormat {
    /// Pixels.
    Png,
    /// Areas and lines, for browsers and drawing programs.
    Svg,
    /// Areas and lines, for documents.
    Pdf,
}

impl PictureFormat {
    /// The format by the ending of a file.
    pub(super) fn of_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        match ending.as_str() {
            "png" => Some(Self::Png),
            "svg" => Some(Self::Svg),
            "pdf" => Some(Self::Pdf),
            _ => None,
        }
    }

    /// Whether the file has pixels, whose number is limited.
    pub(super) fn has_pixels(self) -> bool {
        self == Self::Png
    }
}

/// The picture of one shape, before it is put on a sheet.
#[derive(Clone, Debug)]
pub(super) enum Cell {
    Image(Image),
    Drawing(Drawing),
}

impl Cell {
    /// Draws a carrier, or its faces, types and parts in a row.
    ///
    /// # Errors
    /// If the carrier does not have the label layer of the style.
    pub(super) fn of(
        carrier: &Carrier,
        style: &PictureStyle,
        has_stages: bool,
        format: PictureFormat,
    ) -> Result<Self> {
        Ok(match (format.has_pixels(), has_stages) {
            (true, false) => Self::Image(style.picture(carrier)?),
            (true, true) => Self::Image(style.stages(carrier)?),
            (false, false) => Self::Drawing(style.drawing(carrier)?),
            (false, true) => Self::Drawing(style.drawn_stages(carrier)?),
        })
    }

    /// The same with a name and a note below.
    pub(super) fn with_caption(self, name: &str, note: &str, scale: f64) -> Self {
        match self {
            Self::Image(image) => Self::Image(image.with_caption(name, note, scale)),
            Self::Drawing(drawing) => Self::Drawing(drawing.with_caption(name, note, scale)),
        }
    }
}

/// The bytes of a file with these cells in rows.
///
/// # Errors
/// If the picture is too large for the format.
pub(super) fn sheet(cells: Vec<Cell>, columns: usize, format: PictureFormat) -> Result<Vec<u8>> {
    let (mut images, mut drawings) = (Vec::new(), Vec::new());
    for cell in cells {
        match cell {
            Cell::Image(image) => images.push(image),
            Cell::Drawing(drawing) => drawings.push(drawing),
        }
    }
    Ok(match format {
        PictureFormat::Png => Image::sheet(&images, columns).to_png()?,
        PictureFormat::Svg => Drawing::sheet(&drawings, columns).to_svg().into_bytes(),
        PictureFormat::Pdf => Drawing::sheet(&drawings, columns).to_pdf()?,
    })
}
