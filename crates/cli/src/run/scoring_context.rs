//! Defines the references with which shapes are scored, and the place where predictions are written.

use super::evaluation::{write_embeddings, write_npz};
use super::folder::RunFolder;
use super::shapes::Shape;
use crate::config::Config;
use anyhow::Result;
use partprobe_carrier::Embeddings;
use partprobe_eval::near_boundary;
use partprobe_formats::Array;
use partprobe_net::Tokens;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The data that are the same for all rows of one set of tables.
pub(super) struct ScoringContext<'a> {
    pub(super) config: &'a Config,
    /// The references, each of which has labeled all shapes.
    pub(super) references: Vec<String>,
    pub(super) boundaries: &'a Boundaries,
    /// The folder to which predictions are written, or `None` if only scores are kept.
    pub(super) folder: Option<&'a RunFolder>,
}

impl ScoringContext<'_> {
    /// Writes `predictions/<name>.npz`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn write_predictions(
        &self,
        name: &str,
        members: Vec<(String, Array)>,
    ) -> Result<()> {
        match self.folder {
            Some(folder) => write_npz(folder, &format!("predictions/{name}.npz"), members),
            None => Ok(()),
        }
    }

    /// Writes `embeddings/<name>.npz`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn write_embeddings(
        &self,
        name: &str,
        tokens: &Tokens,
        embeddings: &Embeddings,
    ) -> Result<()> {
        match self.folder {
            Some(folder) => write_embeddings(
                folder,
                &format!("embeddings/{name}.npz"),
                tokens,
                embeddings,
            ),
            None => Ok(()),
        }
    }
}

/// Which points of each shape are near a boundary of each reference.
pub(crate) struct Boundaries(BTreeMap<(String, String), Vec<bool>>);

impl Boundaries {
    /// The points near a boundary, by shape and reference.
    ///
    /// # Errors
    /// If a shape was not labeled by a reference.
    pub(super) fn of_shapes(shapes: &[&Shape], references: &[String]) -> Result<Self> {
        let pairs: Vec<(&Shape, &String)> = shapes
            .iter()
            .flat_map(|shape| references.iter().map(move |reference| (*shape, reference)))
            .collect();
        let near = |(shape, reference): &(&Shape, &String)| {
            let sample = &shape.sample;
            let labels = shape.labels_by(reference)?;
            let near = near_boundary(&sample.points, &sample.normals, labels);
            Ok(((shape.id.clone(), (*reference).clone()), near))
        };
        let all: Result<BTreeMap<_, _>> = pairs.par_iter().map(near).collect();
        Ok(Self(all?))
    }

    /// The points of one shape and reference.
    pub(super) fn of(&self, shape: &str, reference: &str) -> Option<&[bool]> {
        self.0
            .get(&(shape.to_owned(), reference.to_owned()))
            .map(Vec::as_slice)
    }
}
