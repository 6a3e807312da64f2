//! Draws the score as a function of the dose of each kind of damage, and places other label sources on these curves.

use crate::chart::{Chart, Entry, Line, LineChart, grid};
use crate::html::{escaped, section};
use crate::names::Names;
use crate::shape_scores::{MainTable, mean_of};
use partprobe_eval::{MIOU, ScoreRow, Tables, labels_row};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The source that is damaged.
const UNDAMAGED: &str = "step-parts";

/// A kind of damage.
struct Kind {
    /// The name of a source, without its dose at the end.
    prefix: &'static str,
    title: &'static str,
    x_label: &'static str,
    /// Whether the dose 0 means that nothing is damaged.
    starts_at_zero: bool,
}

/// The longer of two prefixes comes first.
const KINDS: [Kind; 5] = [
    Kind {
        prefix: "step-merged-share-",
        title: "Parts merged",
        x_label: "merges done (% of all possible)",
        starts_at_zero: true,
    },
    Kind {
        prefix: "step-merged-",
        title: "Parts merged to K",
        x_label: "parts that are left at most (K)",
        starts_at_zero: false,
    },
    Kind {
        prefix: "step-split-",
        title: "Parts split to K",
        x_label: "parts after splitting (K)",
        starts_at_zero: false,
    },
    Kind {
        prefix: "step-flipped-",
        title: "Labels of faces flipped",
        x_label: "faces with the label of another part (%)",
        starts_at_zero: true,
    },
    Kind {
        prefix: "step-jittered-",
        title: "Borders moved",
        x_label: "radius by which borders move (‰ of the diagonal)",
        starts_at_zero: true,
    },
];

/// The mean score of the backbones that were trained on a dose, with the ends of its interval.
#[derive(Clone, Copy, Debug)]
struct DoseScore {
    mean: f64,
    interval: Option<[f64; 2]>,
}

/// A dose and its score.
type Dose = (f64, DoseScore);

/// The section with the charts of doses. It is empty without them.
pub(crate) fn dose_response(charts: &[Chart], tables: &Tables) -> String {
    let mut body = grid("charts", charts);
    if !body.is_empty() {
        body.push_str(&placed(tables));
    }
    section(
        "dose-response",
        "Dose and response",
        "How much of the score is left if the labels are damaged on purpose: the mean mIoU of backbones that were trained on them, with \
         95 % intervals over groups of related shapes. The dashed curve scores the damaged labels themselves. A flat line is the \
         mean of another label source. Compare doses within one kind of damage only.",
        &body,
    )
}

/// One chart per kind of damage that has two doses.
pub(crate) fn dose_charts(tables: &Tables, rows: &[ScoreRow], names: &Names<'_>) -> Vec<Chart> {
    let Some(main) = MainTable::of(tables) else {
        return Vec::new();
    };
    let score = |name: &str| {
        let found = mean_of(&main.scores(rows, name, MIOU))?;
        Some(DoseScore {
            mean: found.mean,
            interval: found.interval.map(|interval| [interval.low, interval.high]),
        })
    };
    let mut kinds: BTreeMap<usize, (Vec<Dose>, Vec<Dose>)> = BTreeMap::new();
    let mut others = Vec::new();
    for name in main
        .supervisions(tables)
        .filter(|name| names.is_trained(name))
    {
        let Some(mean) = score(name) else { continue };
        let Some((kind, dose)) = kind_of(name) else {
            others.push((name, mean.mean));
            continue;
        };
        let (trained, labels) = kinds.entry(kind).or_default();
        trained.push((dose, mean));
        labels.extend(score(&labels_row(name)).map(|mean| (dose, mean)));
    }
    let mut charts = Vec::new();
    for (kind, (mut trained, mut labels)) in kinds {
        let kind = &KINDS[kind];
        if kind.starts_at_zero
            && let Some(mean) = score(UNDAMAGED)
        {
            trained.push((0.0, mean));
            let perfect = DoseScore {
                mean: 1.0,
                interval: None,
            };
            labels.push((
                0.0,
                if main.reference == UNDAMAGED {
                    perfect
                } else {
                    mean
                },
            ));
        }
        trained.sort_by(|a, b| a.0.total_cmp(&b.0));
        labels.sort_by(|a, b| a.0.total_cmp(&b.0));
        if trained.len() < 2 {
            continue;
        }
        let chart = chart(kind, &trained, &labels, &others, names);
        charts.extend(chart.draw().map(|drawing| {
            let name = format!("dose-{}", kind.prefix.trim_end_matches('-'));
            Chart::new(&name, kind.title, drawing).with_legend(legend(&chart))
        }));
    }
    charts
}

fn legend(chart: &LineChart) -> Vec<Entry> {
    let entry = |line: &Line| Entry {
        name: line.name.clone(),
        color: line.color,
    };
    chart.lines.iter().map(entry).collect()
}

/// The index of the kind in [`KINDS`], and the dose. Returns `None` for other names.
fn kind_of(name: &str) -> Option<(usize, f64)> {
    KINDS.iter().enumerate().find_map(|(idx, kind)| {
        let dose: u32 = name.strip_prefix(kind.prefix)?.parse().ok()?;
        Some((idx, f64::from(dose)))
    })
}

fn chart(
    kind: &Kind,
    trained: &[Dose],
    labels: &[Dose],
    others: &[(&str, f64)],
    names: &Names<'_>,
) -> LineChart {
    let line = |name: &str, color: usize, doses: &[Dose]| Line {
        name: name.to_owned(),
        color,
        points: doses
            .iter()
            .map(|&(dose, mean)| (dose, mean.mean))
            .collect(),
        bars: doses
            .iter()
            .filter_map(|&(dose, mean)| Some((dose, mean.interval?)))
            .collect(),
        ..Line::default()
    };
    let mut lines = vec![line(
        "trained on the damaged labels",
        names.color(UNDAMAGED),
        trained,
    )];
    if labels.len() > 1 {
        // The same color, dashed.
        let color = names.color(UNDAMAGED) % crate::chart::N_COLORS + crate::chart::N_COLORS;
        lines.push(Line {
            bars: Vec::new(),
            ..line("the damaged labels themselves", color, labels)
        });
    }
    let [first, last] = [trained[0].0, trained[trained.len() - 1].0];
    for (name, mean) in others.iter().filter(|other| other.0 != UNDAMAGED) {
        lines.push(Line {
            name: (*name).to_owned(),
            color: names.color(name),
            points: vec![(first, *mean), (last, *mean)],
            ..Line::default()
        });
    }
    LineChart {
        x_label: kind.x_label.to_owned(),
        y_label: "mean mIoU".to_owned(),
        lines,
        from_zero: true,
    }
}

/// One sentence per source that lies on a curve.
fn placed(tables: &Tables) -> String {
    let mut items = String::new();
    for placement in tables.dose_placements() {
        let sentence = format!("{} {placement}.", placement.source).replace('`', "");
        let _ = writeln!(items, "<li>{}</li>", escaped(&sentence));
    }
    if items.is_empty() {
        return items;
    }
    format!("<ul>{items}</ul>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_a_kind_and_a_dose() {
        let of = |name| kind_of(name).map(|(kind, dose)| (KINDS[kind].prefix, dose));
        assert_eq!(
            of("step-merged-share-40"),
            Some(("step-merged-share-", 40.0))
        );
        assert_eq!(of("step-merged-5"), Some(("step-merged-", 5.0)));
        assert_eq!(of("step-jittered-10"), Some(("step-jittered-", 10.0)));
        assert_eq!(
            [of("step-parts"), of("ward-20"), of("step-merged-share-")],
            [None; 3]
        );
    }
}
