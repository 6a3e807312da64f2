//! Draws one row per name: a mean as a dot, its interval as a line, and single values as small marks.

use super::{Axis, Drawing, class_of, nice_ticks, tick_text};
use crate::html::escaped;
use std::fmt::Write as _;

const WIDTH: f64 = 820.0;
/// The space for the names.
const NAMES: f64 = 235.0;
/// The space for the numbers.
const NUMBERS: f64 = 150.0;
const ROW: f64 = 26.0;

/// One row.
#[derive(Clone, Debug, Default)]
pub(crate) struct IntervalRow {
    pub(crate) name: String,
    pub(crate) mean: f64,
    pub(crate) interval: Option<[f64; 2]>,
    /// The single values behind the mean.
    pub(crate) values: Vec<f64>,
    /// The index of the color. Rows without a training have none.
    pub(crate) color: Option<usize>,
}

/// Draws the rows over an axis from 0 to 1, which has a label. Returns `None` without rows.
pub(crate) fn interval_rows(rows: &[IntervalRow], label: &str) -> Option<Drawing> {
    if rows.is_empty() {
        return None;
    }
    let bottom = 8.0 + ROW * rows.len() as f64;
    let height = bottom + 40.0;
    let axis = Axis {
        low: 0.0,
        high: 1.0,
        from: NAMES,
        to: WIDTH - NUMBERS,
    };
    let mut svg = String::new();
    let ticks = nice_ticks(0.0, 1.0, 5);
    for &tick in &ticks {
        let x = axis.at(tick);
        let _ = write!(
            svg,
            "<path class=\"grid\" d=\"M{x:.1} 4V{bottom:.1}\"/><text x=\"{x:.1}\" y=\"{:.1}\" class=\"mid\">{}</text>",
            bottom + 16.0,
            tick_text(tick, &ticks)
        );
    }
    for (idx, row) in rows.iter().enumerate() {
        svg.push_str(&row_svg(row, &axis, 8.0 + ROW * (idx as f64 + 0.5)));
    }
    let _ = writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" class=\"mid label\">{}</text>",
        0.5 * (axis.from + axis.to),
        bottom + 34.0,
        escaped(label)
    );
    Some(Drawing {
        size: [WIDTH, height],
        label: label.to_owned(),
        attributes: " class=\"wide\"".to_owned(),
        body: svg,
    })
}

fn row_svg(row: &IntervalRow, axis: &Axis, y: f64) -> String {
    let class = class_of(row.color);
    let mut svg = format!(
        "<text x=\"{:.1}\" y=\"{:.1}\" class=\"end name\">{}</text>",
        NAMES - 12.0,
        y + 4.0,
        escaped(&row.name)
    );
    for &value in &row.values {
        let x = axis.at(value);
        let _ = write!(
            svg,
            "<path class=\"rug {class}\" d=\"M{x:.1} {:.1}v8\"/>",
            y - 4.0
        );
    }
    let mut numbers = format!("{:.3}", row.mean);
    if let Some([low, high]) = row.interval {
        let _ = write!(
            svg,
            "<path class=\"bar {class}\" d=\"M{:.1} {y:.1}H{:.1}\"/>",
            axis.at(low),
            axis.at(high)
        );
        let _ = write!(numbers, " [{low:.3}, {high:.3}]");
    }
    let _ = write!(
        svg,
        "<circle class=\"dot {class}\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"5\"/><text x=\"{:.1}\" y=\"{:.1}\">{numbers}</text>",
        axis.at(row.mean),
        axis.to + 10.0,
        y + 4.0
    );
    svg
}
