//! Plots the distribution of the mIoU over shapes, with its mean as a dashed line (the paper's histogram).

use super::colors::{color, panel, size};
use partprobe_calibration::plot::{Panel, opening, text};
use partprobe_eval::{AgreementRow, AgreementTable};
use std::fmt::Write as _;

/// Bins of the histogram between 0 and 1.
const N_BINS: usize = 20;

/// Draws one panel per source.
pub(super) fn distribution_svg(tables: &[&AgreementTable], rows: &[&AgreementRow]) -> String {
    let [width, height] = size(tables.len());
    let mut svg = opening(width, height);
    for (idx, table) in tables.iter().enumerate() {
        let of_source = rows.iter().filter(|row| row.source == table.source);
        let mious: Vec<f64> = of_source.map(|row| row.agreement.miou).collect();
        let counts = histogram(&mious);
        let highest = counts.iter().copied().max().unwrap_or(0).max(1) as f64;
        let panel = panel(idx, (0.0, 1.0), (0.0, 1.1 * highest));
        let title = format!("{}: mIoU of {} shapes", table.source, mious.len());
        svg.push_str(&text(panel.left, panel.top - 14.0, "", &title));
        svg.push_str(&bars(&panel, &counts));
        let mean = mious.iter().sum::<f64>() / mious.len().max(1) as f64;
        let dashed = "stroke=\"#d55e00\" stroke-dasharray=\"5 4\" stroke-width=\"1.5\"";
        svg.push_str(&panel.line(&[(mean, 0.0), (mean, 1.1 * highest)], dashed));
        for value in [0.0, 0.5, 1.0] {
            svg.push_str(&panel.tick_x(value, &format!("{value:.1}")));
        }
        svg.push_str(&panel.tick_y(highest, &format!("{highest:.0}")));
        svg.push_str(&panel.axes());
    }
    svg.push_str("</svg>\n");
    svg
}

fn histogram(values: &[f64]) -> [usize; N_BINS] {
    let mut counts = [0; N_BINS];
    for value in values {
        let bin = (value * N_BINS as f64) as usize;
        counts[bin.min(N_BINS - 1)] += 1;
    }
    counts
}

fn bars(panel: &Panel, counts: &[usize; N_BINS]) -> String {
    let mut svg = String::new();
    let width = panel.width / N_BINS as f64;
    for (bin, &count) in counts.iter().enumerate() {
        let top = panel.pixel_y(count as f64);
        let _ = writeln!(
            svg,
            "<rect x=\"{:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\"/>",
            panel.pixel_x(bin as f64 / N_BINS as f64),
            width - 1.0,
            panel.pixel_y(0.0) - top,
            color(0)
        );
    }
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_value_is_in_the_last_bin() {
        let counts = histogram(&[0.0, 0.049, 0.05, 1.0, 0.96]);
        assert_eq!((counts[0], counts[1], counts[19]), (2, 1, 2));
    }
}
