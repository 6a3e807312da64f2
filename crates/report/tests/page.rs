//! Tests properties of the whole page: it loads nothing, no text breaks its structure, and a section is present if it has
//! content.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot make its own input has failed"
)]

use partprobe_carrier::FaceType;
use partprobe_eval::{
    ACCURACY, Bootstrap, ExpectationOutcome, MIOU, ScoreRow, TableSettings, Tables, tables,
};
use partprobe_report::{Fact, Prediction, ReportShape, RunReport, ShapeDigest, ShapeFaces};
use std::collections::BTreeMap;

/// Twelve shapes under two label sources, three doses of damage and a row without a training.
fn rows(names: &[(&str, f64)]) -> Vec<ScoreRow> {
    let mut rows = Vec::new();
    for shape in 0..12 {
        for (supervision, score) in names {
            rows.push(ScoreRow {
                shape: format!("shape-{shape:02}"),
                supervision: (*supervision).to_owned(),
                seed: 0,
                reference: "step-parts".to_owned(),
                clusterer: "k-means".to_owned(),
                k: 2,
                scores: BTreeMap::from([(MIOU, score + 0.01 * f64::from(shape)), (ACCURACY, 0.5)]),
                group: format!("group-{shape}"),
            });
        }
    }
    rows
}

const NAMES: [(&str, f64); 6] = [
    ("step-parts", 0.8),
    ("other", 0.6),
    ("step-flipped-20", 0.7),
    ("step-flipped-40", 0.5),
    ("labels-of-step-flipped-20", 0.75),
    ("no-network", 0.2),
];

fn compared(rows: &[ScoreRow]) -> Tables {
    let settings = TableSettings {
        bin_reference: "step-parts".to_owned(),
        clusterer: "k-means".to_owned(),
        compared: ["other", "step-flipped-20", "step-flipped-40"]
            .map(|other| ["step-parts".to_owned(), other.to_owned()])
            .to_vec(),
        primary: Vec::new(),
        seed_deviation: None,
        footer: Vec::new(),
        bootstrap: Bootstrap {
            draws: 200,
            seed: 0,
            least_groups: 2,
        },
    };
    tables(rows, &settings)
}

/// A plate of two parts, which the prediction merges.
fn digest(id: &str, supervision: &str) -> ShapeDigest {
    let points: Vec<[f32; 3]> = (0..200u8)
        .map(|idx| [f32::from(idx % 20), f32::from(idx / 20), 0.0])
        .collect();
    ShapeDigest::of(&ReportShape {
        id: id.to_owned(),
        normals: vec![[0.0, 0.0, 1.0]; points.len()],
        references: vec![(
            "step-parts".to_owned(),
            points
                .iter()
                .map(|point| i32::from(point[0] > 9.0))
                .collect(),
        )],
        predictions: vec![Prediction {
            supervision: supervision.to_owned(),
            seed: 0,
            reference: "step-parts".to_owned(),
            clusterer: "k-means".to_owned(),
            clusters: vec![0; points.len()],
        }],
        faces: Some(ShapeFaces {
            of_point: vec![0; points.len()],
            types: vec![FaceType::Plane],
            step_ids: vec![77],
        }),
        points,
    })
}

/// A report with all sections, and with these names as texts from outside.
fn page(name: &str, supervision: &str) -> String {
    let rows = rows(&NAMES);
    let tables = compared(&rows);
    let trained: Vec<String> = [supervision, "other", "step-flipped-20", "step-flipped-40"]
        .map(str::to_owned)
        .to_vec();
    let log: String = (0..400)
        .map(|step| {
            let line = serde_json::json!({"event": "step", "supervision": supervision, "seed": 0, "step": step, "loss": 1.0});
            format!("{line}\n")
        })
        .collect();
    RunReport {
        name,
        summary: name,
        notes: &[name.to_owned()],
        trained: &trained,
        tables: &tables,
        rows: &rows,
        outcomes: &[ExpectationOutcome {
            text: name.to_owned(),
            value: 0.5,
            passed: false,
        }],
        further: &[format!(
            "{name}\n\n| {name} |\n|---|\n| ![{name}](https://example.com/{name}) |\n"
        )],
        log: &log,
        facts: &[Fact::new(name, name)],
        config: name,
        shapes: &[digest("shape-00", supervision), digest(name, supervision)],
    }
    .to_html()
}

