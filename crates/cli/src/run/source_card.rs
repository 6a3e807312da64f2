//! Reports, before any training, measures of the labels of a run's sources, and the agreement of each two sources.
//!
//! The card often explains a result: a source with twice as many labels as the reference loses only because of its number of
//! labels.

use super::folder::RunFolder;
use super::shapes::Shape;
use super::stages::Run;
use crate::config::Config;
use crate::source_rows::pair_rows;
use anyhow::Result;
use partprobe_eval::{CardRow, CardTables, PairRow, card_tables};
use rayon::prelude::*;

/// The files' names in the run folder.
const TEXT: &str = "source_card.md";
const JSON: &str = "source_card.json";
/// The number of named shapes on which two sources differ most.
const N_MOST: usize = 5;

/// Whether a run folder has its card.
pub(super) fn has_card(folder: &RunFolder) -> bool {
    folder.path(JSON).exists()
}

impl Run<'_> {
    /// Measures the sources on all used shapes, prints the card, and writes it. This is done once per run.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub(crate) fn note_source_card(&self) -> Result<()> {
        if has_card(self.folder) {
            return Ok(());
        }
        // A duplicate of another shape is on no side, and a repeated run does not load it.
        let split = self.data.split();
        let takes_part = |shape: &&Shape| split.group_of(&shape.id).is_some();
        let shapes: Vec<&Shape> = self.data.shapes.values().filter(takes_part).collect();
        let card = card_of(&shapes, self.config);
        let text = card.to_markdown();
        self.execution.progress.note(&format!(
            "The label sources on all shapes of this run:\n\n{text}"
        ));
        self.folder.write(TEXT, text.as_bytes())?;
        self.folder.write(JSON, card.to_json().as_bytes())
    }
}

fn card_of(shapes: &[&Shape], config: &Config) -> CardTables {
    let sources = config.label_sources();
    let measured: Vec<(Vec<CardRow>, Vec<PairRow>)> = shapes
        .par_iter()
        .map(|shape| {
            let rows = shape.card_rows().map(|row| CardRow {
                group: shape.group.clone(),
                ..row.clone()
            });
            let of_points: Vec<(&str, &[i32])> = sources
                .iter()
                .filter_map(|source| Some((source.as_str(), shape.labels_by(source).ok()?)))
                .collect();
            (
                rows.collect(),
                pair_rows(&of_points, &shape.id, &shape.group),
            )
        })
        .collect();
    let (rows, pairs): (Vec<Vec<CardRow>>, Vec<Vec<PairRow>>) = measured.into_iter().unzip();
    card_tables(
        rows.concat(),
        pairs.concat(),
        Vec::new(),
        &sources,
        N_MOST,
        config.eval.bootstrap(),
    )
}
