//! Defines images, joins them to sheets, writes text on them, and makes PNG files of them.

use crate::glyphs::{ADVANCE, HEIGHT, Stroke, WIDTH, strokes};
use crate::{Background, Rgb};

/// Half the width of the strokes of letters, in dots. No stroke is narrower than a pixel.
const HALF_STROKE: f64 = 0.46;
/// The rows of a caption, in dots.
const CAPTION_ROWS: f64 = HEIGHT as f64 + 6.0;

/// An image of pixels, four bytes each (red, green, blue, opacity), rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height * 4` bytes. A transparent pixel is black.
    pub rgba: Vec<u8>,
    /// The background of the picture and its captions.
    background: Background,
}

impl Image {
    /// A white image.
    #[must_use]
    pub fn white(width: usize, height: usize) -> Self {
        Self::blank(width, height, Background::White)
    }

    /// An image with only the background.
    #[must_use]
    pub fn blank(width: usize, height: usize, background: Background) -> Self {
        let pixel = background
            .color()
            .map_or([0; 4], |[r, g, b]| [r, g, b, 255]);
        Self {
            width,
            height,
            rgba: pixel.repeat(width * height),
            background,
        }
    }

    pub(crate) fn set(&mut self, row: usize, column: usize, color: [u8; 4]) {
        let start = (row * self.width + column) * 4;
        self.rgba[start..start + 4].copy_from_slice(&color);
    }

    /// Mixes a color into a pixel with a coverage from 0 to 1. A pixel outside of the image is ignored.
    fn blend(&mut self, row: usize, column: usize, color: Rgb, coverage: f64) {
        if row >= self.height || column >= self.width || coverage <= 0.0 {
            return;
        }
        let start = (row * self.width + column) * 4;
        let behind: [f64; 4] = [0, 1, 2, 3].map(|channel| f64::from(self.rgba[start + channel]));
        let seen_behind = (1.0 - coverage) * behind[3] / 255.0;
        let opacity = coverage + seen_behind;
        let mixed = |channel: usize| {
            let sum = coverage * f64::from(color[channel]) + seen_behind * behind[channel];
            (sum / opacity).round() as u8
        };
        let pixel = [
            mixed(0),
            mixed(1),
            mixed(2),
            (255.0 * opacity).round() as u8,
        ];
        self.set(row, column, pixel);
    }

    /// Draws another image over this one. Pixels outside of this image are cut off.
    pub(crate) fn draw(&mut self, other: &Self, top: usize, left: usize) {
        let width = other.width.min(self.width.saturating_sub(left));
        for row in 0..other.height.min(self.height.saturating_sub(top)) {
            let from = row * other.width * 4;
            let to = ((top + row) * self.width + left) * 4;
            self.rgba[to..to + width * 4].copy_from_slice(&other.rgba[from..from + width * 4]);
        }
    }

    /// Fills a rectangle with a color.
    pub(crate) fn fill_box(&mut self, [left, top, width, height]: [f64; 4], [r, g, b]: Rgb) {
        let range = |from: f64, length: f64, most: usize| {
            let end = (from + length).round().max(0.0) as usize;
            (from.round().max(0.0) as usize).min(most)..end.min(most)
        };
        let columns = range(left, width, self.width);
        for row in range(top, height, self.height) {
            for column in columns.clone() {
                self.set(row, column, [r, g, b, 255]);
            }
        }
    }

    /// Images in rows of `columns`, on the background of the first one. Each cell is as large as the largest image.
    #[must_use]
    pub fn sheet(images: &[Self], columns: usize) -> Self {
        let largest = |side: fn(&Self) -> usize| images.iter().map(side).max().unwrap_or(0);
        let (cell_width, cell_height) =
            (largest(|image| image.width), largest(|image| image.height));
        let columns = columns.clamp(1, images.len().max(1));
        let background = images.first().map(|image| image.background);
        let mut sheet = Self::blank(
            cell_width * columns,
            cell_height * images.len().div_ceil(columns),
            background.unwrap_or_default(),
        );
        for (cell, image) in images.iter().enumerate() {
            sheet.draw(
                image,
                cell / columns * cell_height,
                cell % columns * cell_width,
            );
        }
        sheet
    }

