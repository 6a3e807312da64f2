//! Plots accuracy against the distance to the nearest reference border and against the local thickness, one line per
//! source.

use super::colors::color;
use partprobe_calibration::plot::{Panel, opening, text};
use partprobe_eval::{AgreementTable, CurvePoint};
use std::fmt::Write as _;

/// The accuracy against the distance to the nearest border.
pub(super) fn distance_svg(tables: &[&AgreementTable]) -> String {
    curve_svg(
        tables,
        "Accuracy by distance to the nearest reference border, % of the diagonal",
        |table| &table.by_distance,
    )
}

/// The accuracy against the local thickness.
pub(super) fn thickness_svg(tables: &[&AgreementTable]) -> String {
    curve_svg(
        tables,
        "Accuracy by local thickness, % of the diagonal",
        |table| &table.by_thickness,
    )
}

/// Bins are at equal distances, because their limits double from one to the next.
fn curve_svg(
    tables: &[&AgreementTable],
    title: &str,
    points_of: fn(&AgreementTable) -> &Vec<CurvePoint>,
) -> String {
    let mut svg = opening(760.0, 360.0);
    let n_bins = tables.first().map_or(1, |table| points_of(table).len());
    let panel = Panel {
        left: 60.0,
        top: 44.0,
        width: 520.0,
        height: 250.0,
        x: (0.0, n_bins as f64),
        y: (0.0, 1.0),
    };
    svg.push_str(&text(60.0, 24.0, "font-size=\"14\"", title));
    for (idx, table) in tables.iter().enumerate() {
        svg.push_str(&line(&panel, points_of(table), color(idx)));
        let fill = format!("fill=\"{}\"", color(idx));
        svg.push_str(&text(600.0, 60.0 + 18.0 * idx as f64, &fill, &table.source));
    }
    let limits = tables.first().map(|table| points_of(table).as_slice());
    for (bin, point) in limits.unwrap_or_default().iter().enumerate() {
        let label = match point.to {
            Some(to) => format!("≤ {}", 100.0 * to),
            None => format!("> {}", 100.0 * point.from),
        };
        svg.push_str(&panel.tick_x(bin as f64 + 0.5, &label));
    }
    for value in [0.0, 0.25, 0.5, 0.75, 1.0] {
        svg.push_str(&panel.tick_y(value, &format!("{value:.2}")));
    }
    svg.push_str(&panel.axes());
    svg.push_str("</svg>\n");
    svg
}

fn line(panel: &Panel, points: &[CurvePoint], color: &str) -> String {
    let mean = |(bin, point): (usize, &CurvePoint)| Some((bin as f64 + 0.5, point.accuracy?.mean));
    let means: Vec<(f64, f64)> = points.iter().enumerate().filter_map(mean).collect();
    let mut svg = panel.line(&means, &format!("stroke=\"{color}\" stroke-width=\"1.5\""));
    for &(x, y) in &means {
        let (x, y) = (panel.pixel_x(x), panel.pixel_y(y));
        let _ = writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"{color}\"/>"
        );
    }
    svg
}
