//! Defines pictures of areas, lines and texts, which are sharp at any size, and joins them to sheets with captions and legends.

use crate::helvetica::text_width;
use crate::image::caption_text;
use crate::legend::{GAP_DOTS, Legend, ROW_DOTS, SWATCH_DOTS, rows_in};
use crate::{Background, Rgb};

/// The size of letters, in dots of the typeface of images.
const FONT_DOTS: f64 = 9.5;
/// The distance from the top of a line of text to its baseline, in dots.
const BASELINE_DOTS: f64 = 7.5;
/// The height of a caption, in dots.
const CAPTION_DOTS: f64 = 14.0;
/// The mean width of a letter relative to the size of letters. It determines the number of shown letters of a long name.
const MEAN_LETTER: f64 = 0.55;

/// A picture of areas, lines and texts. Its units are the pixels of an SVG file and the points of a PDF file.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// The width.
    pub width: f64,
    /// The height.
    pub height: f64,
    /// The background of the picture.
    pub(crate) background: Background,
    /// The drawn items, in painting order.
    pub(crate) items: Vec<Item>,
}

/// A point of a picture: its distances to the right and down from the upper left corner.
pub(crate) type Spot = [f64; 2];

/// An item of a drawing.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Item {
    /// Areas of one color, each with its border. Borders in the opposite direction are holes.
    Fill {
        /// The color.
        color: Rgb,
        /// The borders. The first point of a border is not repeated at its end.
        borders: Vec<Vec<Spot>>,
    },
    /// Lines of one color.
    Lines {
        /// The color.
        color: Rgb,
        /// The width.
        width: f64,
        /// Each line, point by point. A line that returns to its first point is closed.
        lines: Vec<Vec<Spot>>,
    },
    /// A text.
    Text {
        /// The content of the text.
        text: String,
        /// A point of the baseline of the text.
        at: Spot,
        /// The place of this point along the text.
        anchor: Anchor,
        /// The size of the letters.
        size: f64,
        /// The color.
        color: Rgb,
    },
}

/// The place along a text that is at the given point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    /// The left end.
    Start,
    /// The middle.
    Middle,
    /// The right end.
    End,
}

impl Anchor {
    /// The fraction of the text to the left of the point.
    pub(crate) fn share_before(self) -> f64 {
        match self {
            Self::Start => 0.0,
            Self::Middle => 0.5,
            Self::End => 1.0,
        }
    }
}

impl Item {
    fn moved(&self, [right, down]: Spot) -> Self {
        let point = |[x, y]: Spot| [x + right, y + down];
        let paths = |paths: &[Vec<Spot>]| -> Vec<Vec<Spot>> {
            let moved = |path: &Vec<Spot>| path.iter().copied().map(point).collect();
            paths.iter().map(moved).collect()
        };
        let mut item = self.clone();
        match &mut item {
            Self::Fill { borders, .. } => *borders = paths(borders),
            Self::Lines { lines, .. } => *lines = paths(lines),
            Self::Text { at, .. } => *at = point(*at),
        }
        item
    }
}

impl Drawing {
    /// An empty drawing.
    pub(crate) fn blank(width: f64, height: f64, background: Background) -> Self {
        Self {
            width,
            height,
            background,
            items: Vec::new(),
        }
    }

    /// Drawings in rows of `columns`, on the background of the first one. Each cell is as large as the largest drawing.
    #[must_use]
    pub fn sheet(drawings: &[Self], columns: usize) -> Self {
        let largest = |side: fn(&Self) -> f64| drawings.iter().map(side).fold(0.0, f64::max);
        let (cell_width, cell_height) = (
            largest(|drawing| drawing.width),
            largest(|drawing| drawing.height),
        );
        let columns = columns.clamp(1, drawings.len().max(1));
        let background = drawings.first().map(|drawing| drawing.background);
        let mut sheet = Self::blank(
            cell_width * columns as f64,
            cell_height * drawings.len().div_ceil(columns) as f64,
            background.unwrap_or_default(),
        );
        for (cell, drawing) in drawings.iter().enumerate() {
            let corner = [
                (cell % columns) as f64 * cell_width,
                (cell / columns) as f64 * cell_height,
            ];
            let moved = drawing.items.iter().map(|item| item.moved(corner));
            sheet.items.extend(moved);
        }
        sheet
    }

