//! Plots agreement by the number of reference parts: bars for accuracy, mIoU and boundary accuracy (the paper's figure of
//! agreement against complexity).

use super::colors::{color, panel, size};
use partprobe_calibration::plot::{Panel, opening, text};
use partprobe_eval::{AgreementTable, KBinAgreement, Statistic};
use std::fmt::Write as _;

/// A bar of each bin: its name, and its value.
type Bar = (&'static str, fn(&KBinAgreement) -> Option<Statistic>);

const BARS: [Bar; 3] = [
    ("accuracy", |bin| bin.accuracy),
    ("mIoU", |bin| bin.miou),
    ("boundary 0.5 %", |bin| bin.boundary),
];

/// Draws one panel per source.
pub(super) fn complexity_svg(tables: &[&AgreementTable]) -> String {
    let [width, height] = size(tables.len());
    let mut svg = opening(width, height);
    for (idx, table) in tables.iter().enumerate() {
        let bins: Vec<&KBinAgreement> = table.bins.iter().filter(|bin| bin.n_shapes > 0).collect();
        let panel = panel(idx, (0.0, bins.len() as f64), (0.0, 1.0));
        svg.push_str(&text(panel.left, panel.top - 14.0, "", &table.source));
        svg.push_str(&bars(&panel, &bins));
        if idx == 0 {
            svg.push_str(&legend(&panel));
        }
    }
    svg.push_str("</svg>\n");
    svg
}

fn bars(panel: &Panel, bins: &[&KBinAgreement]) -> String {
    let mut svg = String::new();
    let width = 0.8 / BARS.len() as f64;
    for (place, bin) in bins.iter().enumerate() {
        for (idx, (_, value_of)) in BARS.iter().enumerate() {
            let Some(value) = value_of(bin) else { continue };
            let from = panel.pixel_x(place as f64 + 0.1 + width * idx as f64);
            let to = panel.pixel_x(place as f64 + 0.1 + width * (idx + 1) as f64);
            let top = panel.pixel_y(value.mean);
            let _ = writeln!(
                svg,
                "<rect x=\"{from:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\"/>",
                to - from,
                panel.pixel_y(0.0) - top,
                color(idx)
            );
        }
        let label = format!("K {} ({})", bin.bin.name(), bin.n_shapes);
        svg.push_str(&panel.tick_x(place as f64 + 0.5, &label));
    }
    for value in [0.0, 0.5, 1.0] {
        svg.push_str(&panel.tick_y(value, &format!("{value:.1}")));
    }
    svg + &panel.axes()
}

/// The names of the bars, below the first panel.
fn legend(panel: &Panel) -> String {
    let mut svg = String::new();
    for (idx, (name, _)) in BARS.iter().enumerate() {
        let left = panel.left + 80.0 * idx as f64;
        let fill = format!("fill=\"{}\"", color(idx));
        svg.push_str(&text(left, panel.top + panel.height + 38.0, &fill, name));
    }
    svg
}
