//! Draws distributions: the score per shape of each trained supervision, the number of parts, and the sizes of parts.

use crate::chart::{Bars, Chart, grid};
use crate::html::section;
use crate::names::Names;
use crate::shape_digest::ShapeDigest;
use crate::shape_scores::{MainTable, ShapeScore};
use partprobe_eval::{MIOU, ScoreRow, Tables};
use std::collections::BTreeMap;

/// The number of bars for scores from 0 to 1.
const N_SCORE_BARS: usize = 20;

/// The section with all histograms. It is empty without scores and shapes.
pub(crate) fn distributions(charts: &[Chart]) -> String {
    section(
        "distributions",
        "Distributions",
        "The dashed line is the median.",
        &grid("charts", charts),
    )
}

/// The histograms: the scores of each supervision, the numbers of parts, and the sizes of parts.
pub(crate) fn distribution_charts(
    tables: &Tables,
    rows: &[ScoreRow],
    shapes: &[ShapeDigest],
    names: &Names<'_>,
) -> Vec<Chart> {
    let mut charts = Vec::new();
    if let Some(main) = MainTable::of(tables) {
        let shown = main
            .supervisions(tables)
            .filter(|name| names.is_trained(name) || *name == "no-network");
        let mut first = None;
        for name in shown {
            let scores = main.scores(rows, name, MIOU);
            charts.extend(score_chart(
                name,
                names.is_trained(name).then(|| names.color(name)),
                &scores,
            ));
            first.get_or_insert(scores);
        }
        let k: Vec<usize> = first.iter().flatten().map(|score| score.k).collect();
        charts.extend(chart(
            "numbers-of-parts",
            "Number of reference parts of the test shapes",
            k_bars(&k),
        ));
    }
    let sizes: Vec<f64> = shapes
        .iter()
        .filter_map(|shape| shape.references.first())
        .flat_map(|reference| reference.parts.iter().map(|part| part.size))
        .collect();
    charts.extend(chart(
        "sizes-of-parts",
        "Sizes of the reference parts",
        size_bars(&sizes),
    ));
    charts
}

fn chart(name: &str, title: &str, bars: Bars) -> Option<Chart> {
    Some(Chart::new(name, title, bars.draw()?))
}

fn score_chart(name: &str, color: Option<usize>, scores: &[ShapeScore<'_>]) -> Option<Chart> {
    let values: Vec<f64> = scores.iter().map(|score| score.score).collect();
    let mut counts = [0.0; N_SCORE_BARS];
    for value in &values {
        let bar = (value * N_SCORE_BARS as f64).clamp(0.0, N_SCORE_BARS as f64 - 1.0);
        counts[bar as usize] += 1.0;
    }
    let edge =
        |(idx, &count): (usize, &f64)| (format!("{:.2}", idx as f64 / N_SCORE_BARS as f64), count);
    let bars = Bars {
        x_label: "mIoU of a shape".to_owned(),
        y_label: "shapes".to_owned(),
        bars: counts.iter().enumerate().map(edge).collect(),
        mark: median(&values).map(|median| (median * N_SCORE_BARS as f64, format!("{median:.3}"))),
        labels_at_edges: true,
        color,
    };
    chart(
        &format!("scores-{name}"),
        &format!("mIoU per shape: {name}"),
        bars,
    )
}

/// One bar per number of parts. Numbers above 40 share the last bar.
fn k_bars(k: &[usize]) -> Bars {
    const MOST: usize = 40;
    let mut counts: BTreeMap<usize, f64> = BTreeMap::new();
    for &k in k {
        *counts.entry(k.min(MOST)).or_default() += 1.0;
    }
    let (Some(low), Some(high)) = (
        counts.keys().next().copied(),
        counts.keys().next_back().copied(),
    ) else {
        return Bars::default();
    };
    let bar = |k: usize| {
        let label = if k == MOST {
            format!("{MOST}+")
        } else {
            k.to_string()
        };
        (label, counts.get(&k).copied().unwrap_or(0.0))
    };
    let as_numbers: Vec<f64> = k.iter().map(|&k| k as f64).collect();
    Bars {
        x_label: "reference parts (K)".to_owned(),
        y_label: "shapes".to_owned(),
        bars: (low..=high).map(bar).collect(),
        mark: median(&as_numbers).map(|median| {
            (
                median.min(MOST as f64) - low as f64 + 0.5,
                format!("{median}"),
            )
        }),
        labels_at_edges: false,
        color: Some(0),
    }
}

/// Bars of a factor of two, from less than 1/256 to more than half of the shape.
fn size_bars(sizes: &[f64]) -> Bars {
    const N: usize = 9;
    let place = |size: f64| (N as f64 + size.max(1e-9).log2()).clamp(0.0, N as f64 - 1e-9);
    let mut counts = [0.0; N];
    for &size in sizes {
        counts[place(size) as usize] += 1.0;
    }
    let label = |idx: usize| {
        let low = 100.0 * 0.5f64.powi((N - idx) as i32);
        if idx == 0 {
            "0".to_owned()
        } else {
            format!("{low:.1}")
        }
    };
    Bars {
        x_label: "share of the points of the shape (%, each bar doubles)".to_owned(),
        y_label: "parts".to_owned(),
        bars: counts
            .iter()
            .enumerate()
            .map(|(idx, &count)| (label(idx), count))
            .collect(),
        mark: median(sizes).map(|median| (place(median), format!("{:.1} %", 100.0 * median))),
        labels_at_edges: true,
        color: Some(0),
    }
}

fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    let low = *sorted.get(n.checked_sub(1)? / 2)?;
    Some(0.5 * (low + sorted[n / 2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_count_everything() {
        let heights = |bars: &Bars| bars.bars.iter().map(|bar| bar.1).collect::<Vec<_>>();
        let bars = k_bars(&[2, 4, 4, 99]);
        assert_eq!(heights(&bars).iter().sum::<f64>(), 4.0);
        assert_eq!(
            (bars.bars[0].0.as_str(), bars.bars[38].0.as_str()),
            ("2", "40+")
        );
        assert_eq!(bars.mark, Some((2.5, "4".to_owned())));
        let bars = size_bars(&[0.5, 1.0, 0.26, 0.001]);
        assert_eq!(
            heights(&bars),
            [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0]
        );
        assert!(k_bars(&[]).draw().is_none());
        assert_eq!(
            [median(&[]), median(&[3.0]), median(&[1.0, 4.0, 2.0, 8.0])],
            [None, Some(3.0), Some(3.0)]
        );
    }
}
