//! Draws all numbers of the log of a run as smoothed curves.

use crate::chart::{Chart, Entry, Line, LineChart, grid};
use crate::html::{escaped, section};
use crate::log_series::{LogSeries, Series};
use crate::names::Names;
use partprobe_eval::{METRICS, Metric};
use std::collections::BTreeSet;

/// The largest number of points of a curve. Each point is the mean over the updates next to it.
const MAX_POINTS: usize = 160;

/// The known fields, each with its title and the label of its axis with the unit. Other fields are shown by their names.
const KNOWN: [(&str, &str, &str); 14] = [
    ("loss", "Loss", "loss"),
    ("pull", "Loss term: pull", "pull"),
    ("push", "Loss term: push", "push"),
    (
        "proto_ce",
        "Loss term: prototype cross-entropy",
        "cross-entropy (nat)",
    ),
    ("learning_rate", "Learning rate", "learning rate"),
    (
        "grad_norm",
        "Gradient norm before the clip",
        "norm of the gradient",
    ),
    (
        "n_without_loss",
        "Shapes without a loss",
        "shapes per update",
    ),
    ("seconds", "Time", "seconds"),
    (
        "wait_seconds",
        "Time that an update waited for data",
        "seconds",
    ),
    ("score", "Score that chooses the best weights", "score"),
    ("n_shapes", "Shapes", "shapes"),
    ("shapes", "Shapes", "shapes"),
    (
        "wait_share",
        "Fraction of the time spent waiting",
        "fraction",
    ),
    ("loading_seconds", "Time of loading", "seconds"),
];

/// The events whose numbers have a heading of their own: at each validation, and at each update.
const GROUPS: [(&str, &str); 2] = [("valid", "At each validation"), ("step", "At each update")];

/// The charts of the events under a heading.
#[derive(Clone, Debug)]
pub(crate) struct CurveGroup {
    heading: &'static str,
    pub(crate) charts: Vec<Chart>,
    /// The numbers that never change, as HTML.
    constant: Vec<String>,
}

/// The curves of all numbers of a log.
#[derive(Clone, Debug)]
pub(crate) struct Curves {
    pub(crate) groups: Vec<CurveGroup>,
    /// The supervisions that have curves, as HTML.
    legend: String,
}

impl Curves {
    /// Draws all numbers of a log.
    pub(crate) fn of(log: &str, names: &Names<'_>) -> Self {
        let series = LogSeries::read(log);
        let is_known = |event: &str| GROUPS.iter().any(|(known, _)| *known == event);
        let mut groups: Vec<CurveGroup> = GROUPS
            .iter()
            .map(|(event, heading)| CurveGroup::of(&series, heading, names, |own| own == *event))
            .collect();
        groups.push(CurveGroup::of(&series, "Other", names, |own| {
            !is_known(own)
        }));

        let shown = series
            .fields
            .iter()
            .flat_map(|(_, trainings)| trainings.keys());
        Self {
            groups,
            legend: names.legend(shown.map(|(name, _)| name.as_str())),
        }
    }

    /// The section with all curves. It is empty if nothing was logged.
    pub(crate) fn to_html(&self) -> String {
        let mut body: String = self.groups.iter().map(CurveGroup::to_html).collect();
        if !body.is_empty() {
            body.insert_str(0, &self.legend);
        }
        section(
            "curves",
            "Training curves",
            "Each curve is a running mean of the log; the band behind it holds nine tenths of the values. A training has one curve per \
             seed. Point at a chart to read its values.",
            &body,
        )
    }
}

impl CurveGroup {
    /// Draws the numbers of some events, and lists those that never change.
    fn of(
        series: &LogSeries,
        heading: &'static str,
        names: &Names<'_>,
        is_in: impl Fn(&str) -> bool,
    ) -> Self {
        let (mut charts, mut constant) = (Vec::new(), Vec::new());
        let mut fields: Vec<_> = series
            .fields
            .iter()
            .filter(|((event, _), _)| is_in(event))
            .collect();
        fields.sort_by_key(|((_, field), _)| order(field));
        for ((event, field), trainings) in fields {
            if let Some(value) = only_value(trainings.values()) {
                constant.push(format!("<code>{}</code> is {value}", escaped(field)));
                continue;
            }
            let lines = trainings.iter().map(|((supervision, seed), series)| {
                let name = format!("{supervision}, seed {seed}");
                line(name, names.color(supervision), series)
            });
            let shown: BTreeSet<&String> = trainings.keys().map(|(name, _)| name).collect();
            let entry = |name: &&String| Entry {
                name: (*name).clone(),
                color: names.color(name),
            };
            let mut legend: Vec<Entry> = shown.iter().map(entry).collect();
            legend.sort_by_key(|entry| entry.color);
            let chart = chart(event, field, lines.collect());
            charts.extend(chart.map(|chart| chart.with_legend(legend)));
        }
        Self {
            heading,
            charts,
            constant,
        }
    }

