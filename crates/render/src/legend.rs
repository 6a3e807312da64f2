//! Makes legends, which explain the colors of a picture: one row per label with its color, its name, its size and its fraction of
//! the surface.

use crate::glyphs::HEIGHT;
use crate::image::text_width;
use crate::{FaceLabel, Image, MissingLayer, Rgb};
use partprobe_carrier::{Carrier, FaceType, ShapeKind};
use std::collections::BTreeMap;

/// The distance of two rows, in dots of the letters.
pub(crate) const ROW_DOTS: f64 = 12.0;
/// The side of a color's square, in dots.
pub(crate) const SWATCH_DOTS: f64 = 8.0;
/// The space between the picture and the legend, and between the color and the text, in dots.
pub(crate) const GAP_DOTS: f64 = 6.0;
/// Longer names are cut off.
const MAX_NAME: usize = 28;

/// A label in a legend.
#[derive(Clone, Debug, PartialEq)]
pub struct LegendRow {
    /// Its color.
    pub color: Rgb,
    /// Its name: its number and the primitive type of most of its surface, or the name in its file.
    pub name: String,
    /// The number of its faces, of its triangles in a mesh, or of its points in a cloud.
    pub n_elements: usize,
    /// Its fraction of the area, or of the points in a cloud.
    pub share: f64,
}

/// The rows of a legend. The largest fraction comes first.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// The name for a row: `part`, `type`, `face`, `label` or `color`.
    pub noun: &'static str,
    /// The name for the counted elements: `faces`, `triangles` or `points`.
    pub counted: &'static str,
    /// One row per label of a face.
    pub rows: Vec<LegendRow>,
}

impl Legend {
    /// The legend of a carrier's picture.
    ///
    /// # Errors
    /// If the carrier does not have the label layer.
    pub fn of(label: &FaceLabel, carrier: &Carrier) -> Result<Self, MissingLayer> {
        let labels = label.of_faces(carrier)?;
        let colors = label.colors_of_faces(carrier)?;
        let kind = carrier.kind();
        let faces = &carrier.graph().faces;
        let mut n_of_face = vec![usize::from(kind == ShapeKind::Brep); faces.len()];
        if kind != ShapeKind::Brep {
            let tri_face = carrier.mesh().tri_face.iter();
            tri_face.for_each(|&face| n_of_face[face as usize] += 1);
        }
        let size = |face: usize| match kind {
            ShapeKind::Cloud => n_of_face[face] as f64,
            _ => faces[face].area,
        };
        let mut faces_of: BTreeMap<i32, Vec<usize>> = BTreeMap::new();
        for (face, &label) in labels.iter().enumerate() {
            faces_of.entry(label).or_default().push(face);
        }
        let total: f64 = (0..faces.len()).map(size).sum();
        let row = |(&number, members): (&i32, &Vec<usize>)| LegendRow {
            color: colors[members[0]],
            name: name_of(label, carrier, number, members),
            n_elements: members.iter().map(|&face| n_of_face[face]).sum(),
            share: members.iter().map(|&face| size(face)).sum::<f64>()
                / total.max(f64::MIN_POSITIVE),
        };
        let mut rows: Vec<LegendRow> = faces_of.iter().map(row).collect();
        rows.retain(|row| row.n_elements > 0);
        // Rows with equal fractions stay in the order of their labels.
        rows.sort_by(|a, b| b.share.total_cmp(&a.share));
        Ok(Self {
            noun: label.noun(),
            counted: match kind {
                ShapeKind::Brep => "faces",
                ShapeKind::Mesh => "triangles",
                ShapeKind::Cloud => "points",
            },
            rows,
        })
    }

    /// The heading and at most `most` rows of three columns: name, count and fraction. The last row counts the labels without
    /// their own row.
    #[must_use]
    pub(crate) fn lines(&self, most: usize) -> Vec<LegendLine> {
        let mut lines = vec![LegendLine {
            color: None,
            cells: [self.noun, self.counted, "%"].map(str::to_owned),
        }];
        let n_shown = if self.rows.len() > most {
            most.saturating_sub(1)
        } else {
            self.rows.len()
        };
        let (shown, rest) = self.rows.split_at(n_shown);
        lines.extend(shown.iter().map(|row| LegendLine {
            color: Some(row.color),
            cells: [
                row.name.clone(),
                row.n_elements.to_string(),
                percent(row.share),
            ],
        }));
        if !rest.is_empty() {
            let n_elements: usize = rest.iter().map(|row| row.n_elements).sum();
            let share: f64 = rest.iter().map(|row| row.share).sum();
            lines.push(LegendLine {
                color: None,
                cells: [
                    format!("{} more", rest.len()),
                    n_elements.to_string(),
                    percent(share),
                ],
            });
        }
        lines
    }
}

/// A line of a written legend.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LegendLine {
    /// The color of its square. It is `None` for the heading and for the row of the remaining labels.
    pub(crate) color: Option<Rgb>,
    /// Name, count and fraction.
    pub(crate) cells: [String; 3],
}

/// The widths of the three columns, in characters.
pub(crate) fn column_widths(lines: &[LegendLine]) -> [usize; 3] {
    [0, 1, 2].map(|column| {
        let lengths = lines.iter().map(|line| line.cells[column].chars().count());
        lengths.max().unwrap_or(0)
    })
}

