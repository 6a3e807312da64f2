//! Writes `report.html`: one self-contained page with the tables, the curves and the settings of a run.

use crate::{DifferenceRow, ExpectationOutcome, KBin, METRICS, MIOU, ScoreRow, TableRow, Tables};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// What the page shows.
#[derive(Debug)]
pub struct RunReport<'a> {
    /// The first paragraph, for example how many shapes take part.
    pub summary: &'a str,
    /// A remark below the tables of scores.
    pub note: Option<String>,
    /// The tables of scores.
    pub tables: &'a Tables,
    /// The score of each shape.
    pub rows: &'a [ScoreRow],
    /// The expectations, and whether they are met.
    pub outcomes: &'a [ExpectationOutcome],
    /// The log of the trainings, one JSON object per line, with `event`, `supervision`, `seed` and `step`.
    pub log: &'a str,
    /// The merged config, as TOML.
    pub config: &'a str,
}

/// Colors of curves and dots, readable on white and by most color-blind readers.
const COLORS: [&str; 6] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00",
];

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#222}\
table{border-collapse:collapse;margin:1rem 0}th,td{padding:.25rem .7rem;text-align:right;border-bottom:1px solid #ddd}\
th:first-child,td:first-child{text-align:left}thead th{border-bottom:2px solid #888}.missed{color:#b00020;font-weight:600}\
pre{background:#f6f6f6;padding:1rem;overflow:auto}svg{max-width:100%;height:auto}.note{color:#555}";

impl RunReport<'_> {
    /// The page as HTML; everything in it is escaped, and nothing is loaded from elsewhere.
    #[must_use]
    pub fn to_html(&self) -> String {
        html(self)
    }
}

fn html(report: &RunReport<'_>) -> String {
    let mut page = format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>partprobe run</title><style>{STYLE}</style></head><body>\n\
         <h1>Which labels train the better backbone</h1>\n<p>{}</p>\n",
        escaped(report.summary)
    );
    page.push_str(&expectations(report.outcomes));
    for (reference, rows) in by_reference(&report.tables.rows) {
        let _ = writeln!(
            page,
            "<h2>Scored against <code>{}</code></h2>",
            escaped(reference)
        );
        page.push_str(&score_table(
            &rows,
            report
                .tables
                .differences
                .iter()
                .find(|row| row.reference == reference),
        ));
    }
    page.push_str(
        "<p class=\"note\">mIoU and accuracy: k-means with the reference's number of parts, Hungarian matching, all sampled \
         points. GTc: each point goes to the part whose mean embedding is nearest; no clustering. <code>untrained</code> is \
         the same network with its initial weights, <code>no-network</code> the same clusterer on ½·position and normal, <code>growing-20</code> region growing at 20° on \
         the points, <code>labels-of-…</code> the labels of a source themselves, and <code>token-ceiling</code> the most that \
         the tokens allow. \
         The difference carries a paired bootstrap 95 % interval over groups of related shapes.</p>\n",
    );
    if let Some(note) = &report.note {
        let _ = writeln!(page, "<p class=\"note\">{}</p>", escaped(note));
    }
    page.push_str(&curves("Loss", report.log, "step", "loss"));
    page.push_str(&curves(
        "Validation mIoU against the supervision itself",
        report.log,
        "valid",
        "miou",
    ));
    page.push_str(&shape_table(report));
    let _ = writeln!(
        page,
        "<details><summary>Settings</summary><pre>{}</pre></details>\n</body></html>",
        escaped(report.config)
    );
    page
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

fn expectations(outcomes: &[ExpectationOutcome]) -> String {
    let mut list = String::new();
    for outcome in outcomes {
        let (class, verdict) = if outcome.passed {
            ("met", "met")
        } else {
            ("missed", "missed")
        };
        let _ = writeln!(
            list,
            "<li class=\"{class}\">{verdict}: {} (found {:.4})</li>",
            escaped(&outcome.text),
            outcome.value
        );
    }
    if list.is_empty() {
        list
    } else {
        format!("<h2>Expectations</h2>\n<ul>\n{list}</ul>\n")
    }
}

fn by_reference(rows: &[TableRow]) -> Vec<(&str, Vec<&TableRow>)> {
    let mut groups: Vec<(&str, Vec<&TableRow>)> = Vec::new();
    for row in rows {
        match groups.last_mut() {
            Some((reference, group)) if *reference == row.reference => group.push(row),
            _ => groups.push((&row.reference, vec![row])),
        }
    }
    groups
}

fn score_table(rows: &[&TableRow], difference: Option<&DifferenceRow>) -> String {
    let mut table = String::from("<table><thead><tr><th>supervision</th>");
    for metric in METRICS {
        let _ = write!(table, "<th>{}</th>", metric.heading);
    }
    for bin in KBin::ALL {
        let n_shapes = rows[0]
            .bins
            .iter()
            .find(|mean| mean.bin == bin)
            .map_or(0, |mean| mean.n_shapes);
        let _ = write!(table, "<th>K = {} ({n_shapes})</th>", escaped(bin.name()));
    }
    table.push_str("<th>shapes</th><th>seeds</th></tr></thead><tbody>\n");
    for row in rows {
        let _ = write!(table, "<tr><td>{}</td>", escaped(&row.supervision));
        let means = METRICS.iter().map(|metric| row.means.get(metric).copied());
        for value in means.chain(row.bins.iter().map(|mean| mean.miou)) {
            table.push_str(&value.map_or_else(
                || "<td>–</td>".to_owned(),
                |value| format!("<td>{value:.3}</td>"),
            ));
        }
        let _ = writeln!(
            table,
            "<td>{}</td><td>{}</td></tr>",
            row.n_shapes, row.n_seeds
        );
    }
    if let Some(difference) = difference {
        table.push_str(&difference_cells(difference));
    }
    table.push_str("</tbody></table>\n");
    table
}

fn difference_cells(row: &DifferenceRow) -> String {
    let mut cells = format!(
        "<tr><td>Δ {} − {}</td>",
        escaped(&row.compared[0]),
        escaped(&row.compared[1])
    );
    for metric in METRICS {
        let text = match row.differences.get(metric) {
            Some(difference) => match &difference.interval {
                Some(interval) => format!(
                    "{:+.3} [{:+.3}, {:+.3}]",
                    difference.mean, interval.low, interval.high
                ),
                None => format!("{:+.3}", difference.mean),
            },
            None => "–".to_owned(),
        };
        let _ = write!(cells, "<td>{text}</td>");
    }
    let _ = writeln!(
        cells,
        "<td colspan=\"{}\"></td><td>{}</td><td></td></tr>",
        KBin::ALL.len(),
        row.n_shapes
    );
    cells
}

/// The log's values of one kind of event: (step, value) by supervision and seed.
fn series(log: &str, event: &str, field: &str) -> BTreeMap<String, Vec<(f64, f64)>> {
    let mut series: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for line in log
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok())
    {
        let name = format!(
            "{} seed {}",
            line["supervision"].as_str().unwrap_or_default(),
            line["seed"]
        );
        if line["event"] == event
            && let (Some(step), Some(value)) = (line["step"].as_f64(), line[field].as_f64())
        {
            let points = series.entry(name).or_default();
            // A resumed run has logged some steps twice; the later line is the one that counts.
            while points.last().is_some_and(|&(former, _)| former >= step) {
                points.pop();
            }
            points.push((step, value));
        }
    }
    series
}

/// A line chart as inline SVG; empty where the log has no such event.
fn curves(title: &str, log: &str, event: &str, field: &str) -> String {
    let series = series(log, event, field);
    let all: Vec<(f64, f64)> = series.values().flatten().copied().collect();
    let last_step = all.iter().map(|point| point.0).fold(0.0, f64::max);
    let highest = all.iter().map(|point| point.1).fold(0.0, f64::max);
    if last_step <= 0.0 || highest <= 0.0 {
        return String::new();
    }
    let place = |(step, value): (f64, f64)| {
        (
            50.0 + 700.0 * step / last_step,
            260.0 - 240.0 * value / highest,
        )
    };
    let mut svg = format!(
        "<h2>{title}</h2>\n<svg viewBox=\"0 0 800 {}\" role=\"img\">",
        300 + 20 * series.len()
    );
    svg.push_str("<path d=\"M50 20V260H750\" fill=\"none\" stroke=\"#888\"/>");
    let _ = write!(
        svg,
        "<text x=\"44\" y=\"26\" text-anchor=\"end\" font-size=\"12\">{highest:.2}</text>"
    );
    let _ = write!(
        svg,
        "<text x=\"44\" y=\"264\" text-anchor=\"end\" font-size=\"12\">0</text>"
    );
    let _ = write!(
        svg,
        "<text x=\"750\" y=\"278\" text-anchor=\"end\" font-size=\"12\">step {last_step}</text>"
    );
    for (idx, (name, points)) in series.iter().enumerate() {
        let color = COLORS[idx % COLORS.len()];
        let path: Vec<String> = points
            .iter()
            .map(|&point| place(point))
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        let _ = write!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>",
            path.join(" ")
        );
        let y = 298 + 20 * idx;
        let _ = write!(
            svg,
            "<text x=\"60\" y=\"{y}\" font-size=\"13\" fill=\"{color}\">{}</text>",
            escaped(name)
        );
    }
    svg.push_str("</svg>\n");
    svg
}

