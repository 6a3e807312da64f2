//! Prepares the data of a run: its shapes are chosen, sampled, labeled and split, or loaded again by the existing split.

use super::choice::{Choice, NOT_IN_MANIFEST, choose};
use super::collisions::{Collisions, SplitCollisions};
use super::execution::Execution;
use super::folder::RunFolder;
use super::manifest::{MANIFEST_FILE, manifest_of, note_absent, note_near, read_manifest};
use super::shapes::{Points, Shape, ShapeIdentity, ShapeLoader};
use super::source_card::has_card;
use super::split_file::SplitFile;
use super::training_job::{TrainingData, keys_of};
use super::training_shapes::{Redraw, TrainingShapes, draw};
use crate::config::{Config, SplitConfig};
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_carrier::hexadecimal;
use partprobe_dataset::Dataset;
use partprobe_eval::{
    Duplicate, NearShape, Split, SplitFractions, SplitRule, TrainShare, split, split_by_manifest,
};
use partprobe_net::{TokenConfig, TrainShape};
use sha2::{Digest, Sha256};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// The shapes of a run with their split. The points of training shapes are in memory or drawn again, as the training requires.
pub(crate) struct RunData {
    pub(crate) split_file: SplitFile,
    pub(super) shapes: BTreeMap<String, Shape>,
    /// The training shapes, in split order. The labels are those of the current supervision.
    pub(super) train: TrainingShapes,
}

impl RunData {
    pub(super) fn split(&self) -> &Split {
        &self.split_file.split
    }

    pub(super) fn shapes_of(&self, ids: &[String]) -> Result<Vec<&Shape>> {
        ids.iter()
            .map(|id| {
                self.shapes
                    .get(id)
                    .with_context(|| format!("split.json names {id}, which the data set lacks"))
            })
            .collect()
    }

    /// The shapes that are scored.
    pub(crate) fn test(&self) -> Result<Vec<&Shape>> {
        self.shapes_of(&self.split().test)
    }

    pub(super) fn collisions(&self, config: &Config) -> Result<Collisions> {
        let TokenConfig {
            train_tokens,
            test_tokens,
            voxels,
            ..
        } = config.tokens;
        let train = SplitCollisions::of(self.train.n(), train_tokens.middle(), voxels, |idx| {
            let shape = self.train.get(idx)?;
            let labels = self
                .shapes
                .get(&shape.id)
                .with_context(|| format!("{} has no labels", shape.id))?
                .labels();
            let sample = match shape {
                Cow::Borrowed(shape) => Cow::Borrowed(&shape.sample),
                Cow::Owned(shape) => Cow::Owned(shape.sample),
            };
            Ok((sample, labels))
        })?;
        let test = self.shapes_of(&self.split().test)?;
        let test = SplitCollisions::of(test.len(), test_tokens, voxels, |idx| {
            Ok((Cow::Borrowed(&test[idx].sample), test[idx].labels()))
        })?;
        Ok(Collisions::new(train, test))
    }

    /// The properties that distinguish the data of this run's trainings from other data.
    pub(super) fn training_data(&self) -> Result<TrainingData> {
        let split = self.split();
        let identities = |ids: &[String]| -> Result<Vec<ShapeIdentity>> {
            ids.iter()
                .map(|id| self.split_file.identity(id).cloned())
                .collect()
        };
        let (train, valid) = (identities(&split.train)?, identities(&split.valid)?);
        let mut digest = Sha256::new();
        for (ids, identities) in [(&split.train, &train), (&split.valid, &valid)] {
            for (id, identity) in ids.iter().zip(identities) {
                digest.update(format!("{id}\n{}\n", identity.content_hash));
                for (source, hash) in &identity.imported {
                    digest.update(format!("{source} {hash}\n"));
                }
            }
            digest.update("\n");
        }
        let digest = hexadecimal(&digest.finalize());
        Ok(TrainingData {
            train: keys_of(&train),
            valid: keys_of(&valid),
            test: split
                .test
                .iter()
                .cloned()
                .zip(identities(&split.test)?)
                .collect(),
            digest,
        })
    }
}

/// Samples and labels the points of the run's split, which is made and written if there is none yet.
pub(crate) fn prepare(
    dataset: &Dataset,
    config: &Config,
    folder: &RunFolder,
    execution: &Execution,
    points: Points,
) -> Result<RunData> {
    let mut loader = ShapeLoader::new(dataset, config, points)?;
    if !has_card(folder) {
        loader = loader.measuring();
    }
    let (split_file, shapes) = match SplitFile::read(folder, config)? {
        Some(file) => load_again(file, loader, folder, execution)?,
        None => split_anew(&loader, folder, execution)?,
    };
    execution.progress.note(&split_file.selection.to_string());
    let split = &split_file.split;
    let mut shapes: BTreeMap<String, Shape> = shapes
        .into_iter()
        .map(|shape| (shape.id.clone(), shape))
        .collect();
    let train = split
        .train
        .iter()
        .map(|id| train_shape(&mut shapes, id))
        .collect::<Result<_>>()?;
    let redraw = match points {
        Points::Kept => None,
        Points::Redrawn => {
            draw_again(&mut shapes, split.valid.iter().chain(&split.test), config)?;
            let carriers = split
                .train
                .iter()
                .filter_map(|id| shapes.get(id))
                .map(|shape| shape.carrier.clone());
            Some(Redraw {
                carriers: carriers.collect(),
                sample: config.sample.clone(),
            })
        }
    };
    let train = TrainingShapes::new(train, redraw);
    Ok(RunData {
        split_file,
        shapes,
        train,
    })
}