    /// The image with `name` and `note` in a line below it, centered, `scale` pixels per dot of a letter.
    ///
    /// The beginning of a name that is too long is cut off, because files mostly differ at the ends of their names.
    #[must_use]
    pub fn with_caption(&self, name: &str, note: &str, scale: f64) -> Self {
        let text = caption_text(name, note, self.width as f64 / (ADVANCE as f64 * scale));
        let height = self.height + (CAPTION_ROWS * scale).ceil() as usize;
        let mut image = Self::blank(self.width, height, self.background);
        image.draw(self, 0, 0);
        let left = 0.5 * (self.width as f64 - text_width(&text, scale)).max(0.0);
        image.draw_text(&text, [left, self.height as f64 + 2.0 * scale], scale);
        image
    }

    /// The image with a space of `width` pixels at its right side.
    pub(crate) fn widened(&self, width: usize) -> Self {
        let mut image = Self::blank(self.width + width, self.height, self.background);
        image.draw(self, 0, 0);
        image
    }

    /// Writes a text with its upper left corner at this point, in pixels.
    pub(crate) fn draw_text(&mut self, text: &str, [left, top]: [f64; 2], scale: f64) {
        for (place, character) in text.chars().enumerate() {
            let left = left + (place * ADVANCE) as f64 * scale;
            self.draw_glyph(character, [left, top], scale);
        }
    }

    fn draw_glyph(&mut self, character: char, [left, top]: [f64; 2], scale: f64) {
        let strokes = strokes(character);
        let half = (HALF_STROKE * scale).max(0.5);
        let range = |from: f64, dots: usize| {
            let low = (from - half).floor().max(0.0) as usize;
            low..(from + dots as f64 * scale + half).ceil().max(0.0) as usize
        };
        for row in range(top, HEIGHT) {
            for column in range(left, WIDTH) {
                let at = [
                    (column as f64 + 0.5 - left) / scale,
                    (row as f64 + 0.5 - top) / scale,
                ];
                let distances = strokes.iter().map(|stroke| distance(at, stroke));
                let nearest = distances.fold(f64::INFINITY, f64::min);
                let coverage = (half - nearest * scale + 0.5).clamp(0.0, 1.0);
                self.blend(row, column, self.background.ink(), coverage);
            }
        }
    }

    /// The image as a PNG file, with opacity only if a pixel is not opaque.
    ///
    /// # Errors
    /// If the image is empty or too large for the format.
    pub fn to_png(&self) -> Result<Vec<u8>, PngError> {
        let mut bytes = Vec::new();
        let mut encoder =
            png::Encoder::new(&mut bytes, png_side(self.width)?, png_side(self.height)?);
        let is_opaque = self.rgba.chunks_exact(4).all(|pixel| pixel[3] == 255);
        encoder.set_color(if is_opaque {
            png::ColorType::Rgb
        } else {
            png::ColorType::Rgba
        });
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        if is_opaque {
            let pixels = self.rgba.chunks_exact(4);
            let rgb: Vec<u8> = pixels.flat_map(|pixel| &pixel[..3]).copied().collect();
            writer.write_image_data(&rgb)?;
        } else {
            writer.write_image_data(&self.rgba)?;
        }
        writer.finish()?;
        Ok(bytes)
    }
}

/// The reason why an image cannot be written as PNG.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PngError {
    /// A side has more pixels than the format can represent.
    #[error("an image with a side of {0} pixels is too large for PNG")]
    TooLarge(usize),
    /// The encoder refused the image, for example because it is empty.
    #[error(transparent)]
    Encoding(#[from] png::EncodingError),
}

fn png_side(n_pixels: usize) -> Result<u32, PngError> {
    u32::try_from(n_pixels).map_err(|_| PngError::TooLarge(n_pixels))
}

/// The length of a text, in pixels.
pub(crate) fn text_width(text: &str, scale: f64) -> f64 {
    (text.chars().count() * ADVANCE) as f64 * scale
}

