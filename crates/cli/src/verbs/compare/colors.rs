//! Defines the colors of the sources in figures, and the places of several panels.

use partprobe_calibration::plot::Panel;

/// Colors that most color-blind readers can distinguish on white (Okabe and Ito 2008), and then grays.
const COLORS: [&str; 8] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#888888",
];

/// The number of panels in a row of a figure.
const PANELS_IN_ROW: usize = 3;
/// The width and height of a panel with its labels.
const CELL: [f64; 2] = [300.0, 250.0];

/// The color of the source at this index.
pub(super) fn color(idx: usize) -> &'static str {
    COLORS[idx % COLORS.len()]
}

/// The width and height of a figure with this number of panels.
pub(super) fn size(n_panels: usize) -> [f64; 2] {
    let n_columns = n_panels.clamp(1, PANELS_IN_ROW);
    let n_rows = n_panels.div_ceil(PANELS_IN_ROW).max(1);
    [
        CELL[0] * n_columns as f64 + 20.0,
        CELL[1] * n_rows as f64 + 20.0,
    ]
}

/// The panel at an index of a figure, with these values at its sides.
pub(super) fn panel(idx: usize, x: (f64, f64), y: (f64, f64)) -> Panel {
    let (row, column) = (idx / PANELS_IN_ROW, idx % PANELS_IN_ROW);
    Panel {
        left: 60.0 + CELL[0] * column as f64,
        top: 40.0 + CELL[1] * row as f64,
        width: CELL[0] - 70.0,
        height: CELL[1] - 90.0,
        x,
        y,
    }
}