/// Loads the shapes of a split in the folder.
fn load_again(
    mut file: SplitFile,
    loader: ShapeLoader<'_>,
    folder: &RunFolder,
    execution: &Execution,
) -> Result<(SplitFile, Vec<Shape>)> {
    for source in &loader.config.compare.supervision {
        file.ensure_source(folder.root(), loader.config, source)?;
    }
    let (test, left_out) = file.load(&loader, file.split.test.iter(), &execution.progress)?;
    file.leave_out_of_test(&left_out)?;
    // A reference that was added later does not influence the training shapes.
    let loader = loader.with_sources(file.sources());
    let trained = file.split.train.iter().chain(&file.split.valid);
    let (mut shapes, left_out) = file.load(&loader, trained, &execution.progress)?;
    ensure!(
        left_out.is_empty(),
        "training shapes have gone, though their label sources are the same"
    );
    shapes.extend(test);
    Ok((file, shapes))
}

/// Chooses the shapes of a new run, splits them, and writes `split.json`.
fn split_anew(
    loader: &ShapeLoader<'_>,
    folder: &RunFolder,
    execution: &Execution,
) -> Result<(SplitFile, Vec<Shape>)> {
    let config = loader.config;
    let Choice {
        mut shapes,
        mut selection,
    } = choose(loader, &execution.progress)?;
    let split = match read_manifest(&config.split)? {
        None => split_at_random(&shapes, &config.split)?,
        Some(manifest) => {
            let keyed: Vec<_> = shapes
                .iter()
                .map(|shape| (shape.identity.key(), shape.candidate.clone()))
                .collect();
            let unnamed = keyed
                .iter()
                .filter(|(key, _)| manifest.side_of(key).is_none());
            for (_, candidate) in unnamed {
                selection.leave_out(NOT_IN_MANIFEST, &candidate.id);
            }
            note_absent(&manifest, &keyed, execution);
            let split = split_by_manifest(&keyed, &manifest, train_share(&config.split))
                .map_err(|error| UsageError(error.to_string()))?;
            note_near(&split, config.split.near_difference, execution);
            split
        }
    };
    for duplicate in &split.duplicates {
        selection.leave_out(Duplicate::REASON, &duplicate.id);
    }
    for near in &split.near {
        selection.leave_out(NearShape::REASON, &near.id);
    }
    for id in &split.spared {
        selection.leave_out(TrainShare::REASON, id);
    }
    ensure!(
        !split.train.is_empty(),
        "no shape is left to train on ({selection})"
    );
    ensure!(
        !split.test.is_empty(),
        "no shape is left to test on ({selection}); give more files, since train, valid and test need shapes of their own"
    );
    for shape in &mut shapes {
        shape.group = split.group_of(&shape.id).unwrap_or(&shape.id).to_owned();
    }
    let file = SplitFile::new(config, split, selection, &shapes);
    file.write(folder)?;
    folder.write(
        MANIFEST_FILE,
        manifest_of(&file.split, &shapes).to_json_lines().as_bytes(),
    )?;
    Ok((file, shapes))
}

/// A new split by the rule of the config.
fn split_at_random(shapes: &[Shape], config: &SplitConfig) -> Result<Split> {
    let candidates: Vec<_> = shapes.iter().map(|shape| shape.candidate.clone()).collect();
    let rule = SplitRule {
        fractions: SplitFractions {
            train: config.train,
            valid: config.valid,
            test: config.test,
        },
        near_difference: config.near_difference,
        train_share: train_share(config),
        seed: config.seed,
    };
    split(&candidates, &rule).map_err(|error| UsageError(error.to_string()).into())
}

/// The fraction of the training shapes that are trained on.
fn train_share(config: &SplitConfig) -> TrainShare {
    TrainShare {
        share: config.train_share,
        seed: config.seed,
    }
}

/// The test shapes of a run's split with their points and labels. Nothing else of the data set is read.
pub(crate) fn prepare_test(
    dataset: &Dataset,
    config: &Config,
    folder: &RunFolder,
    execution: &Execution,
) -> Result<RunData> {
    let loader = ShapeLoader::new(dataset, config, Points::Kept)?;
    let mut split_file = SplitFile::read(folder, config)?.with_context(|| {
        format!(
            "{} has no split.json, which says which shapes are held out",
            folder.root().display()
        )
    })?;
    let (shapes, left_out) =
        split_file.load(&loader, split_file.split.test.iter(), &execution.progress)?;
    split_file.leave_out_of_test(&left_out)?;
    execution.progress.note(&split_file.selection.to_string());
    let shapes = shapes
        .into_iter()
        .map(|shape| (shape.id.clone(), shape))
        .collect();
    Ok(RunData {
        split_file,
        shapes,
        train: TrainingShapes::new(Vec::new(), None),
    })
}

/// Moves the points of a shape to the trainer, because they need most of the memory.
fn train_shape(shapes: &mut BTreeMap<String, Shape>, id: &str) -> Result<TrainShape> {
    let shape = shapes
        .get_mut(id)
        .with_context(|| format!("the split names {id}, which is not there"))?;
    Ok(TrainShape {
        id: id.to_owned(),
        sample: std::mem::take(&mut shape.sample),
        labels: Vec::new(),
    })
}

/// Draws the points of scored shapes again.
fn draw_again<'a>(
    shapes: &mut BTreeMap<String, Shape>,
    ids: impl Iterator<Item = &'a String>,
    config: &Config,
) -> Result<()> {
    for id in ids {
        if let Some(shape) = shapes.get_mut(id) {
            shape.sample = draw(id, &shape.carrier, &config.sample)?;
        }
    }
    Ok(())
}
