//! Draws charts as SVG: axes, ticks, lines, bars and cells. Colors are classes, so the style sheet of the page determines them.

mod axis;
mod bars;
mod cells;
mod drawing;
mod figure;
mod file_style;
mod lines;
mod rows;

pub(crate) use axis::{Axis, nice_ticks, tick_text};
pub(crate) use bars::Bars;
pub(crate) use cells::Cells;
pub(crate) use drawing::{Drawing, Entry};
pub use figure::Chart;
pub(crate) use figure::grid;
pub(crate) use lines::{Line, LineChart};
pub(crate) use rows::{IntervalRow, interval_rows};

/// The space of a chart on its left, right, top and bottom, in units of the view box.
pub(crate) const LEFT: f64 = 62.0;
pub(crate) const RIGHT: f64 = 14.0;
pub(crate) const TOP: f64 = 12.0;
pub(crate) const BOTTOM: f64 = 44.0;

/// The number of colors that the style sheet has for series. Further series use the same colors with dashes.
pub(crate) const N_COLORS: usize = 8;

/// The class of the series with this index.
fn series_class(idx: usize) -> String {
    format!(
        "s{}{}",
        idx % N_COLORS,
        if idx >= N_COLORS { " dashed" } else { "" }
    )
}

/// The class of a series, or the class without its own color.
pub(crate) fn class_of(color: Option<usize>) -> String {
    color.map_or_else(|| "plain".to_owned(), series_class)
}
