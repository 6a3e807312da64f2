//! Probes embeddings for the classes of B-Rep faces: the embedding of a face is the mean of its points.

use super::shapes::face_of_points;
use crate::run::evaluation::Embedder;
use crate::run::shapes::Shape;
use anyhow::{Context, Result, ensure};
use partprobe_carrier::{Embeddings, PointSample};
use partprobe_dataset::json_document;
use partprobe_eval::{ProbeScores, probe, seeded_rank};
use partprobe_net::TokenConfig;
use partprobe_sources::BoxedSource;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

/// The faces of the shapes of an endpoint with their classes.
pub(super) struct FaceClasses {
    source: String,
    shapes: Vec<ClassedShape>,
    /// The names of the classes, by number.
    names: Vec<String>,
}

/// A shape of which some faces have a class.
struct ClassedShape {
    id: String,
    sample: PointSample,
    face_of_point: Vec<u32>,
    class_of_face: Vec<Option<u32>>,
    /// Whether the probe learns on this shape. It is scored on the others.
    is_learned: bool,
}

impl FaceClasses {
    /// Gets the classes of all faces from the source. A probe learns on half of the shapes, chosen by their groups.
    ///
    /// # Errors
    /// If a carrier cannot be read, or the labels of the source are not classes.
    pub(super) fn of(
        source: &BoxedSource,
        shapes: &[Shape],
        seed: u64,
        disturbed: impl Fn(&str, PointSample) -> PointSample + Sync,
    ) -> Result<Self> {
        let named: Vec<Option<(ClassedShape, Vec<Option<String>>)>> = shapes
            .par_iter()
            .map(|shape| {
                let (face_of_point, carrier) = face_of_points(shape)?;
                let Ok(labels) = source.labels(&carrier, seed) else {
                    return Ok(None);
                };
                let classes = labels.classes().with_context(|| {
                    format!(
                        "the labels of `{}` are not classes of faces; name a source of the type `faces`",
                        source.name()
                    )
                })?;
                let classed = ClassedShape {
                    id: shape.id.clone(),
                    sample: disturbed(&shape.id, shape.sample.clone()),
                    face_of_point,
                    class_of_face: Vec::new(),
                    is_learned: seeded_rank(seed, &shape.group).is_multiple_of(2),
                };
                Ok(Some((classed, classes.to_vec())))
            })
            .collect::<Result<_>>()?;
        let named: Vec<(ClassedShape, Vec<Option<String>>)> = named.into_iter().flatten().collect();
        ensure!(
            !named.is_empty(),
            "`{}` labels none of the shapes of the endpoint",
            source.name()
        );

        let names: BTreeSet<&String> = named
            .iter()
            .flat_map(|(_, names)| names.iter().flatten())
            .collect();
        let names: Vec<String> = names.into_iter().cloned().collect();
        let number = |name: &Option<String>| {
            let name = name.as_ref()?;
            names.binary_search(name).ok().map(|number| number as u32)
        };
        let shapes = named.into_iter().map(|(shape, of_faces)| ClassedShape {
            class_of_face: of_faces.iter().map(number).collect(),
            ..shape
        });
        Ok(Self {
            source: source.name().to_owned(),
            shapes: shapes.collect(),
            names,
        })
    }

    /// The scores of the probes on the embeddings of the faces.
    ///
    /// # Errors
    /// If a shape cannot be embedded, or one half has no face with a class.
    pub(super) fn probe(
        &self,
        embedder: &Embedder<'_>,
        config: &TokenConfig,
    ) -> Result<ProbeScores> {
        let of_shapes: Vec<Vec<FaceRow>> = self
            .shapes
            .par_iter()
            .map(|shape| {
                shape
                    .rows(embedder, config)
                    .with_context(|| shape.id.clone())
            })
            .collect::<Result<_>>()?;
        let rows = of_shapes.concat();
        let dim = rows.first().map_or(1, |row| row.mean.len());
        let values = rows
            .iter()
            .flat_map(|row| row.mean.iter().copied())
            .collect();
        let embeddings = Embeddings::new(dim, values)?;
        let classes: Vec<u32> = rows.iter().map(|row| row.class).collect();
        let is_learned: Vec<bool> = rows.iter().map(|row| row.is_learned).collect();
        probe(&embeddings, &classes, &is_learned).with_context(|| {
            format!(
                "`{}` gives classes to one half of the shapes only; use more shapes",
                self.source
            )
        })
    }
}

