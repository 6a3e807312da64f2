//! Writes the head of the page: the answer, the expectations, and the mean of every row with its interval.

use crate::answer::Answer;
use crate::chart::{Chart, IntervalRow, interval_rows};
use crate::html::{escaped, section, with_code};
use crate::names::Names;
use crate::shape_scores::{MainTable, mean_of};
use partprobe_eval::{ExpectationOutcome, MIOU, ScoreRow, Tables};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The answer, with the name of the run and a summary of its shapes.
pub(crate) fn answer_html(name: &str, answer: &Answer, summary: &str, notes: &[String]) -> String {
    let mut html = format!(
        "<section id=\"answer\" aria-labelledby=\"answer-h\">\n<p class=\"run\">Run <code>{}</code></p>\n\
         <h1 id=\"answer-h\">{}</h1>\n",
        escaped(name),
        with_unbroken_words(&answer.headline)
    );
    for (class, text) in [("answer", &answer.sentence), ("power", &answer.power)] {
        if !text.is_empty() {
            let _ = writeln!(html, "<p class=\"{class}\">{}</p>", with_code(text));
        }
    }
    for text in std::iter::once(summary).chain(notes.iter().map(String::as_str)) {
        if !text.is_empty() {
            let _ = writeln!(
                html,
                "<p class=\"note\">{}</p>",
                escaped(&capitalized(text))
            );
        }
    }
    html + "</section>\n"
}

/// Text whose words with hyphens stay on one line.
fn with_unbroken_words(text: &str) -> String {
    let words = text.split(' ').map(|word| match word.contains('-') {
        true => format!("<span class=\"nb\">{}</span>", escaped(word)),
        false => escaped(word),
    });
    words.collect::<Vec<_>>().join(" ")
}

fn capitalized(text: &str) -> String {
    let mut chars = text.chars();
    let first = chars.next().map(|first| first.to_uppercase().to_string());
    let end = if text.ends_with(['.', ')']) { "" } else { "." };
    format!("{}{}{end}", first.unwrap_or_default(), chars.as_str())
}

/// The bounds of the config, each with the value that was found. It is empty without bounds.
pub(crate) fn expectations(outcomes: &[ExpectationOutcome]) -> String {
    let mut list = String::new();
    for outcome in outcomes {
        let (class, verdict) = match outcome.passed {
            true => ("met", "met"),
            false => ("missed", "missed"),
        };
        let _ = writeln!(
            list,
            "<li class=\"{class}\"><b>{verdict}</b> <code>{}</code> <span>found {:.4}</span></li>",
            escaped(&outcome.text),
            outcome.value
        );
    }
    if !list.is_empty() {
        list = format!("<ul class=\"bounds\">\n{list}</ul>\n");
    }
    let n_missed = outcomes.iter().filter(|outcome| !outcome.passed).count();
    let lead = match n_missed {
        0 => "Every bound of the config's <code>[expect]</code> is met.".to_owned(),
        n => format!(
            "{n} of {} bounds of the config's <code>[expect]</code> are missed.",
            outcomes.len()
        ),
    };
    section("expectations", "Expectations", &lead, &list)
}

/// The section with the chart of the means. It is empty without scores.
pub(crate) fn means(chart: Option<&Chart>) -> String {
    let body = chart.map_or_else(String::new, Chart::to_html);
    section("means", "At a glance", "", &body)
}

/// The mean mIoU of every row of the first table. Returns `None` without scores.
pub(crate) fn means_chart(tables: &Tables, rows: &[ScoreRow], names: &Names<'_>) -> Option<Chart> {
    let main = MainTable::of(tables)?;
    let chart_rows = main.supervisions(tables).filter_map(|name| {
        let found = mean_of(&main.scores(rows, name, MIOU))?;
        Some(IntervalRow {
            name: name.to_owned(),
            mean: found.mean,
            interval: found.interval.map(|interval| [interval.low, interval.high]),
            values: means_of_seeds(rows, main, name),
            color: names.is_trained(name).then(|| names.color(name)),
        })
    });
    let chart_rows: Vec<IntervalRow> = chart_rows.collect();
    let drawing = interval_rows(&chart_rows, "mean mIoU")?;
    let interval = if chart_rows.iter().any(|row| row.interval.is_some()) {
        "lines are 95 % intervals over groups of related shapes"
    } else {
        "too few groups of related shapes for intervals"
    };
    let caption = format!(
        "Mean mIoU against {}, clusters by {}; {interval}; small marks are single seeds",
        main.reference, main.clusterer
    );
    Some(Chart::new("means", caption, drawing))
}

/// The mean of each seed, if there are several.
fn means_of_seeds(rows: &[ScoreRow], main: MainTable<'_>, name: &str) -> Vec<f64> {
    let mut seeds: BTreeMap<u64, Vec<ScoreRow>> = BTreeMap::new();
    for row in rows.iter().filter(|row| row.supervision == name) {
        seeds.entry(row.seed).or_default().push(row.clone());
    }
    if seeds.len() < 2 {
        return Vec::new();
    }
    let mean = |rows: &Vec<ScoreRow>| Some(mean_of(&main.scores(rows, name, MIOU))?.mean);
    seeds.values().filter_map(mean).collect()
}
