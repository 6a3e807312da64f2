//! Packs the points of all shapes into the page. They are quantized, compressed, written as base64, and thinned out until the
//! page fits.
//!
//! The page has a JSON list with one entry per shape, and one block of bytes per shape: deflated planes of one byte per point.
//! These are, in this order: the high and the low bytes of x, of y and of z; the two coordinates of the normals; if the shape has
//! faces, the high and the low bytes of their indices; for each reference and then for each prediction, the high and the low
//! bytes of the part of each point.

use crate::html::json_for_script;
use crate::lost_parts::main_predictions;
use crate::shape_digest::{PredictionDigest, ReferenceDigest, ShapeDigest};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::Write as _;

/// The largest page, in bytes: 25 MB.
pub const MAX_BYTES: usize = 25_000_000;

/// The level of detail of each shape in the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Detail {
    /// One of this number of kept points is packed.
    every: usize,
    /// Whether only the predictions by the first reference, clusterer and seed are packed.
    only_main: bool,
}

/// The levels, from all data to very little.
const DETAILS: [Detail; 6] = [
    Detail {
        every: 1,
        only_main: false,
    },
    Detail {
        every: 1,
        only_main: true,
    },
    Detail {
        every: 2,
        only_main: true,
    },
    Detail {
        every: 5,
        only_main: true,
    },
    Detail {
        every: 20,
        only_main: true,
    },
    Detail {
        every: 100,
        only_main: true,
    },
];

/// The data elements of all shapes, in at most `budget` bytes, with as much detail as fits. It is empty if even the lowest level
/// of detail does not fit.
pub(crate) fn embedded_points(shapes: &[ShapeDigest], budget: usize) -> String {
    for detail in DETAILS {
        if let Some(html) = with_detail(shapes, detail, budget) {
            return html;
        }
    }
    String::new()
}

fn with_detail(shapes: &[ShapeDigest], detail: Detail, budget: usize) -> Option<String> {
    let facts: Vec<Value> = shapes.iter().map(|shape| facts_of(shape, detail)).collect();
    let mut html = format!(
        "<script type=\"application/json\" id=\"shape-data\">{}</script>\n",
        json_for_script(&Value::Array(facts))
    );
    for (idx, shape) in shapes.iter().enumerate() {
        let _ = writeln!(
            html,
            "<script type=\"text/plain\" id=\"points-{idx}\">{}</script>",
            STANDARD.encode(deflated(&planes(shape, detail)))
        );
        if html.len() > budget {
            return None;
        }
    }
    Some(html)
}

/// The predictions that are packed, with their indices in the digest.
fn predictions_of(
    shape: &ShapeDigest,
    detail: Detail,
) -> impl Iterator<Item = (usize, &PredictionDigest)> {
    let is_main = move |found: &PredictionDigest| {
        main_predictions(shape).any(|main| std::ptr::eq(main, found))
    };
    let all = shape.predictions.iter().enumerate();
    all.filter(move |(_, found)| !detail.only_main || is_main(found))
}

fn facts_of(shape: &ShapeDigest, detail: Detail) -> Value {
    let round = |value: f64| (value * 1e4).round() / 1e4;
    let parts = |reference: &ReferenceDigest| -> Vec<Value> {
        let part = reference.parts.iter().map(|part| {
            let face_type = part.face_type.map(|face_type| face_type.name());
            json!([part.label, round(part.size), face_type, part.n_faces])
        });
        part.collect()
    };
    let references = shape
        .references
        .iter()
        .map(|reference| json!({"name": reference.source, "parts": parts(reference)}));
    let predictions = predictions_of(shape, detail).map(|(idx, found)| {
        json!({
            "i": idx,
            "name": found.supervision,
            "seed": found.seed,
            "ref": found.reference,
            "by": found.clusterer,
            "miou": round(found.miou),
            "iou": found.iou.iter().map(|&iou| round(iou)).collect::<Vec<_>>(),
        })
    });
    let faces = shape
        .faces
        .iter()
        .map(|(face_type, step_id)| json!([face_type.name(), step_id]));
    json!({
        "id": shape.id,
        "mm": round(shape.diagonal_mm),
        "r": round(shape.disc_radius * (detail.every as f64).sqrt()),
        "n": shape.points.positions.len().div_ceil(detail.every),
        "refs": references.collect::<Vec<_>>(),
        "preds": predictions.collect::<Vec<_>>(),
        "faces": faces.collect::<Vec<_>>(),
    })
}

