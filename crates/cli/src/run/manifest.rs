//! Reads a published split, and writes the split of a run in the same form.

use super::execution::Execution;
use super::shapes::Shape;
use crate::config::SplitConfig;
use crate::counted::counted;
use crate::usage::UsageError;
use anyhow::{Context, Result};
use partprobe_eval::{Manifest, ManifestLine, ShapeKey, SideName, Split, SplitCandidate};
use std::collections::BTreeSet;
use std::fs;

/// The file of a run folder with which others can split their data.
pub(super) const MANIFEST_FILE: &str = "manifest.jsonl";

/// The largest number of missing test shapes that are named.
const MAX_NAMED: usize = 5;

/// The manifest that the config names. Returns `None` if it names none.
///
/// # Errors
/// If it cannot be read, or is damaged.
pub(super) fn read_manifest(config: &SplitConfig) -> Result<Option<Manifest>> {
    if config.manifest.is_empty() {
        return Ok(None);
    }
    let text = fs::read_to_string(&config.manifest)
        .with_context(|| format!("reading split.manifest = \"{}\"", config.manifest))?;
    let manifest = Manifest::from_json_lines(&text)
        .map_err(|error| UsageError(format!("{}: {error}", config.manifest)))?;
    Ok(Some(manifest))
}

/// Warns about test shapes that have a nearly equal training shape. With a manifest, such training shapes are not removed.
pub(super) fn note_near(split: &Split, near_difference: f64, execution: &Execution) {
    let mut near = split
        .nearest_training
        .iter()
        .filter(|near| near.difference <= near_difference);
    let Some(first) = near.next() else {
        return;
    };
    execution.progress.note(&format!(
        "warning: {} of split.manifest nearly equal to a training shape, first {} and {}; they stay, since the manifest decides",
        counted(1 + near.count(), "test shape is", "test shapes are"),
        first.id,
        first.of
    ));
}

/// Reports which shapes of the manifest are missing in the data set. Scores on fewer test shapes are not comparable with those of
/// others.
pub(super) fn note_absent(
    manifest: &Manifest,
    shapes: &[(ShapeKey, SplitCandidate)],
    execution: &Execution,
) {
    let present: BTreeSet<&ShapeKey> = shapes.iter().map(|(key, _)| key).collect();
    let absent: Vec<&ManifestLine> = manifest
        .lines()
        .filter(|line| !present.contains(&line.key))
        .collect();
    if absent.is_empty() {
        return;
    }
    let of_test: Vec<&str> = absent
        .iter()
        .filter(|line| line.side == SideName::Test)
        .map(|line| line.id.as_str())
        .collect();
    let named = of_test[..of_test.len().min(MAX_NAMED)].join(", ");
    let more = if of_test.len() > MAX_NAMED {
        ", …"
    } else {
        ""
    };
    let which = if of_test.is_empty() {
        String::new()
    } else {
        format!(" ({named}{more})")
    };
    execution.progress.note(&format!(
        "{} shapes of split.manifest do not take part, {} of them test shapes{which}: the data set lacks them, or [select] or a \
         label source leaves them out",
        absent.len(),
        of_test.len()
    ));
}

/// The manifest of a run's split.
pub(super) fn manifest_of(split: &Split, shapes: &[Shape]) -> Manifest {
    let side_of = |id: &String| {
        [
            (&split.train, SideName::Train),
            (&split.valid, SideName::Valid),
            (&split.test, SideName::Test),
        ]
        .into_iter()
        .find(|(ids, _)| ids.binary_search(id).is_ok())
        .map(|(_, side)| side)
    };
    let lines = shapes.iter().filter_map(|shape| {
        Some(ManifestLine {
            key: shape.identity.key(),
            side: side_of(&shape.id)?,
            id: shape.id.clone(),
            n_parts: shape.candidate.n_parts,
        })
    });
    Manifest::of(lines)
}
