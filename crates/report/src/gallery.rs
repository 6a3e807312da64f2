//! Writes the pictures of test shapes, beginning with the worst: the reference and the main predictions. The page paints them
//! from the points that it has.

use crate::html::{escaped, id_html, section};
use crate::lost_parts::main_predictions;
use crate::names::Names;
use crate::shape_digest::{PredictionDigest, ShapeDigest};
use std::fmt::Write as _;

/// Rows without a training that also have pictures.
const PICTURED: [&str; 2] = ["no-network", "untrained"];

/// The section with one card per shape. It is empty without shapes.
pub(crate) fn gallery(shapes: &[ShapeDigest], names: &Names<'_>) -> String {
    let mut order: Vec<usize> = (0..shapes.len())
        .filter(|&idx| !shapes[idx].references.is_empty())
        .collect();
    let score = |idx: usize| main_score(&shapes[idx], names).unwrap_or(2.0);
    order.sort_by(|&a, &b| score(a).total_cmp(&score(b)));
    let cards: Vec<String> = order
        .iter()
        .map(|&idx| card(idx, &shapes[idx], names))
        .collect();
    if cards.is_empty() {
        return String::new();
    }
    let body = format!(
        "<p class=\"filter\"><label>Order <select id=\"gallery-order\"><option value=\"worst\">worst first</option>\
         <option value=\"best\">best first</option><option value=\"parts\">most parts first</option></select></label> \
         <label><input type=\"checkbox\" id=\"gallery-wrong\"> show what is wrong</label></p>\n\
         <div id=\"cards\">{}</div>\n<p><button type=\"button\" id=\"more-cards\">Show more shapes</button></p>\n",
        cards.concat()
    );
    section(
        "shapes",
        "Reference and predictions",
        "A cluster has the color of the part that it was matched to; gray clusters belong to no part. Under each picture is its mIoU. \
         The order is by the first trained label source. Choose a picture to turn the shape in 3D.",
        &body,
    )
}

fn main_score(shape: &ShapeDigest, names: &Names<'_>) -> Option<f64> {
    let trained = main_predictions(shape).filter(|found| names.is_trained(&found.supervision));
    let first = trained.min_by_key(|found| names.color(&found.supervision));
    first.map(|found| found.miou)
}

fn card(idx: usize, shape: &ShapeDigest, names: &Names<'_>) -> String {
    let reference = &shape.references[0];
    let k = reference.parts.len();
    let score = main_score(shape, names).unwrap_or(2.0);
    let mut html = format!(
        "<article class=\"card\" data-score=\"{score:.4}\" data-k=\"{k}\" hidden><h3>{} <span>K = {k}</span></h3><div class=\"pics\">",
        id_html(&shape.id)
    );
    html.push_str(&picture(
        idx,
        "r0",
        &shape.id,
        "reference",
        &escaped(&reference.source),
    ));
    let is_pictured = |found: &&PredictionDigest| {
        names.is_trained(&found.supervision) || PICTURED.contains(&found.supervision.as_str())
    };
    let mut pictured: Vec<&PredictionDigest> =
        main_predictions(shape).filter(is_pictured).collect();
    pictured.sort_by_key(|found| names.color(&found.supervision));
    for found in pictured {
        // The index is the one in the digest. The data of the page uses the same index.
        let index = shape
            .predictions
            .iter()
            .position(|other| std::ptr::eq(other, found));
        let layer = format!("p{}", index.unwrap_or(0));
        let caption = format!(
            "{} <b>{:.3}</b>",
            names.swatch(&found.supervision),
            found.miou
        );
        html.push_str(&picture(
            idx,
            &layer,
            &shape.id,
            &found.supervision,
            &caption,
        ));
    }
    html + "</div></article>\n"
}

fn picture(idx: usize, layer: &str, id: &str, what: &str, caption: &str) -> String {
    let mut html = String::new();
    let _ = write!(
        html,
        "<a class=\"pic\" href=\"#view\" data-shape=\"{idx}\" data-layer=\"{layer}\"><canvas width=\"2\" height=\"2\" role=\"img\" \
         aria-label=\"{}: {}\"></canvas><span>{caption}</span></a>",
        escaped(id),
        escaped(what)
    );
    html
}
