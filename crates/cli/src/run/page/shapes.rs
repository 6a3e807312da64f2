//! Reads the test shapes and their predictions from a run folder, for its report.

use super::PageScores;
use super::faces::{FaceSource, stored_faces};
use crate::config::Config;
use crate::run::evaluation::{member_name, score_columns};
use crate::run::folder::RunFolder;
use anyhow::{Context, Result};
use partprobe_formats::{Members, arrays_from_npz};
use partprobe_report::{Prediction, ReportShape, ShapeDigest};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Every scored shape, in the order of the ids, reduced to the data that the page shows.
///
/// # Errors
/// If a file cannot be read.
pub(super) fn shapes(
    folder: &RunFolder,
    config: &Config,
    scores: &PageScores<'_>,
    faces: &FaceSource,
) -> Result<Vec<ShapeDigest>> {
    let ids: BTreeSet<&str> = scores.rows.iter().map(|row| row.shape.as_str()).collect();
    let rows = predicted_rows(scores);
    ids.into_par_iter()
        .map(|id| {
            let shape = shape(folder, config, &rows, id, faces);
            Ok(ShapeDigest::of(
                &shape.with_context(|| format!("shape {id}"))?,
            ))
        })
        .collect()
}

/// The supervision and the seed of each row that has predictions, in the order of the tables.
fn predicted_rows<'a>(scores: &PageScores<'a>) -> Vec<(&'a str, u64)> {
    let mut rows: Vec<(&str, u64)> = Vec::new();
    let mut seen = BTreeSet::new();
    for table_row in &scores.tables.rows {
        let name = table_row.supervision.as_str();
        if !seen.insert(name) {
            continue;
        }
        let own = scores.rows.iter().filter(|row| row.supervision == name);
        let seeds: BTreeSet<u64> = own.map(|row| row.seed).collect();
        rows.extend(seeds.into_iter().map(|seed| (name, seed)));
    }
    rows
}

fn shape(
    folder: &RunFolder,
    config: &Config,
    rows: &[(&str, u64)],
    id: &str,
    faces: &FaceSource,
) -> Result<ReportShape> {
    let mut members = read_npz(folder, &format!("test/{id}.npz"))?;
    let points: Vec<[f32; 3]> = members.rows("points")?;
    let mut references = Vec::new();
    for source in config.references() {
        // `eval` may have used other references than those of the config.
        if let Ok(labels) = members.vector(&format!("reference_{source}")) {
            references.push((source, labels));
        }
    }
    let mut predictions = Vec::new();
    for &(supervision, seed) in rows {
        let file = format!("predictions/{supervision}-{seed}/{id}.npz");
        // The labels of a source do not predict themselves.
        if folder.path(&file).exists() {
            let members = read_npz(folder, &file)?;
            predictions.extend(predictions_of(members, config, (supervision, seed)));
        }
    }
    let stored = stored_faces(&mut members);
    Ok(ReportShape {
        faces: stored.or_else(|| faces.faces(id, &points, config)),
        id: id.to_owned(),
        normals: members.rows("normals")?,
        points,
        references,
        predictions,
    })
}

/// The predictions of one row by each reference and clusterer, if the file has them.
fn predictions_of(
    mut members: Members,
    config: &Config,
    (supervision, seed): (&str, u64),
) -> Vec<Prediction> {
    let mut predictions = Vec::new();
    for (idx, column) in score_columns(config).iter().enumerate() {
        for reference in config.references() {
            if let Ok(clusters) = members.vector(&member_name(&reference, idx, &column.name)) {
                predictions.push(Prediction {
                    supervision: supervision.to_owned(),
                    seed,
                    reference,
                    clusterer: column.name.clone(),
                    clusters,
                });
            }
        }
    }
    predictions
}

fn read_npz(folder: &RunFolder, relative: &str) -> Result<Members> {
    arrays_from_npz(&folder.read(relative)?).with_context(|| relative.to_owned())
}