/// The number of rows that fit in a legend next to a picture of this height, without its heading.
pub(crate) fn rows_in(height: f64, scale: f64) -> usize {
    ((height / (ROW_DOTS * scale)) as usize)
        .saturating_sub(2)
        .max(1)
}

impl Image {
    /// The image with a legend at its right side, `scale` pixels per dot of a letter. It has as many rows as fit next to the
    /// image.
    #[must_use]
    pub fn with_legend(&self, legend: &Legend, scale: f64) -> Self {
        let lines = legend.lines(rows_in(self.height as f64, scale));
        let widths = column_widths(&lines);
        let text_of = |line: &LegendLine| {
            let [name, count, share] = &line.cells;
            let [name_width, count_width, share_width] = widths;
            format!("{name:name_width$}  {count:>count_width$}  {share:>share_width$}")
        };
        let texts: Vec<String> = lines.iter().map(text_of).collect();
        let longest = texts.iter().map(|text| text_width(text, scale));
        let text_left = (SWATCH_DOTS + 2.0 * GAP_DOTS) * scale;
        let width = text_left + longest.fold(0.0, f64::max) + GAP_DOTS * scale;
        let mut image = self.widened(width.ceil() as usize);
        let left = self.width as f64;
        let top = 0.5 * (self.height as f64 - ROW_DOTS * scale * lines.len() as f64).max(0.0);
        for (number, (line, text)) in lines.iter().zip(&texts).enumerate() {
            let top = top + ROW_DOTS * scale * number as f64;
            if let Some(color) = line.color {
                let side = SWATCH_DOTS * scale;
                image.fill_box([left + GAP_DOTS * scale, top, side, side], color);
            }
            let below = 0.5 * (SWATCH_DOTS - HEIGHT as f64 + 1.0) * scale;
            image.draw_text(text, [left + text_left, top + below], scale);
        }
        image
    }
}

fn percent(share: f64) -> String {
    format!("{:.1}", 100.0 * share)
}

fn name_of(label: &FaceLabel, carrier: &Carrier, number: i32, members: &[usize]) -> String {
    let faces = &carrier.graph().faces;
    let first = &faces[members[0]];
    let name = match label {
        _ if number < 0 => match label {
            FaceLabel::Cad => "no color".to_owned(),
            _ => "no label".to_owned(),
        },
        FaceLabel::Type => first.face_type.name().to_owned(),
        FaceLabel::Cad => first
            .color
            .map_or_else(String::new, |color| format!("#{:06x}", color.0 >> 8)),
        FaceLabel::Face if carrier.kind() == ShapeKind::Brep => {
            format!("#{} {}", first.step_id, first.face_type.name())
        }
        _ if carrier.kind() != ShapeKind::Brep => {
            first.name.clone().unwrap_or_else(|| number.to_string())
        }
        FaceLabel::Part | FaceLabel::RawPart => format!("{number} {}", main_type(carrier, members)),
        FaceLabel::Face | FaceLabel::Layer(_) => number.to_string(),
    };
    name.chars().take(MAX_NAME).collect()
}

/// The primitive type of most of the surface.
fn main_type(carrier: &Carrier, members: &[usize]) -> &'static str {
    let mut areas = [0.0; FaceType::ALL.len()];
    for &face in members {
        let face = &carrier.graph().faces[face];
        areas[usize::from(face.face_type.code())] += face.area;
    }
    let largest = (0..areas.len()).max_by(|&a, &b| areas[a].total_cmp(&areas[b]).then(b.cmp(&a)));
    largest.map_or("", |code| FaceType::ALL[code].name())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn legend(shares: &[f64]) -> Legend {
        let row = |(number, &share): (usize, &f64)| LegendRow {
            color: [number as u8; 3],
            name: format!("{number} plane"),
            n_elements: number + 1,
            share,
        };
        Legend {
            noun: "part",
            counted: "faces",
            rows: shares.iter().enumerate().map(row).collect(),
        }
    }

    #[test]
    fn what_has_no_row_is_counted() {
        let cells = |most: usize| -> Vec<String> {
            let lines = legend(&[0.5, 0.3, 0.125, 0.075]).lines(most);
            lines.iter().map(|line| line.cells.join(" ")).collect()
        };
        let all = [
            "part faces %",
            "0 plane 1 50.0",
            "1 plane 2 30.0",
            "2 plane 3 12.5",
            "3 plane 4 7.5",
        ];
        assert_eq!(cells(4), all);
        assert_eq!(
            cells(2),
            ["part faces %", "0 plane 1 50.0", "3 more 9 50.0"]
        );
    }

    #[test]
    fn a_legend_is_at_the_right_side() {
        let picture = Image::white(60, 60);
        let image = picture.with_legend(&legend(&[0.7, 0.3]), 1.0);
        assert!(image.width > 60 && image.height == 60);
        let inked = |from: usize, to: usize| {
            (0..60).any(|row| {
                (from..to).any(|column| image.rgba[(row * image.width + column) * 4] < 128)
            })
        };
        assert!(!inked(0, 60) && inked(60, image.width));
    }
}
