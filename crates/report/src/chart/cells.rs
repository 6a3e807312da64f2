//! Draws a matrix of fractions as cells. Each cell shows its number, and larger fractions are darker.

use super::Drawing;
use crate::html::escaped;
use std::fmt::Write as _;

const CELL: [f64; 2] = [56.0, 30.0];
const NAMES: f64 = 92.0;
const HEADS: f64 = 34.0;

/// A matrix of fractions from 0 to 1.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cells {
    pub(crate) rows: Vec<String>,
    pub(crate) columns: Vec<String>,
    /// The fractions row by row. `None` is an empty cell.
    pub(crate) shares: Vec<Option<f64>>,
    /// The label of the columns.
    pub(crate) column_label: String,
    /// The number of columns, from the left, in which large fractions are good.
    pub(crate) n_good: usize,
}

impl Cells {
    /// Draws the matrix. Returns `None` if it has no row.
    pub(crate) fn draw(&self) -> Option<Drawing> {
        if self.rows.is_empty() || self.columns.is_empty() {
            return None;
        }
        let [width, height] = [
            NAMES + CELL[0] * self.columns.len() as f64 + 4.0,
            HEADS + CELL[1] * self.rows.len() as f64 + 4.0,
        ];
        let mut svg = String::new();
        for (idx, column) in self.columns.iter().enumerate() {
            let _ = write!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" class=\"mid\">{}</text>",
                NAMES + CELL[0] * (idx as f64 + 0.5),
                HEADS - 10.0,
                escaped(column)
            );
        }
        for (row, name) in self.rows.iter().enumerate() {
            let y = HEADS + CELL[1] * row as f64;
            let _ = write!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" class=\"end\">{}</text>",
                NAMES - 8.0,
                y + 19.0,
                escaped(name)
            );
            for (column, share) in self.row(row).iter().enumerate() {
                svg.push_str(&self.cell(column, y, *share));
            }
        }
        Some(Drawing {
            size: [width, height],
            label: self.column_label.clone(),
            attributes: format!(" style=\"max-width:{width}px\" class=\"cells\""),
            body: svg,
        })
    }

    fn row(&self, row: usize) -> &[Option<f64>] {
        let n = self.columns.len();
        self.shares.get(row * n..(row + 1) * n).unwrap_or_default()
    }

    fn cell(&self, column: usize, y: f64, share: Option<f64>) -> String {
        let Some(share) = share else {
            return String::new();
        };
        let x = NAMES + CELL[0] * column as f64;
        let class = if column < self.n_good { "good" } else { "bad" };
        // A fraction is drawn by its opacity. The square root makes small fractions visible.
        let opacity = 0.06 + 0.84 * share.clamp(0.0, 1.0).sqrt();
        let percent = 100.0 * share;
        let text = match percent {
            percent if percent < 0.05 => "·".to_owned(),
            percent if percent < 9.95 => format!("{percent:.1}"),
            percent => format!("{percent:.0}"),
        };
        let strong = if opacity > 0.62 { " on" } else { "" };
        format!(
            "<rect class=\"{class}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"3\" fill-opacity=\"{opacity:.2}\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" class=\"mid{strong}\">{text}</text>",
            x + 1.0,
            y + 1.0,
            CELL[0] - 2.0,
            CELL[1] - 2.0,
            x + 0.5 * CELL[0],
            y + 19.0
        )
    }
}