/// mIoU of each held-out shape, under the first reference and seed.
fn shape_table(report: &RunReport<'_>) -> String {
    let Some(first) = report.tables.rows.first() else {
        return String::new();
    };
    let names: Vec<&str> = report
        .tables
        .rows
        .iter()
        .filter(|row| row.reference == first.reference)
        .map(|row| row.supervision.as_str())
        .collect();
    let mut shapes: BTreeMap<&str, (usize, BTreeMap<&str, f64>)> = BTreeMap::new();
    for row in report
        .rows
        .iter()
        .rev()
        .filter(|row| row.reference == first.reference)
    {
        let shape = shapes.entry(&row.shape).or_default();
        shape.0 = row.k;
        shape
            .1
            .insert(&row.supervision, MIOU.of(row).unwrap_or(f64::NAN));
    }
    let mut table = format!(
        "<details><summary>Every held-out shape against <code>{}</code> (mIoU)</summary><table><thead><tr><th>shape</th><th>K</th>",
        escaped(&first.reference)
    );
    for name in &names {
        let _ = write!(table, "<th>{}</th>", escaped(name));
    }
    table.push_str("</tr></thead><tbody>\n");
    for (shape, (k, mious)) in shapes {
        let _ = write!(table, "<tr><td>{}</td><td>{k}</td>", escaped(shape));
        for name in &names {
            let _ = write!(
                table,
                "<td>{:.3}</td>",
                mious.get(name).copied().unwrap_or(f64::NAN)
            );
        }
        table.push_str("</tr>\n");
    }
    table.push_str("</tbody></table></details>\n");
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resumed_log_counts_each_step_once() {
        let log = "{\"event\":\"step\",\"supervision\":\"a\",\"seed\":0,\"step\":1,\"loss\":3.0}\n\
                   {\"event\":\"step\",\"supervision\":\"a\",\"seed\":0,\"step\":2,\"loss\":2.0}\n\
                   {\"event\":\"step\",\"supervision\":\"a\",\"seed\":0,\"step\":2,\"loss\":2.5}\nnot json\n";
        let found = series(log, "step", "loss");
        assert_eq!(found["a seed 0"], [(1.0, 3.0), (2.0, 2.5)]);
        assert!(curves("Loss", log, "step", "loss").contains("<polyline"));
        assert!(curves("Loss", "", "step", "loss").is_empty());
    }

    #[test]
    fn text_cannot_break_out_of_the_page() {
        assert_eq!(
            escaped("<a href=\"x\">&"),
            "&lt;a href=&quot;x&quot;&gt;&amp;"
        );
    }
}
