//! Runs the stages after labeling, in their order: the data are prepared, backbones are trained, and all are scored.

use super::bounds::bounds;
use super::collisions::Collisions;
use super::data::{RunData, prepare, prepare_test};
use super::evaluation::{
    Embedder, NO_NETWORK, RANDOM_FOURIER, ScoredModel, UNTRAINED, evaluate, write_test_shapes,
};
use super::execution::Execution;
use super::folder::RunFolder;
use super::held_out::{HeldOut, ensure_trained_here};
use super::scoring_context::{Boundaries, ScoringContext};
use super::shapes::{Points, Shape};
use super::training_args::TrainingProcessArgs;
use super::training_job::{TrainingJob, TrainingRecord};
use super::weights::weights_path;
use crate::config::Config;
use crate::counted::counted;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::Dataset;
use partprobe_eval::ScoreRow;
use partprobe_net::Model;
use std::collections::BTreeSet;

/// A run folder with its settings and its data.
pub(crate) struct Run<'a> {
    /// The data set of its shapes.
    pub(super) dataset: &'a Dataset,
    pub(crate) config: &'a Config,
    pub(crate) folder: &'a RunFolder,
    pub(crate) execution: &'a Execution,
    pub(crate) data: RunData,
}

impl<'a> Run<'a> {
    /// Samples and labels the points of the run's split, which is made and written if there is none yet.
    ///
    /// # Errors
    /// If the data set cannot be read, or no shape is left to train or test on.
    pub(crate) fn new(
        dataset: &'a Dataset,
        config: &'a Config,
        folder: &'a RunFolder,
        execution: &'a Execution,
        points: Points,
    ) -> Result<Self> {
        Ok(Self {
            dataset,
            config,
            folder,
            execution,
            data: prepare(dataset, config, folder, execution, points)?,
        })
    }

    /// A run that is scored and not trained: only the test shapes of its split are read.
    ///
    /// # Errors
    /// If there is no split, or a shape of it cannot be read.
    pub(crate) fn to_score(
        dataset: &'a Dataset,
        config: &'a Config,
        folder: &'a RunFolder,
        execution: &'a Execution,
    ) -> Result<Self> {
        Ok(Self {
            dataset,
            config,
            folder,
            execution,
            data: prepare_test(dataset, config, folder, execution)?,
        })
    }

    /// Warns before the first training if the split has no validation shapes, or too few groups of test shapes for an interval.
    ///
    /// # Errors
    /// If the split names a shape that the data set lacks.
    pub(crate) fn note_weak_split(&self) -> Result<()> {
        let split = self.data.split();
        let note = |text: &str| self.execution.progress.note(&format!("warning: {text}"));
        if split.valid.is_empty() && self.config.train.valid_every > 0 {
            note("the split has no validation shapes, so nothing is validated during the training");
        }
        let test = self.data.test()?;
        let groups: BTreeSet<&str> = test.iter().map(|shape| shape.group.as_str()).collect();
        let needed = self.config.eval.bootstrap().least_groups;
        if groups.len() >= needed {
            return Ok(());
        }
        let separator = &self.config.split.collection_separator;
        let cause = match separator.as_str() {
            "" => "give more files".to_owned(),
            _ => format!(
                "all files with the same name before `{separator}` are one group; give files of more groups, or set \
                 split.collection_separator = \"\" if your files are not related"
            ),
        };
        note(&format!(
            "the test shapes are in {}, and an interval needs {needed}, so no difference will have an interval or a p-value; {cause}",
            counted(groups.len(), "group", "groups")
        ));
        Ok(())
    }

    /// Prints and writes the fraction of points in a voxel of another label. This is done once per run.
    ///
    /// # Errors
    /// If a shape cannot be divided into tokens, or the file cannot be written.
    pub(crate) fn note_collisions(&self) -> Result<()> {
        // An existing file is not written again, because a number that is read and written may change its last digit.
        let found = match Collisions::read(self.folder)? {
            Some(found) => found,
            None => {
                let found = self.data.collisions(self.config)?;
                found.write(self.folder)?;
                found
            }
        };
        self.execution.progress.note(&found.to_string());
        Ok(())
    }

