//! Trains a model: this is the training loop. Read this file first in this crate.
//!
//! [`fit`] is the loop. Below it are the two steps of an update: [`shape_gradient`] computes the gradient of one shape, and
//! [`Training::apply`] moves the weights by the gradient of all shapes.
//!
//! The loop opens no file and reads no clock. The caller supplies its input and its output: [`Batches`] loads shapes, and
//! [`Observer`] logs, validates, writes checkpoints and stops early.
//!
//! Other modules contain the rest: poses, tokens and the order of shapes are in `data` (`pose.rs`, `tokens.rs`,
//! `shape_order.rs`), the cosine discriminative loss is in `loss/mod.rs`, and the schedule of the learning rate and AdamW are in
//! `optimizer.rs`. With batch norms, a batch is one pass of the network (`joint_gradient.rs`), and [`shape_gradient`] is not
//! used.

use super::backward::backward;
use super::batches::Batches;
use super::gradient::Gradient;
use super::loss::{LossTerms, cosdisc};
use super::observer::Observer;
use super::optimizer::{Update, clip, learning_rate};
use super::{LoadedShape, StepReport, TrainError, Training};
use crate::model::device_of;
use crate::model::forward_mode::ForwardMode;
use crate::model::parameters::host_values;
use burn::module::Module;

/// Trains until the last step, or until the observer ends it.
///
/// # Errors
/// The first error of the batches, the observer or an update. If an update fails, the weights do not change.
pub fn fit<E: From<TrainError>>(
    training: &mut Training,
    batches: &mut impl Batches<Error = E>,
    observer: &mut impl Observer<Error = E>,
) -> Result<(), E> {
    while !training.is_done() {
        let mut gradient = Gradient::zero(training);
        for _ in 0..training.settings().train.accumulate {
            let batch = batches.next_batch()?;
            gradient.accumulate(training, &batch)?; // `shape_gradient` of each shape, on several threads
        }
        observer.before_update(training, &mut gradient);
        let report = training.apply(gradient)?; // mean, clip, AdamW

        if observer.after_step(training, &report)?.is_break() {
            break;
        }
    }
    Ok(())
}

/// Computes forward pass, loss and backward pass for one shape. Returns `None` if its tokens have fewer than two labels.
pub(super) fn shape_gradient(
    training: &Training,
    shape: &LoadedShape,
) -> Result<Option<(LossTerms, Vec<f32>)>, TrainError> {
    // The same weights, recorded for automatic differentiation.
    let network = training.model.network().clone().train();
    let device = device_of(training.model.backend()).autodiff();
    let mut mode = ForwardMode::training(shape.path_rng(training.settings.train.seed));

    let z = network.forward(&[&shape.input], &device, &mut mode);
    let dim = training.model.config().embedding_dim;
    let Some(loss) = cosdisc(
        &host_values(z.clone()),
        dim,
        &shape.labels,
        &training.settings.loss,
    ) else {
        return Ok(None);
    };
    let gradient = backward(&network, z, &loss.gradient);

    if !loss.terms.total.is_finite() || gradient.iter().any(|g| !g.is_finite()) {
        return Err(TrainError::NonFinite {
            shape: shape.id.clone(),
            step: shape.step + 1,
        });
    }
    Ok(Some((loss.terms, gradient)))
}

impl Training {
    /// Moves the weights by an accumulated gradient: mean over the shapes, clipping, AdamW.
    ///
    /// Running statistics of batch norms have no gradient, so they are moved separately, before the weights. If no shape of the
    /// update has a loss, the gradient is zero, and weight decay and momentum still move the weights.
    ///
    /// # Errors
    /// If no shape was added to the gradient. The weights do not change.
    pub fn apply(&mut self, mut gradient: Gradient) -> Result<StepReport, TrainError> {
        let shapes = std::mem::take(&mut gradient.shapes);
        let losses = std::mem::take(&mut gradient.losses);
        if shapes.is_empty() {
            return Err(TrainError::NoShapes);
        }
        self.move_statistics(&gradient.statistics);

        let mut mean = gradient.into_mean(losses.len());
        self.freeze_gradient(&mut mean);
        let grad_norm = clip(&mut mean, self.settings.optim.clip_norm);
        let learning_rate = self.update(&mean);
        Ok(StepReport {
            step: self.n_done,
            loss: LossTerms::mean(&losses),
            learning_rate,
            grad_norm,
            n_without_loss: shapes.len() - losses.len(),
            shapes,
        })
    }

    /// Moves the weights against the gradient and counts the update. Returns its learning rate.
    fn update(&mut self, gradient: &[f32]) -> f64 {
        let optim = &self.settings.optim;
        let learning_rate = learning_rate(optim, self.n_done, self.settings.train.steps);
        let update = Update {
            learning_rate,
            weight_decay: optim.weight_decay,
            n_before: self.n_done,
        };
        self.adam
            .update(&mut self.values, gradient, &self.groups, &update);
        self.model = self.model.clone().with_values(&self.values);
        self.n_done += 1;
        learning_rate
    }
}
