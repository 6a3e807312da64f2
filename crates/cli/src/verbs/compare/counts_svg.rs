//! Plots labels of a source against parts of the reference, one dot per shape. The dashed line is equality (the paper's scatter
//! plot).

use super::colors::{color, panel, size};
use partprobe_calibration::plot::{opening, text};
use partprobe_eval::{AgreementRow, AgreementTable};
use std::fmt::Write as _;

/// Draws one panel per source. Both axes are the same in all panels and end at the largest count.
pub(super) fn counts_svg(tables: &[&AgreementTable], rows: &[&AgreementRow]) -> String {
    let [width, height] = size(tables.len());
    let mut svg = opening(width, height);
    let largest_of = |row: &&AgreementRow| row.agreement.n_reference.max(row.agreement.n_labels);
    let largest = rows.iter().map(largest_of).max().unwrap_or(1) as f64;
    // Counts reach from 1 to thousands, so both axes are logarithmic.
    let most = largest.max(2.0).log10();
    for (idx, table) in tables.iter().enumerate() {
        let panel = panel(idx, (0.0, most), (0.0, most));
        svg.push_str(&text(
            panel.left,
            panel.top - 14.0,
            "",
            &format!("{}: labels by parts", table.source),
        ));
        svg.push_str(&panel.line(
            &[(0.0, 0.0), (most, most)],
            "stroke=\"#888\" stroke-dasharray=\"5 4\"",
        ));
        for row in rows.iter().filter(|row| row.source == table.source) {
            let at = |count: usize| (count.max(1) as f64).log10();
            let _ = writeln!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.5\" fill=\"{}\" fill-opacity=\"0.5\"/>",
                panel.pixel_x(at(row.agreement.n_reference)),
                panel.pixel_y(at(row.agreement.n_labels)),
                color(0)
            );
        }
        for count in [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0] {
            if count <= largest {
                svg.push_str(&panel.tick_x(f64::log10(count), &count.to_string()));
                svg.push_str(&panel.tick_y(f64::log10(count), &count.to_string()));
            }
        }
        svg.push_str(&panel.axes());
    }
    svg.push_str("</svg>\n");
    svg
}
