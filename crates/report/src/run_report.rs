//! Defines the content of the page, and assembles its sections.

use crate::answer::answer;
use crate::chart::Chart;
use crate::curves::Curves;
use crate::distributions::{distribution_charts, distributions};
use crate::dose_response::{dose_charts, dose_response};
use crate::embedded_points::{MAX_BYTES, embedded_points};
use crate::facts::{Fact, facts};
use crate::gallery::gallery;
use crate::html::escaped;
use crate::lost_parts::lost_parts;
use crate::names::Names;
use crate::overview::{answer_html, expectations, means, means_chart};
use crate::score_tables::score_tables;
use crate::shape_digest::ShapeDigest;
use crate::shape_scores::shape_table;
use crate::statistics::statistics;
use crate::type_confusion::{type_charts, type_confusion};
use crate::viewer::viewer;
use partprobe_eval::{ExpectationOutcome, MIOU, ScoreRow, Tables};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::LazyLock;

const STYLE: &str = concat!(
    include_str!("../assets/colors.css"),
    include_str!("../assets/page.css"),
    include_str!("../assets/chart.css"),
);
/// The scripts, in the order in which they need each other.
const SCRIPTS: [&str; 7] = [
    include_str!("../assets/page.js"),
    include_str!("../assets/points.js"),
    include_str!("../assets/colors.js"),
    include_str!("../assets/camera.js"),
    include_str!("../assets/painter.js"),
    include_str!("../assets/pictures.js"),
    include_str!("../assets/view.js"),
];

/// The tables of a report that has none.
static NO_TABLES: LazyLock<Tables> = LazyLock::new(|| Tables {
    clusterer: String::new(),
    rows: Vec::new(),
    differences: Vec::new(),
    same_source: Vec::new(),
    home_advantages: Vec::new(),
    footer: Vec::new(),
});

/// The content of the page.
#[derive(Clone, Debug)]
pub struct RunReport<'a> {
    /// The name of the run.
    pub name: &'a str,
    /// The number of shapes, in one sentence.
    pub summary: &'a str,
    /// Further remarks, one sentence each.
    pub notes: &'a [String],
    /// The label sources on which backbones were trained, in the order of the config.
    pub trained: &'a [String],
    /// The tables of scores.
    pub tables: &'a Tables,
    /// The scores of each shape.
    pub rows: &'a [ScoreRow],
    /// The expectations, and whether they are met.
    pub outcomes: &'a [ExpectationOutcome],
    /// Markdown texts with further tables: those of the paper, and those of endpoints.
    pub further: &'a [String],
    /// The log of the trainings, one JSON object per line, with `event`, `supervision`, `seed` and `step`.
    pub log: &'a str,
    /// The facts of the run.
    pub facts: &'a [Fact],
    /// The merged config, as TOML.
    pub config: &'a str,
    /// The test shapes.
    pub shapes: &'a [ShapeDigest],
}

impl Default for RunReport<'_> {
    fn default() -> Self {
        Self {
            name: "",
            summary: "",
            notes: &[],
            trained: &[],
            tables: &NO_TABLES,
            rows: &[],
            outcomes: &[],
            further: &[],
            log: "",
            facts: &[],
            config: "",
            shapes: &[],
        }
    }
}

impl RunReport<'_> {
    /// The page as HTML.
    #[must_use]
    pub fn to_html(&self) -> String {
        let sections = self.sections();
        let mut page = self.head();
        page.push_str(&navigation(&sections));
        page.push_str("<main id=\"main\">\n");
        page.push_str(&sections);
        page.push_str("</main>\n<footer>Made by <code>partprobe</code>. This page loads nothing from elsewhere.</footer>\n");
        let mut scripts = String::new();
        for script in SCRIPTS {
            let _ = writeln!(scripts, "<script>\n{script}</script>");
        }
        scripts.push_str("</body></html>\n");
        let budget = MAX_BYTES.saturating_sub(page.len() + scripts.len());
        page.push_str(&embedded_points(self.shapes, budget));
        page.push_str(&scripts);
        page
    }

    /// The charts of the page, in its order.
    #[must_use]
    pub fn charts(&self) -> Vec<Chart> {
        let names = Names::new(self.trained);
        let mut charts = Vec::new();
        charts.extend(means_chart(self.tables, self.rows, &names));
        charts.extend(dose_charts(self.tables, self.rows, &names));
        charts.extend(type_charts(self.shapes, &names));
        charts.extend(distribution_charts(
            self.tables,
            self.rows,
            self.shapes,
            &names,
        ));
        let curves = Curves::of(self.log, &names);
        charts.extend(curves.groups.into_iter().flat_map(|group| group.charts));
        charts
    }

    fn head(&self) -> String {
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
             <meta name=\"color-scheme\" content=\"light dark\">\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\
             <title>{} · partprobe</title><style>{STYLE}</style></head><body>\n<a class=\"skip\" href=\"#main\">Skip to the content</a>\n",
            escaped(self.name)
        )
    }

    fn sections(&self) -> String {
        let names = Names::new(self.trained);
        let index_of_shape: BTreeMap<&str, usize> = self
            .shapes
            .iter()
            .map(|shape| shape.id.as_str())
            .zip(0..)
            .collect();
        [
            answer_html(
                self.name,
                &answer(self.tables, self.trained),
                self.summary,
                self.notes,
            ),
            expectations(self.outcomes),
            means(means_chart(self.tables, self.rows, &names).as_ref()),
            score_tables(self.tables, &names),
            statistics(self.tables, self.further),
            dose_response(&dose_charts(self.tables, self.rows, &names), self.tables),
            gallery(self.shapes, &names),
            viewer(self.shapes),
            lost_parts(self.shapes, &names),
            type_confusion(&type_charts(self.shapes, &names)),
            distributions(&distribution_charts(
                self.tables,
                self.rows,
                self.shapes,
                &names,
            )),
            shape_table(self.tables, self.rows, MIOU, &index_of_shape),
            Curves::of(self.log, &names).to_html(),
            facts(self.facts, self.config),
        ]
        .concat()
    }
}

/// The names of the links, by section. A missing section has no link.
const LINKS: [(&str, &str); 13] = [
    ("answer", "Answer"),
    ("expectations", "Expectations"),
    ("scores", "Scores"),
    ("statistics", "Statistics"),
    ("dose-response", "Doses"),
    ("shapes", "Pictures"),
    ("view", "3D"),
    ("lost-parts", "Lost parts"),
    ("types", "Types"),
    ("distributions", "Distributions"),
    ("every-shape", "Shapes"),
    ("curves", "Curves"),
    ("facts", "The run"),
];

fn navigation(sections: &str) -> String {
    let mut html = String::from("<nav aria-label=\"Sections\"><ul>");
    for (id, name) in LINKS {
        if sections.contains(&format!("<section id=\"{id}\"")) {
            let _ = write!(html, "<li><a href=\"#{id}\">{name}</a></li>");
        }
    }
    html + "</ul></nav>\n"
}