    /// Trains one backbone on one supervision, from its last checkpoint if there is one.
    ///
    /// # Errors
    /// If the training fails or is stopped. The last checkpoint is kept.
    pub(crate) fn train(
        &mut self,
        supervision: &str,
        seed: u64,
        args: &TrainingProcessArgs,
    ) -> Result<()> {
        let data = self.data.training_data()?;
        let weights = self.folder.path(&weights_path(supervision, seed));
        let record = TrainingRecord::read(self.folder, supervision, seed)?;
        let n_steps = self.config.train.n_steps(self.data.train.n());
        let is_shorter = |record: TrainingRecord| record.steps < n_steps && !record.stopped_early;
        if weights.exists() && !record.is_some_and(is_shorter) {
            let names = (supervision, seed);
            let progress = &self.execution.progress;
            progress.note(&format!("{supervision} seed {seed} is trained already"));
            return ensure_trained_here(self.folder, names, &data, self.execution.backend);
        }
        let shapes = &self.data.shapes;
        self.data.train.relabel(|id| {
            let shape = shapes.get(id).context("a training shape without labels")?;
            Ok(shape.labels_by(supervision)?.to_vec())
        })?;
        let valid = self.data.shapes_of(&self.data.split().valid)?;
        let job = TrainingJob {
            folder: self.folder,
            config: self.config,
            supervision,
            seed,
            data: &data,
            execution: self.execution,
            args,
        };
        job.train(&self.data.train, &valid)
    }

    /// Scores the untrained network, plain geometry and every trained backbone on the held-out shapes.
    ///
    /// # Errors
    /// If a backbone has seen a held-out shape, or does not belong to this run. Then the results of a previous evaluation are
    /// kept.
    pub(crate) fn evaluate(&self) -> Result<Vec<ScoreRow>> {
        let test = self.data.test()?;
        let held_out = self.held_out(&test);
        // All backbones are checked before anything is written.
        let trained = self.trained_models(&held_out)?;

        self.folder.forget_evaluation()?;
        write_test_shapes(self.folder, &test, &self.config.references())?;

        let references = self.config.references();
        let context = ScoringContext {
            config: self.config,
            boundaries: &Boundaries::of_shapes(&test, &references)?,
            references,
            folder: Some(self.folder),
        };
        self.scored(&context, &held_out, &trained, &test)
    }

    /// The data with which a backbone is compared before it is scored on these shapes.
    pub(super) fn held_out<'b>(&'b self, test: &'b [&'b Shape]) -> HeldOut<'b> {
        HeldOut {
            folder: self.folder,
            config: self.config,
            n_train: self.data.split().train.len(),
            test,
            backend: self.execution.backend,
        }
    }

    /// The rows of all backbones, of the untrained ones, and the rows without a network.
    pub(super) fn scored(
        &self,
        context: &ScoringContext<'_>,
        held_out: &HeldOut<'_>,
        trained: &[(&str, u64)],
        shapes: &[&Shape],
    ) -> Result<Vec<ScoreRow>> {
        let progress = &self.execution.progress;
        let seeds = &self.config.compare.seeds;
        let mut rows = Vec::new();
        let mut score = |supervision: &str, seed: u64, embedder: Embedder<'_>| -> Result<()> {
            self.refuse_if_interrupted()?;
            let model = ScoredModel {
                supervision,
                seed,
                embedder,
            };
            rows.extend(evaluate(context, &model, shapes, progress)?);
            Ok(())
        };
        score(NO_NETWORK, seeds[0], Embedder::Geometry)?;
        score(RANDOM_FOURIER, seeds[0], Embedder::RandomFourier(seeds[0]))?;
        for &seed in seeds {
            let untrained = Model::init(&self.config.net, seed, self.execution.backend)?;
            score(UNTRAINED, seed, Embedder::Network(&untrained))?;
            for &(supervision, _) in trained.iter().filter(|(_, of)| *of == seed) {
                let model = held_out.model(supervision, seed)?;
                score(supervision, seed, Embedder::Network(&model))?;
            }
        }
        rows.extend(bounds(context, shapes, progress)?);
        Ok(rows)
    }

    /// The supervision and the seed of each trained backbone.
    pub(super) fn trained_models(&self, held_out: &HeldOut<'_>) -> Result<Vec<(&'a str, u64)>> {
        let compare = &self.config.compare;
        let mut trained = Vec::new();
        for &seed in &compare.seeds {
            for supervision in &compare.supervision {
                let weights = self.folder.path(&weights_path(supervision, seed));
                if !weights.exists() {
                    self.execution.progress.note(&format!(
                        "warning: {supervision}, seed {seed}: not trained yet, left out"
                    ));
                    continue;
                }
                held_out.model(supervision, seed)?;
                trained.push((supervision.as_str(), seed));
            }
        }
        ensure!(
            !trained.is_empty(),
            "no backbone of {} is trained yet; finish its trainings with --resume",
            self.folder.root().display()
        );
        Ok(trained)
    }

    fn refuse_if_interrupted(&self) -> Result<()> {
        ensure!(
            !self.execution.interrupt.is_set(),
            "interrupted; `partprobe eval {}` scores again",
            self.folder.root().display()
        );
        Ok(())
    }
}
