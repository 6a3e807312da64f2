//! Draws lines over a common axis, with bands or with error bars.

use super::{Axis, BOTTOM, Drawing, RIGHT, TOP, series_class};
use crate::html::escaped;
use std::fmt::Write as _;

/// The size of the view box.
const WIDTH: f64 = 380.0;
const HEIGHT: f64 = 226.0;

/// One line of a chart.
#[derive(Clone, Debug, Default)]
pub(crate) struct Line {
    pub(crate) name: String,
    /// The index of its color.
    pub(crate) color: usize,
    /// Values by position.
    pub(crate) points: Vec<(f64, f64)>,
    /// The low and the high value at positions: a band behind the line.
    pub(crate) band: Vec<(f64, [f64; 2])>,
    /// The same, as error bars. The points are marked.
    pub(crate) bars: Vec<(f64, [f64; 2])>,
}

/// A chart of several lines.
#[derive(Clone, Debug, Default)]
pub(crate) struct LineChart {
    pub(crate) x_label: String,
    pub(crate) y_label: String,
    pub(crate) lines: Vec<Line>,
    /// Whether the vertical axis begins at 0.
    pub(crate) from_zero: bool,
}

impl LineChart {
    /// Draws the chart. Returns `None` if no line has a point.
    pub(crate) fn draw(&self) -> Option<Drawing> {
        let points = || self.lines.iter().flat_map(|line| &line.points);
        let [x_low, x_high] = range(points().map(|point| point.0))?;
        let bars = self.lines.iter().flat_map(|line| &line.bars);
        let values = points()
            .map(|point| point.1)
            .chain(bars.flat_map(|bar| bar.1));
        let [mut y_low, mut y_high] = range(values)?;
        if self.from_zero {
            (y_low, y_high) = (y_low.min(0.0), y_high.max(0.0));
        }
        let margin = 0.06 * (y_high - y_low);
        y_high += margin;
        if y_low != 0.0 {
            y_low -= margin;
        }
        let x = Axis::horizontal(x_low, x_high, WIDTH);
        let y = Axis::vertical(y_low, y_high, HEIGHT);

        let attributes = format!(
            " class=\"lines\" data-x=\"{} {} {} {}\" data-y=\"{} {} {} {}\"",
            x.low, x.high, x.from, x.to, y.low, y.high, y.from, y.to,
        );
        let mut svg = y.vertical_svg(WIDTH - RIGHT, &self.y_label);
        svg.push_str(&x.horizontal_svg(HEIGHT - BOTTOM, &self.x_label));
        for line in &self.lines {
            svg.push_str(&line.to_svg(&x, &y));
        }
        let _ = writeln!(
            svg,
            "<path class=\"cross\" d=\"M0 {TOP}V{:.1}\" visibility=\"hidden\"/>",
            HEIGHT - BOTTOM
        );
        Some(Drawing {
            size: [WIDTH, HEIGHT],
            label: format!("{} by {}", self.y_label, self.x_label),
            attributes,
            body: svg,
        })
    }
}

impl Line {
    fn to_svg(&self, x: &Axis, y: &Axis) -> String {
        let class = series_class(self.color);
        let mut svg = String::new();
        if !self.band.is_empty() {
            let high = self.band.iter().map(|&(at, [_, high])| (at, high));
            let low = self.band.iter().rev().map(|&(at, [low, _])| (at, low));
            let outline = path(high.chain(low), x, y);
            let _ = write!(
                svg,
                "<polygon class=\"band {class}\" points=\"{outline}\"/>"
            );
        }
        for &(at, [low, high]) in &self.bars {
            let (at, low, high) = (x.at(at), y.at(low), y.at(high));
            let _ = write!(
                svg,
                "<path class=\"bar {class}\" d=\"M{at:.1} {low:.1}V{high:.1}M{:.1} {low:.1}h8M{:.1} {high:.1}h8\"/>",
                at - 4.0,
                at - 4.0
            );
        }
        let _ = write!(
            svg,
            "<polyline class=\"line {class}\" data-name=\"{}\" points=\"{}\"/>",
            escaped(&self.name),
            path(self.points.iter().copied(), x, y)
        );
        // A single point has no line, and points with bars are few.
        if self.points.len() == 1 || !self.bars.is_empty() {
            for &(at, value) in &self.points {
                let _ = write!(
                    svg,
                    "<circle class=\"dot {class}\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.5\"/>",
                    x.at(at),
                    y.at(value)
                );
            }
        }
        svg
    }
}

fn path(points: impl Iterator<Item = (f64, f64)>, x: &Axis, y: &Axis) -> String {
    let each = points.map(|(at, value)| format!("{:.1},{:.1}", x.at(at), y.at(value)));
    each.collect::<Vec<_>>().join(" ")
}

/// The smallest and the largest of the finite values. Returns `None` if no value is finite.
fn range(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.filter(|value| value.is_finite()).fold(
        None,
        |range: Option<[f64; 2]>, value| match range {
            None => Some([value, value]),
            Some([low, high]) => Some([low.min(value), high.max(value)]),
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_has_axes_and_a_line_per_series_or_is_empty() {
        let line = |points: &[(f64, f64)]| Line {
            name: "a<b".to_owned(),
            points: points.to_vec(),
            ..Line::default()
        };
        let chart = |lines| LineChart {
            x_label: "update".to_owned(),
            y_label: "loss".to_owned(),
            lines,
            from_zero: false,
        };
        let drawing = chart(vec![line(&[(0.0, 1.0), (10.0, 2.0)]), line(&[(5.0, 1.5)])]).draw();
        let svg = drawing.unwrap().to_svg();
        assert_eq!(svg.matches("<polyline").count(), 2);
        assert_eq!(svg.matches("<circle").count(), 1);
        assert!(svg.contains(">update</text>") && svg.contains(">loss</text>"));
        assert!(svg.contains("a&lt;b") && !svg.contains("NaN"));
        assert!(chart(vec![line(&[])]).draw().is_none());
        assert!(chart(vec![line(&[(0.0, f64::NAN)])]).draw().is_none());
    }
}
