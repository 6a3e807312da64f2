//! Places values on an axis, and chooses round numbers for its ticks.

use super::{BOTTOM, LEFT, RIGHT, TOP};
use crate::html::escaped;
use std::fmt::Write as _;

/// Maps values from `low` to `high` to positions from `from` to `to`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl Axis {
    /// The horizontal axis of a chart of this width.
    pub(crate) fn horizontal(low: f64, high: f64, width: f64) -> Self {
        Self::new(low, high, LEFT, width - RIGHT)
    }

    /// The vertical axis of a chart of this height. Large values are at the top.
    pub(crate) fn vertical(low: f64, high: f64, height: f64) -> Self {
        Self::new(low, high, height - BOTTOM, TOP)
    }

    fn new(low: f64, high: f64, from: f64, to: f64) -> Self {
        // An axis of no length would divide by zero.
        let high = if high - low > 1e-12 * low.abs().max(1e-12) {
            high
        } else {
            low + low.abs().max(1e-6)
        };
        Self {
            low,
            high,
            from,
            to,
        }
    }

    /// The position of a value. Values outside are placed at the nearer end.
    pub(crate) fn at(&self, value: f64) -> f64 {
        let fraction = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        self.from + fraction * (self.to - self.from)
    }

    /// Lines of the grid, numbers and a label for a horizontal axis at the height `y`, above which the chart is.
    pub(crate) fn horizontal_svg(&self, y: f64, label: &str) -> String {
        let mut svg = format!(
            "<path class=\"axis\" d=\"M{:.1} {y:.1}H{:.1}\"/>",
            self.from, self.to
        );
        let ticks = nice_ticks(self.low, self.high, 6);
        for &tick in &ticks {
            let x = self.at(tick);
            let _ = write!(
                svg,
                "<path class=\"tick\" d=\"M{x:.1} {y:.1}v4\"/><text x=\"{x:.1}\" y=\"{:.1}\" class=\"mid\">{}</text>",
                y + 17.0,
                tick_text(tick, &ticks)
            );
        }
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" class=\"mid label\">{}</text>",
            0.5 * (self.from + self.to),
            y + 36.0,
            escaped(label)
        );
        svg
    }

    /// The same for a vertical axis at the left of a chart that ends at `right`.
    pub(crate) fn vertical_svg(&self, right: f64, label: &str) -> String {
        let mut svg = String::new();
        let ticks = nice_ticks(self.low, self.high, 5);
        for &tick in &ticks {
            let y = self.at(tick);
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{right:.1}\"/><text x=\"{}\" y=\"{:.1}\" class=\"end\">{}</text>",
                LEFT - 7.0,
                y + 4.0,
                tick_text(tick, &ticks)
            );
        }
        let middle = 0.5 * (self.from + self.to);
        let _ = write!(
            svg,
            "<text transform=\"translate(12 {middle:.1}) rotate(-90)\" class=\"mid label\">{}</text>",
            escaped(label)
        );
        svg
    }
}

/// Round numbers from `low` to `high`, about `n` of them: multiples of 1, 2 or 5 times a power of ten.
pub(crate) fn nice_ticks(low: f64, high: f64, n: usize) -> Vec<f64> {
    let span = high - low;
    if !span.is_finite() || span <= 0.0 {
        return vec![low];
    }
    let raw = span / n.max(1) as f64;
    let power = 10f64.powf(raw.log10().floor());
    let steps = [0.5, 1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
    let coarsest = steps.iter().position(|step| *step >= 0.999 * raw);
    // If a step is longer than the span, there may be no multiple of it inside. Then the next shorter step is used.
    steps[..=coarsest.unwrap_or(steps.len() - 1)]
        .iter()
        .rev()
        .map(|&step| multiples(step, low, high))
        .find(|ticks| !ticks.is_empty())
        .unwrap_or_default()
}

/// The multiples of a step from `low` to `high`.
fn multiples(step: f64, low: f64, high: f64) -> Vec<f64> {
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|tick| tick as f64 * step).collect()
}

/// A tick with enough decimals to distinguish it from its neighbors.
pub(crate) fn tick_text(tick: f64, ticks: &[f64]) -> String {
    let step = match ticks {
        [first, second, ..] => (second - first).abs(),
        _ => tick.abs().max(1e-9),
    };
    let largest = ticks
        .iter()
        .fold(0.0, |largest: f64, tick| largest.max(tick.abs()));
    if largest > 0.0 && !(5e-3..1e6).contains(&largest) {
        let text = format!("{:.1e}", tick);
        return text.replace(".0e", "e").replace("0e0", "0");
    }
    let decimals = (-(step * 1.000_001).log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{tick:.decimals$}");
    let (sign, digits) = match text.strip_prefix('-') {
        Some(digits) if tick != 0.0 => ("−", digits),
        _ => ("", text.trim_start_matches('-')),
    };
    let (whole, rest) = digits
        .split_once('.')
        .map_or((digits, String::new()), |(whole, rest)| {
            (whole, format!(".{rest}"))
        });
    format!("{sign}{}{rest}", grouped(whole))
}

/// Digits in groups of three if there are more than four, with thin spaces.
fn grouped(digits: &str) -> String {
    if digits.len() < 5 {
        return digits.to_owned();
    }
    let mut text = String::new();
    for (idx, digit) in digits.chars().enumerate() {
        if idx > 0 && (digits.len() - idx).is_multiple_of(3) {
            text.push('\u{2009}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(low: f64, high: f64, expected: &[&str]) {
        let ticks = nice_ticks(low, high, 5);
        let texts: Vec<String> = ticks.iter().map(|&tick| tick_text(tick, &ticks)).collect();
        assert_eq!(texts, expected);
    }

    #[test]
    fn a_span_without_a_coarse_multiple_has_finer_ticks() {
        assert_eq!(nice_ticks(512_261.0, 936_118.0, 2), [600_000.0, 800_000.0]);
    }

    #[test]
    fn ticks_are_round() {
        check(0.0, 1.0, &["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        check(0.0, 5000.0, &["0", "1000", "2000", "3000", "4000", "5000"]);
        check(
            0.0,
            20_000.0,
            &[
                "0",
                "5000",
                "10\u{2009}000",
                "15\u{2009}000",
                "20\u{2009}000",
            ],
        );
        check(-0.05, 0.1, &["−0.05", "0.00", "0.05", "0.10"]);
        check(0.0, 1e-4, &["0", "2e-5", "4e-5", "6e-5", "8e-5", "1e-4"]);
        check(3.0, 3.0, &["3"]);
    }

    proptest! {
        #[test]
        fn ticks_lie_inside_and_are_few(low in -1e6f64..1e6, span in 1e-6f64..1e6, n in 2usize..9) {
            let ticks = nice_ticks(low, low + span, n);
            prop_assert!(ticks.len() <= n + 1 && !ticks.is_empty() || span < 1e-6 * low.abs());
            let axis = Axis::horizontal(low, low + span, 400.0);
            for tick in ticks {
                prop_assert!(tick >= low - 1e-6 * span && tick <= low + span * (1.0 + 1e-6));
                prop_assert!((axis.from..=axis.to).contains(&axis.at(tick)));
            }
        }
    }
}