const SECTIONS: [&str; 14] = [
    "answer",
    "expectations",
    "means",
    "scores",
    "statistics",
    "dose-response",
    "shapes",
    "view",
    "lost-parts",
    "types",
    "distributions",
    "every-shape",
    "curves",
    "facts",
];

fn has(page: &str, section: &str) -> bool {
    page.contains(&format!("<section id=\"{section}\""))
}

#[test]
fn a_section_is_there_if_it_has_something_to_show() {
    let full = page("run", "step-parts");
    let missing: Vec<&str> = SECTIONS
        .into_iter()
        .filter(|section| !has(&full, section))
        .collect();
    assert_eq!(missing, [""; 0]);
    let empty = RunReport::default().to_html();
    let present: Vec<&str> = SECTIONS
        .into_iter()
        .filter(|section| has(&empty, section))
        .collect();
    assert_eq!(present, ["answer"]);
    for page in [full, empty] {
        for link in page.split("href=\"#").skip(1) {
            let id = link.split('"').next().unwrap();
            assert!(
                page.contains(&format!("id=\"{id}\"")),
                "a link to {id}, which is not there"
            );
        }
    }
}

#[test]
fn the_answer_has_its_interval_and_its_power() {
    let page = page("run", "step-parts");
    for message in [
        "Labels of <span class=\"nb\">step-parts</span> train a better backbone than labels of other.",
        "is +0.200 [+0.200, +0.200] over 12 test shapes, scored against step-parts",
        "12 shapes in 12 groups of related shapes",
        "The reference is one of the two",
        "other scores as step-parts with 30 (30 to 30) % of its faces given to another part.",
        "merged into part 0 plane",
    ] {
        assert!(page.contains(message), "{message}");
    }
}

#[test]
fn every_id_is_there_once() {
    let page = page("run", "step-parts");
    let ids: Vec<&str> = page
        .split(" id=\"")
        .skip(1)
        .filter_map(|rest| rest.split('"').next())
        .collect();
    for id in &ids {
        assert_eq!(ids.iter().filter(|other| *other == id).count(), 1, "{id}");
    }
    assert!(ids.len() > 30, "{ids:?}");
}

#[test]
fn the_page_requests_no_other_file() {
    let page = page("run", "step-parts");
    for outside in [
        "http:",
        "https:",
        "//cdn",
        " src=",
        "@import",
        "url(",
        "fetch(",
        "XMLHttpRequest",
        "import(",
    ] {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn no_text_breaks_out_of_the_page() {
    let hostile = "</script></title><script>alert(1)</script><img onerror='x' \"&";
    let (plain, attacked) = (page("run", "unknown"), page(hostile, hostile));
    for tag in ["<script", "</script", "<title", "<img"] {
        let count = |page: &str| page.matches(tag).count();
        assert_eq!(count(&attacked), count(&plain), "{tag}");
    }
    // The data of the scripts is one element, which no text can end. Quotes have no meaning in it.
    let (before, data) = attacked
        .split_once("<script type=\"application/json\"")
        .unwrap();
    let (data, after) = data.split_once("</script>").unwrap();
    assert!(!data.contains('<'), "data");
    for html in [before, after] {
        assert!(!html.contains("alert(1)<") && !html.contains("onerror='"));
    }
}

#[test]
fn the_same_report_gives_the_same_page() {
    assert_eq!(page("run", "step-parts"), page("run", "step-parts"));
}
