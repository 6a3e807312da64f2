//! Holds RGB images, joins them to sheets, writes text on them, and makes PNG files of them.

use crate::glyphs::{ADVANCE, HEIGHT, WIDTH, glyph};

/// The color of captions.
const INK: [u8; 3] = [40; 3];

/// An RGB image, three bytes a pixel, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height * 3` bytes.
    pub rgb: Vec<u8>,
}

impl Image {
    /// A white image.
    #[must_use]
    pub fn white(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            rgb: vec![255; width * height * 3],
        }
    }

    pub(crate) fn set(&mut self, row: usize, column: usize, color: [u8; 3]) {
        let start = (row * self.width + column) * 3;
        self.rgb[start..start + 3].copy_from_slice(&color);
    }

    /// Draws another image over this one; what would stand outside is cut off.
    fn draw(&mut self, other: &Self, top: usize, left: usize) {
        let width = other.width.min(self.width.saturating_sub(left));
        for row in 0..other.height.min(self.height.saturating_sub(top)) {
            let from = row * other.width * 3;
            let to = ((top + row) * self.width + left) * 3;
            self.rgb[to..to + width * 3].copy_from_slice(&other.rgb[from..from + width * 3]);
        }
    }

    /// Images in rows of `columns` on a white sheet; each cell is as large as the largest image.
    #[must_use]
    pub fn sheet(images: &[Self], columns: usize) -> Self {
        let largest = |side: fn(&Self) -> usize| images.iter().map(side).max().unwrap_or(0);
        let (cell_width, cell_height) =
            (largest(|image| image.width), largest(|image| image.height));
        let columns = columns.clamp(1, images.len().max(1));
        let mut sheet = Self::white(
            cell_width * columns,
            cell_height * images.len().div_ceil(columns),
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

    /// The image with `name` and `note` in a line below it, centered, `scale` pixels a dot.
    ///
    /// A name that is too long loses its beginning: what tells files apart stands at the end.
    #[must_use]
    pub fn with_caption(&self, name: &str, note: &str, scale: usize) -> Self {
        let scale = scale.max(1);
        let room = (self.width / (ADVANCE * scale)).saturating_sub(note.chars().count() + 1);
        let text = fitted(name, room) + note;
        let text_width = text.chars().count() * ADVANCE * scale;
        let mut image = Self::white(self.width, self.height + (HEIGHT + 6) * scale);
        image.draw(self, 0, 0);
        let (top, mut left) = (
            self.height + scale,
            self.width.saturating_sub(text_width) / 2,
        );
        for character in text.chars() {
            image.draw_glyph(character, top, left, scale);
            left += ADVANCE * scale;
        }
        image
    }

    fn draw_glyph(&mut self, character: char, top: usize, left: usize, scale: usize) {
        let dots = glyph(character);
        for (row, column) in (0..HEIGHT).flat_map(|row| (0..WIDTH).map(move |column| (row, column)))
        {
            if dots[row] >> (WIDTH - 1 - column) & 1 == 0 {
                continue;
            }
            for (down, right) in
                (0..scale).flat_map(|down| (0..scale).map(move |right| (down, right)))
            {
                let (y, x) = (top + row * scale + down, left + column * scale + right);
                if y < self.height && x < self.width {
                    self.set(y, x, INK);
                }
            }
        }
    }

    /// The image as a PNG file.
    ///
    /// # Errors
    /// If the image is empty or too large for the format.
    pub fn to_png(&self) -> Result<Vec<u8>, PngError> {
        let mut bytes = Vec::new();
        let mut encoder =
            png::Encoder::new(&mut bytes, png_side(self.width)?, png_side(self.height)?);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// Why an image cannot be written as PNG.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PngError {
    /// A side has more pixels than the format can say.
    #[error("an image with a side of {0} pixels is too large for PNG")]
    TooLarge(usize),
    /// The encoder refused the image, for example because it is empty.
    #[error(transparent)]
    Encoding(#[from] png::EncodingError),
}

fn png_side(n_pixels: usize) -> Result<u32, PngError> {
    u32::try_from(n_pixels).map_err(|_| PngError::TooLarge(n_pixels))
}

/// The text, or two dots and its end where there is room for no more than `most` characters.
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
            rgb: vec![7; width * height * 3],
            ..Image::white(width, height)
        };
        let sheet = Image::sheet(&[cell(4, 3), cell(2, 2), cell(4, 3)], 2);
        assert_eq!((sheet.width, sheet.height), (8, 6));
        let dark = |row: usize, column: usize| sheet.rgb[(row * 8 + column) * 3] == 7;
        assert!(
            dark(0, 0) && dark(1, 5) && !dark(2, 5) && !dark(1, 6) && dark(5, 3) && !dark(5, 4)
        );
        assert_eq!(Image::sheet(&[], 3).rgb.len(), 0);
        assert!(
            Image::sheet(&[cell(4, 3)], 1)
                .to_png()
                .unwrap()
                .starts_with(b"\x89PNG")
        );
    }

    #[test]
    fn captions_stand_below_and_fit() {
        let plain = Image::white(120, 10);
        let image = plain.with_caption("ab", "", 1);
        assert!(image.height > 10 + HEIGHT && image.width == 120);
        let ink = image
            .rgb
            .chunks_exact(3)
            .position(|pixel| pixel == INK)
            .unwrap();
        assert!(ink / 120 >= 10);
        assert_eq!(fitted("abcdef", 4), "..ef");
        assert_eq!(
            (fitted("abcdef", 1), fitted("abc", 3)),
            (".".to_owned(), "abc".to_owned())
        );
    }
}
