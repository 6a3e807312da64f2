//! Loads the shapes of an endpoint: the test shapes of the run with the changes of the endpoint, or shapes of another data set.

use super::classes::FaceClasses;
use super::disturbance::disturbed;
use crate::config::{Config, EndpointConfig, EndpointShapes};
use crate::label_sources::source_named;
use crate::progress::Progress;
use crate::run::shapes::{Points, Selection, Shape, ShapeLoader};
use crate::run::stages::Run;
use crate::run::training_shapes::draw;
use anyhow::{Context, Result, ensure};
use partprobe_carrier::hexadecimal;
use partprobe_dataset::{Dataset, IndexEntry};
use partprobe_eval::{DistinctShapes, Duplicate, NearShape, SplitCandidate, seeded_rank};
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::cell::OnceCell;
use std::collections::BTreeMap;

/// The reason why a shape is left out that the backbones nearly know.
const NEAR_TRAINING: &str = "nearly equal to a training or validation shape";

/// The shapes of an endpoint.
pub(super) struct EndpointData {
    pub(super) shapes: Vec<Shape>,
    /// The label sources against which they are scored.
    pub(super) references: Vec<String>,
    /// The classes of their faces, if they are requested.
    pub(super) classes: Option<FaceClasses>,
    /// A text with the changes of the endpoint, its number of shapes, and the reasons why others were left out.
    pub(super) summary: String,
    /// The hash that identifies the shapes.
    pub(super) hash: String,
}

impl EndpointData {
    /// Loads the shapes. `config` is that of the endpoint. `known` is filled by the first endpoint that needs it.
    ///
    /// # Errors
    /// If a data set cannot be read, or no shape is left.
    pub(super) fn load(
        endpoint: &EndpointConfig,
        config: &Config,
        run: &Run<'_>,
        known: &OnceCell<KnownShapes>,
    ) -> Result<Self> {
        let references = if endpoint.references.is_empty() {
            config.references()
        } else {
            endpoint.references.clone()
        };
        let test = run.data.test()?;
        let progress = &run.execution.progress;
        let dataset = endpoint.data.as_deref().map(Dataset::open).transpose()?;
        let (mut shapes, selection) = match &dataset {
            None => (redrawn(&test, config)?, Selection::of(test.len())),
            Some(dataset) => {
                let loader = ShapeLoader::new(dataset, config, Points::Kept)?;
                let loader = loader.with_sources(&references);
                let requested = requested_entries(endpoint, dataset, &test, config.split.seed);
                let (shapes, mut selection) = loaded(&loader, requested, &test, progress)?;
                let shapes = match endpoint.shapes {
                    EndpointShapes::Test => shapes,
                    EndpointShapes::All => {
                        let known = match known.get() {
                            Some(known) => known,
                            None => {
                                let read = KnownShapes::of(run)?;
                                known.get_or_init(|| read)
                            }
                        };
                        independent(shapes, known, &mut selection)
                    }
                };
                (shapes, selection)
            }
        };
        ensure!(!shapes.is_empty(), "no shape is left ({selection})");
        let classes = match &endpoint.probe {
            None => None,
            Some(name) => {
                let source = source_named(config, name)?;
                Some(FaceClasses::of(
                    &source,
                    &shapes,
                    config.split.seed,
                    |id, sample| disturbed(sample, id, endpoint),
                )?)
            }
        };
        for shape in &mut shapes {
            let sample = std::mem::take(&mut shape.sample);
            shape.sample = disturbed(sample, &shape.id, endpoint);
        }
        Ok(Self {
            summary: format!("{}; {selection}", changes(endpoint)),
            hash: hash_of(&shapes),
            shapes,
            references,
            classes,
        })
    }
}

/// The test shapes with the normals that the config requires.
fn redrawn(test: &[&Shape], config: &Config) -> Result<Vec<Shape>> {
    test.par_iter()
        .map(|shape| {
            let sample = draw(&shape.id, &shape.carrier, &config.sample)?;
            ensure!(
                sample.triangles == shape.sample.triangles,
                "the points of {} are not those of the run",
                shape.id
            );
            Ok(shape.with_sample(sample))
        })
        .collect()
}

/// The requested entries of a data set, by id. An entry is `None` for a test shape that the data set lacks.
fn requested_entries<'a>(
    endpoint: &EndpointConfig,
    dataset: &'a Dataset,
    test: &[&Shape],
    seed: u64,
) -> Vec<(String, Option<&'a IndexEntry>)> {
    let mut entries = dataset.labeled();
    if endpoint.shapes == EndpointShapes::Test {
        let by_id: BTreeMap<&str, &IndexEntry> = entries
            .into_iter()
            .map(|entry| (entry.id.as_str(), entry))
            .collect();
        let entry_of = |shape: &&Shape| (shape.id.clone(), by_id.get(shape.id.as_str()).copied());
        return test.iter().map(entry_of).collect();
    }
    entries.sort_by_cached_key(|entry| (seeded_rank(seed, &entry.id), entry.id.clone()));
    if endpoint.max_shapes > 0 {
        entries.truncate(endpoint.max_shapes);
    }
    let named = |entry: &'a IndexEntry| (entry.id.clone(), Some(entry));
    entries.into_iter().map(named).collect()
}