fn planes(shape: &ShapeDigest, detail: Detail) -> Vec<u8> {
    let every = detail.every;
    let mut bytes = Vec::new();
    let mut push_words = |words: &mut dyn Iterator<Item = u16>| {
        let words: Vec<u16> = words.collect();
        bytes.extend(words.iter().map(|word| (word >> 8) as u8));
        bytes.extend(words.iter().map(|word| *word as u8));
    };
    let points = &shape.points;
    for axis in 0..3 {
        push_words(
            &mut points
                .positions
                .iter()
                .step_by(every)
                .map(|position| position[axis]),
        );
    }
    // The two coordinates of a normal are the two bytes of a word.
    push_words(
        &mut points
            .normals
            .iter()
            .step_by(every)
            .map(|&[u, v]| u16::from_be_bytes([u, v])),
    );
    push_words(&mut points.faces.iter().step_by(every).copied());
    for reference in &shape.references {
        push_words(&mut reference.part_of_point.iter().step_by(every).copied());
    }
    for (_, prediction) in predictions_of(shape, detail) {
        push_words(&mut prediction.part_of_point.iter().step_by(every).copied());
    }
    bytes
}

/// The bytes in the raw format of deflate.
fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
    // Writing to memory does not fail. If it did, the page would show no points, as for a damaged block.
    match encoder.write_all(bytes) {
        Ok(()) => encoder.finish().unwrap_or_default(),
        Err(_) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape_digest::tests::plate;
    use std::io::Read as _;

    fn unpacked(html: &str, idx: usize) -> Vec<u8> {
        let start = format!("id=\"points-{idx}\">");
        let from = html.find(&start).unwrap() + start.len();
        let to = from + html[from..].find('<').unwrap();
        let packed = STANDARD.decode(&html[from..to]).unwrap();
        let mut bytes = Vec::new();
        flate2::read::DeflateDecoder::new(&packed[..])
            .read_to_end(&mut bytes)
            .unwrap();
        bytes
    }

    #[test]
    fn points_come_back_plane_by_plane() {
        let shape = ShapeDigest::of(&plate(100));
        let html = embedded_points(std::slice::from_ref(&shape), MAX_BYTES);
        let bytes = unpacked(&html, 0);
        // Position, normal, face, a reference and two predictions.
        assert_eq!(bytes.len(), 100 * (6 + 2 + 2 + 2 + 4));
        let x: Vec<u16> = (0..100)
            .map(|idx| u16::from_be_bytes([bytes[idx], bytes[100 + idx]]))
            .collect();
        let expected: Vec<u16> = shape
            .points
            .positions
            .iter()
            .map(|position| position[0])
            .collect();
        assert_eq!(x, expected);
        assert!(
            html.contains("\"id\":\"plate\"")
                && html.contains("\"faces\":[[\"plane\",50],[\"cylinder\",60]]"),
            "{html}"
        );
    }

    #[test]
    fn points_are_thinned_out_until_they_fit() {
        let shapes = vec![ShapeDigest::of(&plate(20_000)); 8];
        let all = embedded_points(&shapes, MAX_BYTES);
        assert_eq!(unpacked(&all, 7).len(), 5000 * 16);
        for budget in [all.len() - 1, all.len() / 2, all.len() / 4] {
            let html = embedded_points(&shapes, budget);
            assert!(
                html.len() <= budget && html.contains("points-7"),
                "{} of {budget}",
                html.len()
            );
        }
        assert_eq!(embedded_points(&shapes, 100), "");
    }
}