    fn to_html(&self) -> String {
        if self.charts.is_empty() && self.constant.is_empty() {
            return String::new();
        }
        let always = match self.constant.as_slice() {
            [] => String::new(),
            constant => format!(
                "<p class=\"note\">Always the same: {}.</p>\n",
                constant.join(", ")
            ),
        };
        let charts = grid("charts", &self.charts);
        format!("<h3>{}</h3>\n{charts}{always}", self.heading)
    }
}

/// Scores come first, in the order of the tables. Then come known fields in the order of the list, and then the other ones.
fn order(field: &str) -> (usize, usize) {
    let score = METRICS.iter().position(|metric| metric.name == field);
    let known = KNOWN.iter().position(|(name, _, _)| *name == field);
    match (score, known) {
        (Some(idx), _) => (0, idx),
        (None, Some(idx)) => (1, idx),
        (None, None) => (2, 0),
    }
}

/// The value of all series, if they are all constant with the same value.
fn only_value<'a>(all: impl Iterator<Item = &'a Series>) -> Option<f64> {
    let mut values = all.flatten().map(|point| point.1);
    let first = values.next()?;
    values.all(|value| value == first).then_some(first)
}

fn chart(event: &str, field: &str, lines: Vec<Line>) -> Option<Chart> {
    let known = KNOWN.iter().find(|(name, _, _)| *name == field);
    let (title, label) = match (known, Metric::named(field)) {
        (Some((_, title, label)), _) => ((*title).to_owned(), (*label).to_owned()),
        (None, Some(metric)) => (
            format!("Validation {}", metric.heading),
            metric.heading.to_owned(),
        ),
        (None, None) => (field.replace('_', " "), field.replace('_', " ")),
    };
    let drawing = LineChart {
        x_label: "update".to_owned(),
        y_label: label,
        lines,
        from_zero: field != "learning_rate" && Metric::named(field).is_none(),
    }
    .draw()?;
    Some(Chart::new(
        &format!("curve-{event}-{field}"),
        title,
        drawing,
    ))
}

/// A curve with few enough points: the mean of each bin of updates, with the range of its values as a band.
fn line(name: String, color: usize, series: &Series) -> Line {
    let per_bin = series.len().div_ceil(MAX_POINTS).max(1);
    if per_bin == 1 {
        return Line {
            name,
            color,
            points: series.clone(),
            ..Line::default()
        };
    }
    let mut line = Line {
        name,
        color,
        ..Line::default()
    };
    let mut means = Vec::new();
    for bin in series.chunks(per_bin) {
        let n = bin.len() as f64;
        let at = bin.iter().map(|point| point.0).sum::<f64>() / n;
        let mut values: Vec<f64> = bin.iter().map(|point| point.1).collect();
        values.sort_by(f64::total_cmp);
        means.push((at, values.iter().sum::<f64>() / n));
        // Single outliers would flatten all other values.
        let edge = values.len() / 20;
        line.band
            .push((at, [values[edge], values[values.len() - 1 - edge]]));
    }
    line.points = smoothed(&means);
    line
}

/// The mean over each point and its two neighbors on either side.
fn smoothed(points: &[(f64, f64)]) -> Series {
    let n = points.len();
    let mean = |idx: usize| {
        // A window that is cut at one end is also cut at the other end, so that the ends do not shift.
        let reach = 2.min(idx).min(n - 1 - idx);
        let window = &points[idx - reach..=idx + reach];
        window.iter().map(|point| point.1).sum::<f64>() / window.len() as f64
    };
    (0..n).map(|idx| (points[idx].0, mean(idx))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_series_are_averaged_and_short_ones_are_kept() {
        let series: Series = (0..4800)
            .map(|step| (f64::from(step), f64::from(step % 2)))
            .collect();
        let long = line("a".to_owned(), 0, &series);
        assert_eq!((long.points.len(), long.band.len()), (160, 160));
        assert!(long.points.iter().all(|point| (point.1 - 0.5).abs() < 1e-9));
        assert!(long.band.iter().all(|band| band.1 == [0.0, 1.0]));
        let short = line("a".to_owned(), 0, &series[..40].to_vec());
        assert_eq!((short.points.len(), short.band.len()), (40, 0));
    }

    #[test]
    fn a_straight_line_stays_straight_at_its_ends() {
        let straight: Series = (0..9)
            .map(|idx| (f64::from(idx), 3.0 * f64::from(idx)))
            .collect();
        assert_eq!(smoothed(&straight), straight);
    }
}