/// Loads the entries, and returns the reasons why some are left out. A test shape must have been read from the same file as in
/// the run.
fn loaded(
    loader: &ShapeLoader<'_>,
    requested_entries: Vec<(String, Option<&IndexEntry>)>,
    test: &[&Shape],
    progress: &Progress,
) -> Result<(Vec<Shape>, Selection)> {
    let of_run: BTreeMap<&str, &Shape> = test
        .iter()
        .map(|shape| (shape.id.as_str(), *shape))
        .collect();
    let bar = progress.bar("sample", requested_entries.len());
    let load = |(id, entry): &(String, Option<&IndexEntry>)| -> Result<Shape, String> {
        bar.inc(1);
        let entry = entry.ok_or("the data set of the endpoint lacks it")?;
        let mut shape = loader
            .load(entry)
            .map_err(|refusal| refusal.reason().to_owned())?;
        shape.group.clone_from(&shape.candidate.collection);
        if let Some(own) = of_run.get(id.as_str()) {
            if own.identity.source_sha256 != shape.identity.source_sha256 {
                return Err("its STEP file is another one than in the run".to_owned());
            }
            shape.group.clone_from(&own.group);
        }
        Ok(shape)
    };
    let found: Vec<Result<Shape, String>> = requested_entries.par_iter().map(load).collect();
    bar.finish();
    let mut selection = Selection::of(requested_entries.len());
    let mut shapes = Vec::new();
    for ((id, _), outcome) in requested_entries.iter().zip(found) {
        match outcome {
            Ok(shape) => shapes.push(shape),
            Err(reason) => selection.leave_out(&reason, id),
        }
    }
    Ok((shapes, selection))
}

/// The training and validation shapes of a run, with which shapes of other data sets are compared.
pub(super) struct KnownShapes {
    shapes: Vec<SplitCandidate>,
    /// A shape that differs by at most this from one of them is nearly equal to it. 0 allows none to be.
    near_difference: f64,
}

impl KnownShapes {
    /// The shapes of a run. They are read from its data set if only its test shapes are in memory.
    ///
    /// # Errors
    /// If one of them cannot be read, or is not the one of the split.
    pub(super) fn of(run: &Run<'_>) -> Result<Self> {
        let near_difference = run.config.split.near_difference;
        let file = &run.data.split_file;
        let ids = || file.split.train.iter().chain(&file.split.valid);
        let in_memory = || {
            let shape = |id: &String| run.data.shapes.get(id);
            ids().map(|id| Some(shape(id)?.candidate.clone())).collect()
        };
        let shapes = if near_difference == 0.0 {
            Vec::new()
        } else if let Some(shapes) = in_memory() {
            shapes
        } else {
            // Neither their labels nor their points are needed.
            let loader =
                ShapeLoader::new(run.dataset, run.config, Points::Redrawn)?.with_sources(&[]);
            let (shapes, _) = file.load(&loader, ids(), &run.execution.progress)?;
            shapes.into_iter().map(|shape| shape.candidate).collect()
        };
        Ok(Self {
            shapes,
            near_difference,
        })
    }

    fn has_one_near(&self, shape: &Shape) -> bool {
        let others: Vec<&SplitCandidate> = self.shapes.iter().collect();
        NearShape::nearest(&shape.candidate, &others)
            .is_some_and(|near| near.difference <= self.near_difference)
    }
}

/// The shapes that are not nearly equal to a known one, and differ from each other.
fn independent(shapes: Vec<Shape>, known: &KnownShapes, selection: &mut Selection) -> Vec<Shape> {
    let are_near: Vec<bool> = shapes
        .par_iter()
        .map(|shape| known.has_one_near(shape))
        .collect();
    let mut distinct = DistinctShapes::default();
    let mut kept = Vec::new();
    for (shape, is_near) in shapes.into_iter().zip(are_near) {
        let candidate = &shape.candidate;
        if is_near {
            selection.leave_out(NEAR_TRAINING, &shape.id);
        } else if distinct.add(&shape.id, &candidate.signature).is_some() {
            selection.leave_out(Duplicate::REASON, &shape.id);
        } else {
            kept.push(shape);
        }
    }
    kept
}

/// The changes of an endpoint, in words.
fn changes(endpoint: &EndpointConfig) -> String {
    let mut changes = Vec::new();
    if let Some(data) = &endpoint.data {
        changes.push(format!("data set {}", data.display()));
    }
    if let Some(normals) = endpoint.normals {
        changes.push(format!("normals {normals:?}").to_lowercase());
    }
    if endpoint.position_noise > 0.0 {
        changes.push(format!(
            "noise of {} diagonals on positions",
            endpoint.position_noise
        ));
    }
    if endpoint.normal_noise_deg > 0.0 {
        changes.push(format!(
            "noise of {}° on normals",
            endpoint.normal_noise_deg
        ));
    }
    if let Some(voxels) = endpoint.voxels {
        changes.push(format!("{voxels:?} voxels").to_lowercase());
    }
    if changes.is_empty() {
        changes.push("as in the run".to_owned());
    }
    changes.join(", ")
}

/// Twelve digits of the hash of the shapes.
fn hash_of(shapes: &[Shape]) -> String {
    let mut digest = Sha256::new();
    for shape in shapes {
        digest.update(format!("{}\n{}\n", shape.id, shape.identity.content_hash));
    }
    let mut text = hexadecimal(&digest.finalize());
    text.truncate(12);
    text
}

/// The points of a shape and the face of each.
pub(super) fn face_of_points(shape: &Shape) -> Result<(Vec<u32>, partprobe_carrier::Carrier)> {
    let (carrier, _) = shape.carrier.read().with_context(|| shape.id.clone())?;
    let faces = &carrier.mesh().tri_face;
    let of_points = shape.sample.triangles.iter();
    let of_points = of_points
        .map(|&triangle| faces[triangle as usize])
        .collect();
    Ok((of_points, carrier))
}