/// The distance of a point from a stroke, in dots.
fn distance([x, y]: [f64; 2], [from, to]: &Stroke) -> f64 {
    let [along_x, along_y] = [to[0] - from[0], to[1] - from[1]];
    let length = along_x * along_x + along_y * along_y;
    let along = ((x - from[0]) * along_x + (y - from[1]) * along_y) / length.max(f64::MIN_POSITIVE);
    let along = along.clamp(0.0, 1.0);
    (x - from[0] - along * along_x).hypot(y - from[1] - along * along_y)
}

/// The text of a caption with at most `most` characters.
pub(crate) fn caption_text(name: &str, note: &str, most: f64) -> String {
    let room = (most as usize).saturating_sub(note.chars().count() + 1);
    fitted(name, room) + note
}

/// The text, or two dots and its end if it has more than `most` characters.
fn fitted(text: &str, most: usize) -> String {
    let too_many = text.chars().count().saturating_sub(most);
    if too_many == 0 {
        return text.to_owned();
    }
    let end = text.chars().skip(too_many + 2);
    "..".chars().chain(end).take(most).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_has_rows_of_cells() {
        let cell = |width, height| Image {
            rgba: [7, 7, 7, 255].repeat(width * height),
            ..Image::white(width, height)
        };
        let sheet = Image::sheet(&[cell(4, 3), cell(2, 2), cell(4, 3)], 2);
        assert_eq!((sheet.width, sheet.height), (8, 6));
        let dark = |row: usize, column: usize| sheet.rgba[(row * 8 + column) * 4] == 7;
        assert!(
            dark(0, 0) && dark(1, 5) && !dark(2, 5) && !dark(1, 6) && dark(5, 3) && !dark(5, 4)
        );
        assert_eq!(Image::sheet(&[], 3).rgba.len(), 0);
        assert!(
            Image::sheet(&[cell(4, 3)], 1)
                .to_png()
                .unwrap()
                .starts_with(b"\x89PNG")
        );
    }

    #[test]
    fn captions_are_below_and_fit() {
        let plain = Image::white(120, 10);
        let image = plain.with_caption("ab", "", 1.0);
        assert!(image.height > 10 + HEIGHT && image.width == 120);
        let ink = image
            .rgba
            .chunks_exact(4)
            .position(|pixel| pixel[0] < 128)
            .unwrap();
        assert!(ink / 120 >= 10);
        assert_eq!(fitted("abcdef", 4), "..ef");
        assert_eq!(
            (fitted("abcdef", 1), fitted("abc", 3)),
            (".".to_owned(), "abc".to_owned())
        );
    }

    #[test]
    fn letters_are_smooth_on_any_background() {
        for background in ["white", "transparent", "#000000"] {
            let blank = Image::blank(60, 4, background.parse().unwrap());
            let image = blank.with_caption("", "So", 2.5);
            let ink = i32::from(blank.background.ink()[0]);
            let behind = i32::from(blank.rgba[0]);
            let opacity = |pixel: &[u8]| match background {
                "transparent" => f64::from(pixel[3]) / 255.0,
                _ => f64::from(i32::from(pixel[0]) - behind) / f64::from(ink - behind),
            };
            let inked: Vec<f64> = image.rgba.chunks_exact(4).map(opacity).collect();
            assert!(inked.contains(&1.0), "{background}");
            let n_between = inked.iter().filter(|&&part| 0.2 < part && part < 0.8);
            assert!(n_between.count() > 20, "{background}");
        }
    }

    #[test]
    fn transparent_pixels_survive_the_file() {
        let color = |image: &Image| {
            let bytes = image.to_png().unwrap();
            let reader = png::Decoder::new(std::io::Cursor::new(bytes));
            reader.read_info().unwrap().info().color_type
        };
        assert_eq!(color(&Image::white(2, 2)), png::ColorType::Rgb);
        let blank = Image::blank(2, 2, Background::Transparent);
        assert_eq!(color(&blank), png::ColorType::Rgba);
    }
}
