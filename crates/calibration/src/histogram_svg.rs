//! Plots the histogram of φ: the number of edges and of pairs of faces per degree, on a logarithmic axis.

use crate::plot::{COLORS, Panel, opening, text};
use crate::{CalibrationTables, N_ANGLE_BINS};
use std::fmt::Write as _;

/// Draws the histogram with θ and the suggested range, as the text of an SVG file.
#[must_use]
pub fn histogram_svg(tables: &CalibrationTables) -> String {
    let histogram = &tables.histogram;
    let highest = histogram
        .edge_bins
        .iter()
        .chain(&histogram.pair_bins)
        .copied()
        .max()
        .unwrap_or(0)
        .max(1);
    let decades = (highest as f64).log10().ceil().max(1.0);
    let panel = Panel {
        left: 64.0,
        top: 48.0,
        width: 760.0,
        height: 300.0,
        x: (0.0, N_ANGLE_BINS as f64),
        // The axis begins below one, so that a bar of a single edge is visible.
        y: (-0.3, decades),
    };
    let mut svg = opening(860.0, 420.0);
    if let Some(range) = &tables.stable_range {
        let (from, to) = (panel.pixel_x(range.low_deg), panel.pixel_x(range.high_deg));
        let _ = writeln!(
            svg,
            "<rect x=\"{from:.1}\" y=\"{}\" width=\"{:.1}\" height=\"{}\" fill=\"#eee\"/>",
            panel.top,
            to - from,
            panel.height
        );
    }
    svg.push_str(&bars(&panel, &histogram.edge_bins, COLORS[0]));
    svg.push_str(&steps(&panel, &histogram.pair_bins));
    svg.push_str(&panel.axes());
    for degree in (0..=180).step_by(20) {
        svg.push_str(&panel.tick_x(f64::from(degree), &format!("{degree}°")));
    }
    for decade in 0..=decades as u32 {
        svg.push_str(&panel.tick_y(f64::from(decade), &10u64.pow(decade).to_string()));
    }
    let theta = tables.settings.theta_deg;
    svg.push_str(&panel.line(
        &[(theta, panel.y.0), (theta, panel.y.1)],
        "stroke=\"#222\" stroke-dasharray=\"4 3\"",
    ));
    svg.push_str(&legend(tables));
    svg.push_str("</svg>\n");
    svg
}

/// One bar per degree. A degree without angles has no bar.
fn bars(panel: &Panel, bins: &[u64], color: &str) -> String {
    let mut path = String::new();
    let bottom = panel.top + panel.height;
    let width = panel.width / N_ANGLE_BINS as f64;
    for (degree, &count) in bins.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (x, y) = (
            panel.pixel_x(degree as f64),
            panel.pixel_y((count as f64).log10()),
        );
        let _ = write!(path, "M{x:.1} {bottom:.1}V{y:.1}h{width:.2}V{bottom:.1}z");
    }
    format!("<path d=\"{path}\" fill=\"{color}\" fill-opacity=\"0.6\"/>\n")
}

/// The histogram of the pairs as an outline, drawn over the bars of the edges.
fn steps(panel: &Panel, bins: &[u64]) -> String {
    let height = |count: u64| {
        if count > 0 {
            (count as f64).log10()
        } else {
            panel.y.0
        }
    };
    let points: Vec<(f64, f64)> = bins
        .iter()
        .enumerate()
        .flat_map(|(degree, &count)| {
            [
                (degree as f64, height(count)),
                (degree as f64 + 1.0, height(count)),
            ]
        })
        .collect();
    panel.line(
        &points,
        &format!("stroke=\"{}\" stroke-width=\"1\"", COLORS[1]),
    )
}

fn legend(tables: &CalibrationTables) -> String {
    let (edges, pairs) = (&tables.histogram.edges, &tables.histogram.pairs);
    let theta = tables.settings.theta_deg;
    let share = |share: f64| format!("{:.2} %", 100.0 * share);
    let mut legend = text(
        64.0,
        22.0,
        "font-size=\"14\"",
        "Dihedral angle between faces of one primitive type",
    );
    legend.push_str(&text(
        64.0,
        40.0,
        &format!("fill=\"{}\"", COLORS[0]),
        &format!(
            "{} edges, {} at most {theta}°",
            edges.n,
            share(edges.share_within_theta())
        ),
    ));
    legend.push_str(&text(
        824.0,
        40.0,
        &format!("fill=\"{}\" text-anchor=\"end\"", COLORS[1]),
        &format!(
            "{} pairs of faces, {} at most {theta}°",
            pairs.n,
            share(pairs.share_within_theta())
        ),
    ));
    let note = match &tables.stable_range {
        Some(range) => format!(
            "dashed: θ = {theta}°; grey: suggested range {}° to {}°",
            range.low_deg, range.high_deg
        ),
        None => format!("dashed: θ = {theta}°"),
    };
    legend.push_str(&text(64.0, 400.0, "fill=\"#555\"", &note));
    legend
}