/// A face with its class.
#[derive(Clone)]
struct FaceRow {
    mean: Vec<f32>,
    class: u32,
    is_learned: bool,
}

impl ClassedShape {
    /// The mean embedding of the points of each face that has a point and a class, as a unit row.
    fn rows(&self, embedder: &Embedder<'_>, config: &TokenConfig) -> Result<Vec<FaceRow>> {
        let (tokens, embeddings) = embedder.embed(&self.sample, config)?;
        let mut sums: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
        for (&face, &token) in self.face_of_point.iter().zip(&tokens.token_of_point) {
            let sum = sums
                .entry(face)
                .or_insert_with(|| vec![0.0; embeddings.dim()]);
            for (sum, &x) in sum.iter_mut().zip(embeddings.row(token as usize)) {
                *sum += f64::from(x);
            }
        }
        let row = |(face, sum): (u32, Vec<f64>)| {
            let class = self.class_of_face.get(face as usize).copied().flatten()?;
            let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-12);
            Some(FaceRow {
                mean: sum.iter().map(|x| (x / length) as f32).collect(),
                class,
                is_learned: self.is_learned,
            })
        };
        Ok(sums.into_iter().filter_map(row).collect())
    }
}

/// The scores of the probes of all rows of an endpoint.
#[derive(Serialize)]
pub(super) struct ProbeTable {
    source: String,
    classes: Vec<String>,
    rows: Vec<ProbeRow>,
}

#[derive(Serialize)]
struct ProbeRow {
    supervision: String,
    seed: u64,
    scores: ProbeScores,
}

impl ProbeTable {
    pub(super) fn new(classes: &FaceClasses) -> Self {
        Self {
            source: classes.source.clone(),
            classes: classes.names.clone(),
            rows: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, supervision: &str, seed: u64, scores: ProbeScores) {
        self.rows.push(ProbeRow {
            supervision: supervision.to_owned(),
            seed,
            scores,
        });
    }

    /// A table with one row per backbone and seed.
    pub(super) fn to_markdown(&self) -> String {
        let mut text = format!(
            "\nProbe of the class of each face by `{}`, from embeddings averaged per face:\n\n\
             | supervision | seed | linear | linear, balanced | nearest | nearest, balanced | learned | scored | classes |\n\
             |---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
            self.source
        );
        // These scores are the same for all rows, because they do not depend on embeddings.
        if let Some(scores) = self.rows.first().map(|row| &row.scores) {
            let ProbeScores { majority, .. } = scores;
            let _ = writeln!(
                text,
                "| the most frequent class | – | {:.3} | {:.3} | {:.3} | {:.3} | {} | {} | {} |",
                majority.accuracy,
                majority.balanced_accuracy,
                majority.accuracy,
                majority.balanced_accuracy,
                scores.n_learned,
                scores.n_scored,
                scores.n_classes
            );
        }
        for ProbeRow {
            supervision,
            seed,
            scores,
        } in &self.rows
        {
            let ProbeScores {
                linear, nearest, ..
            } = scores;
            let _ = writeln!(
                text,
                "| `{supervision}` | {seed} | {:.3} | {:.3} | {:.3} | {:.3} | {} | {} | {} |",
                linear.accuracy,
                linear.balanced_accuracy,
                nearest.accuracy,
                nearest.balanced_accuracy,
                scores.n_learned,
                scores.n_scored,
                scores.n_classes
            );
        }
        text
    }

    /// All scores in full precision.
    ///
    /// # Errors
    /// If a number cannot be written.
    pub(super) fn to_json(&self) -> Result<Vec<u8>> {
        Ok(json_document(self)?)
    }
}
