//! Lists the reference parts by the IoU that they lost, with their type, their size, and the destination of their points.

use crate::html::{id_html, section};
use crate::matched::Loss;
use crate::names::Names;
use crate::shape_digest::{PredictionDigest, ReferenceDigest, ShapeDigest};
use crate::sortable_table::{Cell, SortableTable};

/// The largest number of rows of the table.
const MAX_ROWS: usize = 1500;

/// A part under one prediction.
struct LostPart<'a> {
    shape: usize,
    prediction: &'a PredictionDigest,
    reference: &'a ReferenceDigest,
    part: usize,
}

impl LostPart<'_> {
    fn lost(&self) -> f64 {
        1.0 - self.prediction.iou[self.part]
    }

    fn size(&self) -> f64 {
        self.reference.parts[self.part].size
    }

    fn type_of(&self, part: usize) -> &'static str {
        let face_type = self
            .reference
            .parts
            .get(part)
            .and_then(|part| part.face_type);
        face_type.map_or("", |face_type| face_type.name())
    }

    fn outcome_text(&self) -> String {
        let named = |other: usize| {
            let label = self.reference.parts.get(other).map_or(0, |part| part.label);
            format!("part {label} {}", self.type_of(other))
                .trim_end()
                .to_owned()
        };
        match self.prediction.loss[self.part] {
            Loss::Nothing => "found exactly".to_owned(),
            Loss::MergedInto(other) => format!("merged into {}", named(other)),
            Loss::TakesIn(other) => format!("takes in {}", named(other)),
            Loss::Split => "split".to_owned(),
        }
    }
}

/// The section with the table. It is empty if no trained backbone has predicted a shape.
pub(crate) fn lost_parts(shapes: &[ShapeDigest], names: &Names<'_>) -> String {
    let mut parts = Vec::new();
    for (idx, shape) in shapes.iter().enumerate() {
        for prediction in
            main_predictions(shape).filter(|found| names.is_trained(&found.supervision))
        {
            let reference = &shape.references[prediction.reference];
            parts.extend((0..reference.parts.len()).map(|part| LostPart {
                shape: idx,
                prediction,
                reference,
                part,
            }));
        }
    }
    let n_parts = parts.len();
    let order = |a: &LostPart<'_>, b: &LostPart<'_>| {
        let by_loss = b.lost().total_cmp(&a.lost());
        by_loss.then(b.size().total_cmp(&a.size()))
    };
    parts.sort_by(order);
    parts.truncate(MAX_ROWS);

    let mut table = SortableTable::new("part-losses", "Parts by lost IoU")
        .column("shape", false)
        .column("part", true)
        .column("type", false)
        .column("size %", true)
        .column("faces", true)
        .column("trained on", false)
        .column("lost IoU", true)
        .column("what happened", false)
        .with_filter("a type, a shape, a label source, merged …")
        .scrolling();
    for part in &parts {
        table.row("", &cells(part, &shapes[part.shape], names));
    }
    let shown = if n_parts > parts.len() {
        format!(
            " The {} of {n_parts} that lost most are listed.",
            parts.len()
        )
    } else {
        String::new()
    };
    section(
        "lost-parts",
        "Parts that were lost",
        &format!(
            "The lost IoU is 1 minus the IoU of a part with its cluster. The size is the share of the points of the shape. The type \
             is that of the face on which most of its points lie. First seed, first clusterer.{shown}"
        ),
        &table.to_html(),
    )
}

/// The predictions that pictures and tables of parts show: the first reference and clusterer, the first seed of each row.
pub(crate) fn main_predictions(shape: &ShapeDigest) -> impl Iterator<Item = &PredictionDigest> {
    let clusterer = shape
        .predictions
        .first()
        .map(|first| first.clusterer.as_str());
    let is_main = move |found: &&PredictionDigest| {
        let is_first_seed = shape
            .predictions
            .iter()
            .find(|other| other.supervision == found.supervision)
            .is_some_and(|other| other.seed == found.seed);
        found.reference == 0 && Some(found.clusterer.as_str()) == clusterer && is_first_seed
    };
    shape.predictions.iter().filter(is_main)
}

fn cells(part: &LostPart<'_>, shape: &ShapeDigest, names: &Names<'_>) -> Vec<Cell> {
    let facts = part.reference.parts[part.part];
    let n_faces = (facts.n_faces > 0).then_some(facts.n_faces);
    vec![
        Cell::html(format!(
            "<a href=\"#view\" data-shape=\"{}\" data-part=\"{}\">{}</a>",
            part.shape,
            part.part,
            id_html(&shape.id)
        )),
        Cell::number(Some(f64::from(facts.label)), &facts.label.to_string()),
        Cell::text(part.type_of(part.part)),
        Cell::number(Some(facts.size), &format!("{:.1}", 100.0 * facts.size)),
        Cell::number(
            n_faces.map(|n| n as f64),
            &n_faces.map_or_else(|| "–".to_owned(), |n| n.to_string()),
        ),
        Cell::html(names.swatch(&part.prediction.supervision)),
        Cell::score(Some(part.lost())).with_bar(),
        Cell::text(&part.outcome_text()),
    ]
}
