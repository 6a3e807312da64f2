//! Plots the sweep over θ. Each statistic has a panel with the mean as a line and the quartiles as a band. The last panel
//! shows the fraction of changed partitions.

use crate::plot::{COLORS, Panel, opening, text};
use crate::{CalibrationTables, Quartiles, SweepRow};
use std::fmt::Write as _;

/// The statistic that a panel shows.
struct Statistic {
    title: &'static str,
    of: fn(&SweepRow) -> Quartiles,
}

const STATISTICS: [Statistic; 5] = [
    Statistic {
        title: "parts P",
        of: |row| row.n_parts,
    },
    Statistic {
        title: "sharpness S, degrees",
        of: |row| row.sharpness_deg,
    },
    Statistic {
        title: "deviation D, degrees",
        of: |row| row.deviation_deg,
    },
    Statistic {
        title: "entropy H",
        of: |row| row.entropy,
    },
    Statistic {
        title: "changed, % of shapes",
        of: |row| single(100.0 * row.changed),
    },
];

/// Draws one panel per statistic, as the text of an SVG file.
#[must_use]
pub fn sweep_svg(tables: &CalibrationTables) -> String {
    let mut svg = opening(STATISTICS.len() as f64 * 220.0 + 20.0, 260.0);
    let rows = &tables.sweep;
    if let (Some(first), Some(last)) = (rows.first(), rows.last()) {
        // A single threshold has no range, so the axis is one degree long with the threshold in its middle.
        let margin = if first.theta_deg < last.theta_deg {
            0.0
        } else {
            0.5
        };
        let x = (first.theta_deg - margin, last.theta_deg + margin);
        for (idx, statistic) in STATISTICS.iter().enumerate() {
            svg.push_str(&panel(statistic, rows, x, 20.0 + 220.0 * idx as f64));
        }
    }
    svg.push_str("</svg>\n");
    svg
}

fn panel(statistic: &Statistic, rows: &[SweepRow], x: (f64, f64), left: f64) -> String {
    let values: Vec<(f64, Quartiles)> = rows
        .iter()
        .map(|row| (row.theta_deg, (statistic.of)(row)))
        .collect();
    let highest = values
        .iter()
        .map(|(_, of)| of.upper.max(of.mean))
        .fold(0.0, f64::max);
    let panel = Panel {
        left: left + 44.0,
        top: 40.0,
        width: 160.0,
        height: 170.0,
        x,
        y: (0.0, if highest > 0.0 { 1.1 * highest } else { 1.0 }),
    };
    let mut svg = text(left + 44.0, 26.0, "", statistic.title);
    svg.push_str(&band(&panel, &values));
    svg.push_str(&panel.axes());
    let means: Vec<(f64, f64)> = values.iter().map(|(theta, of)| (*theta, of.mean)).collect();
    svg.push_str(&panel.line(
        &means,
        &format!("stroke=\"{}\" stroke-width=\"1.5\"", COLORS[0]),
    ));
    for &(theta, mean) in &means {
        let (x, y) = (panel.pixel_x(theta), panel.pixel_y(mean));
        let _ = writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"{}\"/>",
            COLORS[0]
        );
        svg.push_str(&panel.tick_x(theta, &format!("{theta}°")));
    }
    for fraction in [0.0, 0.5, 1.0] {
        let value = fraction * highest;
        svg.push_str(&panel.tick_y(value, &format!("{value:.2}")));
    }
    svg
}

/// The area between the lower and the upper quartile.
fn band(panel: &Panel, values: &[(f64, Quartiles)]) -> String {
    let upper = values.iter().map(|(theta, of)| (*theta, of.upper));
    let lower = values.iter().rev().map(|(theta, of)| (*theta, of.lower));
    let corners: Vec<String> = upper
        .chain(lower)
        .map(|(x, y)| format!("{:.1},{:.1}", panel.pixel_x(x), panel.pixel_y(y)))
        .collect();
    format!(
        "<polygon points=\"{}\" fill=\"{}\" fill-opacity=\"0.15\"/>\n",
        corners.join(" "),
        COLORS[0]
    )
}

/// A single number in the form of quartiles.
fn single(value: f64) -> Quartiles {
    Quartiles {
        mean: value,
        lower: value,
        median: value,
        upper: value,
    }
}
