//! Checks that a backbone belongs to this run and was not trained on the shapes on which it is scored.

use super::folder::RunFolder;
use super::shapes::{Shape, ShapeIdentity};
use super::training_job::{TrainingData, train_settings};
use super::weights::{read_weights, weights_path};
use crate::config::{Config, Difference, differences, listed};
use anyhow::{Context, Result, bail, ensure};
use partprobe_net::{Backend, Model, ModelFile, ShapeKeys, TrainedOn};

/// The largest number of shapes that are named because a backbone has seen them. Further ones are only counted.
const MAX_NAMED: usize = 5;

/// A backbone and the record of its training.
fn trained_model(
    folder: &RunFolder,
    (supervision, seed): (&str, u64),
    backend: Backend,
) -> Result<(Model, TrainedOn)> {
    let weights = read_weights(folder, supervision, seed)?;
    let context = || {
        folder
            .path(&weights_path(supervision, seed))
            .display()
            .to_string()
    };
    let file = ModelFile::from_bytes(&weights, backend).with_context(context)?;
    let trained_on = file.trained_on.with_context(|| {
        format!(
            "{} does not say on which shapes it was trained, because an earlier version wrote it; train it again in a \
             new run folder",
            context()
        )
    })?;
    Ok((file.model, trained_on))
}

/// Refuses weights that this run has not trained itself, because a resumed training must not use them as its result.
///
/// # Errors
/// If they were trained on other shapes, another supervision or seed.
pub(crate) fn ensure_trained_here(
    folder: &RunFolder,
    (supervision, seed): (&str, u64),
    data: &TrainingData,
    backend: Backend,
) -> Result<()> {
    let weights = weights_path(supervision, seed);
    let context = || folder.path(&weights).display().to_string();
    let (_, trained_on) = trained_model(folder, (supervision, seed), backend)?;
    let TrainedOn {
        supervision: found,
        settings,
        train,
        valid,
        ..
    } = &trained_on;
    let is_own = found == supervision
        && settings.train.seed == seed
        && *train == data.train
        && *valid == data.valid;
    ensure!(
        is_own,
        "{} was not trained on this run's shapes by `{supervision}` with seed {seed}; remove it, and it is trained",
        context()
    );
    Ok(())
}

/// The data with which an evaluation compares each backbone.
pub(crate) struct HeldOut<'a> {
    pub(crate) folder: &'a RunFolder,
    pub(crate) config: &'a Config,
    /// The number of training shapes of the run.
    pub(crate) n_train: usize,
    /// The shapes that are scored.
    pub(crate) test: &'a [&'a Shape],
    pub(crate) backend: Backend,
}

impl HeldOut<'_> {
    /// The trained backbone of the run.
    ///
    /// # Errors
    /// If it was trained on another supervision, seed or settings, on a shape that is scored, or does not record its training
    /// shapes.
    pub(crate) fn model(&self, supervision: &str, seed: u64) -> Result<Model> {
        let weights = weights_path(supervision, seed);
        let context = || self.folder.path(&weights).display().to_string();
        let (model, trained_on) = trained_model(self.folder, (supervision, seed), self.backend)?;
        self.ensure_network(&model).with_context(context)?;
        self.ensure_path_matches(&trained_on, supervision, seed)
            .with_context(context)?;
        self.ensure_unseen(&trained_on).with_context(context)?;
        Ok(model)
    }

    fn ensure_network(&self, model: &Model) -> Result<()> {
        let differing = differences(
            &model.config().without_refine(),
            &self.config.net.without_refine(),
        );
        ensure!(
            differing.is_empty(),
            "it is another network than this run's: net.{}",
            listed(&differing)
        );
        Ok(())
    }

    /// Refuses a backbone that is at the path of another one.
    fn ensure_path_matches(
        &self,
        trained_on: &TrainedOn,
        supervision: &str,
        seed: u64,
    ) -> Result<()> {
        let found = (
            trained_on.supervision.as_str(),
            trained_on.settings.train.seed,
        );
        ensure!(
            found == (supervision, seed),
            "it was trained on `{}` with seed {}, but its place is that of `{supervision}` with seed {seed}",
            found.0,
            found.1
        );
        let mut differing = differences(
            &trained_on.settings,
            &train_settings(self.config, self.n_train, seed),
        );
        // Backbones may be scored with other tokens than those of their validation.
        differing.retain(|Difference { key, .. }| {
            !["tokens.test_tokens", "tokens.test_poses"].contains(&key.as_str())
        });
        ensure!(
            differing.is_empty(),
            "it was trained with other settings than this run's: {}; score it in a run of its own",
            listed(&differing)
        );
        Ok(())
    }

    /// Refuses a backbone that has seen a test shape.
    fn ensure_unseen(&self, trained_on: &TrainedOn) -> Result<()> {
        let identified = |shape: &&Shape| (shape.id.clone(), shape.identity.clone());
        let test: Vec<(String, ShapeIdentity)> = self.test.iter().map(identified).collect();
        ensure_unseen(&trained_on.train, "its training", &test)?;
        ensure_unseen(&trained_on.valid, "its validation", &test)?;
        if let Some(initial) = &trained_on.initial {
            ensure_unseen(
                &initial.seen,
                "the training of the weights that it started from",
                &test,
            )?;
        }
        Ok(())
    }
}

/// Refuses weights that have seen a test shape. `what` says in the message where they have seen it.
///
/// # Errors
/// If they have.
pub(super) fn ensure_unseen(
    keys: &ShapeKeys,
    what: &str,
    test: &[(String, ShapeIdentity)],
) -> Result<()> {
    let is_seen = |shape: &ShapeIdentity| keys.has(&shape.source_sha256, &shape.mesh_hash);
    let seen: Vec<&str> = test
        .iter()
        .filter(|(_, identity)| is_seen(identity))
        .map(|(id, _)| id.as_str())
        .collect();
    if seen.is_empty() {
        return Ok(());
    }
    let named = seen[..seen.len().min(MAX_NAMED)].join(", ");
    let more = if seen.len() > MAX_NAMED { ", …" } else { "" };
    bail!(
        "{} of the {} test shapes were in {what} ({named}{more}), so scores on them mean nothing; make a run whose test shapes are \
         new to the backbone",
        seen.len(),
        test.len()
    );
}