    /// The drawing with `name` and `note` in a line below it, centered. `scale` is the same as in images.
    #[must_use]
    pub fn with_caption(&self, name: &str, note: &str, scale: f64) -> Self {
        let size = FONT_DOTS * scale;
        let text = caption_text(name, note, self.width / (MEAN_LETTER * size));
        let mut drawing = self.clone();
        let baseline = self.height + (2.0 + BASELINE_DOTS) * scale;
        drawing.write(text, [0.5 * self.width, baseline], Anchor::Middle, size);
        drawing.height += CAPTION_DOTS * scale;
        drawing
    }

    /// The drawing with a legend at its right side. It has as many rows as fit next to the drawing.
    #[must_use]
    pub fn with_legend(&self, legend: &Legend, scale: f64) -> Self {
        let size = FONT_DOTS * scale;
        let lines = legend.lines(rows_in(self.height, scale));
        let widths = [0, 1, 2].map(|column| {
            let cells = lines.iter().map(|line| &line.cells[column]);
            cells.fold(0.0, |width: f64, cell| width.max(text_width(cell, size)))
        });
        let mut drawing = self.clone();
        let left = self.width + GAP_DOTS * scale;
        let name_left = left + (SWATCH_DOTS + GAP_DOTS) * scale;
        let gap = 2.0 * GAP_DOTS * scale;
        let count_right = name_left + widths[0] + gap + widths[1];
        let share_right = count_right + gap + widths[2];
        let top = 0.5 * (self.height - ROW_DOTS * scale * lines.len() as f64).max(0.0);
        for (number, line) in lines.into_iter().enumerate() {
            let top = top + ROW_DOTS * scale * number as f64;
            if let Some(color) = line.color {
                let side = SWATCH_DOTS * scale;
                let (right, below) = (left + side, top + side);
                drawing.items.push(Item::Fill {
                    color,
                    borders: vec![vec![
                        [left, top],
                        [right, top],
                        [right, below],
                        [left, below],
                    ]],
                });
            }
            let baseline = top + BASELINE_DOTS * scale;
            let [name, count, share] = line.cells;
            drawing.write(name, [name_left, baseline], Anchor::Start, size);
            drawing.write(count, [count_right, baseline], Anchor::End, size);
            drawing.write(share, [share_right, baseline], Anchor::End, size);
        }
        drawing.width = share_right + GAP_DOTS * scale;
        drawing
    }

    fn write(&mut self, text: String, at: Spot, anchor: Anchor, size: f64) {
        let color = self.background.ink();
        self.items.push(Item::Text {
            text,
            at,
            anchor,
            size,
            color,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(width: f64, height: f64) -> Drawing {
        let mut cell = Drawing::blank(width, height, Background::White);
        cell.items.push(Item::Fill {
            color: [1; 3],
            borders: vec![vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]],
        });
        cell
    }

    #[test]
    fn a_sheet_has_rows_of_cells() {
        let sheet = Drawing::sheet(&[cell(4.0, 3.0), cell(2.0, 2.0), cell(4.0, 3.0)], 2);
        assert_eq!((sheet.width, sheet.height), (8.0, 6.0));
        let corner = |item: &Item| match item {
            Item::Fill { borders, .. } => borders[0][0],
            _ => panic!("not an area"),
        };
        let corners: Vec<Spot> = sheet.items.iter().map(corner).collect();
        assert_eq!(corners, [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]]);
        assert!(Drawing::sheet(&[], 3).items.is_empty());
    }

    #[test]
    fn captions_are_centered_below() {
        let drawing = cell(120.0, 10.0).with_caption("ab", "", 1.0);
        assert!(drawing.height > 10.0 + FONT_DOTS && drawing.width == 120.0);
        let Some(Item::Text {
            at: [x, y], anchor, ..
        }) = drawing.items.last()
        else {
            panic!("no text");
        };
        assert!(*x == 60.0 && *anchor == Anchor::Middle && *y > 10.0);
    }
}
