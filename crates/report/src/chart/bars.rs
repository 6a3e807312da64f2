//! Draws histograms: the fraction of values in each bin, as bars of one series.

use super::{Axis, BOTTOM, Drawing, LEFT, RIGHT, class_of};
use crate::html::escaped;
use std::fmt::Write as _;

const WIDTH: f64 = 380.0;
const HEIGHT: f64 = 180.0;

/// A histogram.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bars {
    pub(crate) x_label: String,
    pub(crate) y_label: String,
    /// The label of each bar, and its height.
    pub(crate) bars: Vec<(String, f64)>,
    /// A mark on the horizontal axis as a position counted in bars, with its text.
    pub(crate) mark: Option<(f64, String)>,
    /// Whether the labels name the left edges of the bars, and not the bars themselves.
    pub(crate) labels_at_edges: bool,
    /// The index of the color, or `None` for gray.
    pub(crate) color: Option<usize>,
}

impl Bars {
    /// Draws the histogram. Returns `None` if no bar has a height.
    pub(crate) fn draw(&self) -> Option<Drawing> {
        let highest = self.bars.iter().map(|bar| bar.1).fold(0.0, f64::max);
        if highest <= 0.0 {
            return None;
        }
        let x = Axis::horizontal(0.0, self.bars.len() as f64, WIDTH);
        let y = Axis::vertical(0.0, 1.08 * highest, HEIGHT);
        let mut svg = y.vertical_svg(WIDTH - RIGHT, &self.y_label);
        let width = (x.at(1.0) - x.at(0.0) - 2.0).max(1.0);
        // At most half a dozen labels fit into a narrow window.
        let every = self.bars.len().div_ceil(6);
        for (idx, (label, value)) in self.bars.iter().enumerate() {
            let (left, top) = (x.at(idx as f64) + 1.0, y.at(*value));
            let _ = write!(
                svg,
                "<rect class=\"column {}\" x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{:.1}\"><title>{}: {value}</title></rect>",
                class_of(self.color),
                y.from - top,
                escaped(label)
            );
            if idx % every == 0 {
                let at = if self.labels_at_edges {
                    left - 1.0
                } else {
                    left + 0.5 * width
                };
                let _ = write!(
                    svg,
                    "<text x=\"{at:.1}\" y=\"{:.1}\" class=\"mid\">{}</text>",
                    y.from + 17.0,
                    escaped(label)
                );
            }
        }
        svg.push_str(&self.mark_svg(&x, &y));
        let _ = writeln!(
            svg,
            "<path class=\"axis\" d=\"M{LEFT} {0:.1}H{1:.1}\"/><text x=\"{2:.1}\" y=\"{3:.1}\" class=\"mid label\">{4}</text>",
            HEIGHT - BOTTOM,
            WIDTH - RIGHT,
            0.5 * (LEFT + WIDTH - RIGHT),
            HEIGHT - 8.0,
            escaped(&self.x_label)
        );
        Some(Drawing {
            size: [WIDTH, HEIGHT],
            label: format!("{} by {}", self.y_label, self.x_label),
            attributes: String::new(),
            body: svg,
        })
    }

    fn mark_svg(&self, x: &Axis, y: &Axis) -> String {
        let Some((at, text)) = &self.mark else {
            return String::new();
        };
        let at = x.at(*at);
        // The text is on the side that has more space.
        let (offset, class) = if at < 0.6 * WIDTH {
            (5.0, "")
        } else {
            (-5.0, "end")
        };
        format!(
            "<path class=\"mark\" d=\"M{at:.1} {:.1}V{:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\" class=\"{class} strong\">{}</text>",
            y.from,
            y.to,
            at + offset,
            y.to + 10.0,
            escaped(text)
        )
    }
}
