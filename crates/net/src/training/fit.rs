//! The training loop. Read this file first: the loop, and below it what one shape adds to the gradient.
//!
//! [`fit`] takes batches from one caller-supplied trait and reports to another, so that it opens no file and reads no
//! clock. Logging, validation, checkpoints and early stopping are an [`Observer`]; loader threads are [`Batches`].

use super::backward::backward;
use super::gradient::{Gradient, OrderedSum};
use super::joint_gradient::joint_gradient;
use super::{LoadedShape, StepReport, TrainError, Training};
use crate::model::device_of;
use crate::model::forward_mode::ForwardMode;
use crate::model::parameters::host_values;
use crate::training::loss::{LossTerms, cosdisc};
use burn::module::Module;
use std::ops::ControlFlow;

/// Where the shapes of the next batch come from.
pub trait Batches {
    /// Why there is no batch.
    type Error;

    /// The next `train.batch_shapes` shapes of the seeded order.
    ///
    /// # Errors
    /// If a shape of the batch cannot be loaded.
    fn next_batch(&mut self) -> Result<Vec<LoadedShape>, Self::Error>;
}

/// What watches a training.
pub trait Observer {
    /// Why watching failed.
    type Error;

    /// Called when the gradient of an update is complete, before the weights move. It may change the gradient.
    fn before_update(&mut self, _training: &Training, _gradient: &mut Gradient) {}

    /// Called after each update. `Break` ends the training here.
    ///
    /// # Errors
    /// If a log, a validation or a checkpoint fails; the training ends with this error.
    fn after_step(
        &mut self,
        training: &Training,
        report: &StepReport,
    ) -> Result<ControlFlow<()>, Self::Error>;
}

/// Trains until the last step, or until the observer ends it.
///
/// # Errors
/// The first error of the batches, the observer or an update. If an update fails, the weights are those before it.
pub fn fit<E: From<TrainError>>(
    training: &mut Training,
    batches: &mut impl Batches<Error = E>,
    observer: &mut impl Observer<Error = E>,
) -> Result<(), E> {
    while !training.is_done() {
        let mut gradient = Gradient::zero(training);
        for _ in 0..training.settings().train.accumulate {
            let batch = batches.next_batch()?;
            gradient.accumulate(training, &batch)?; // forward, loss, backward
        }
        observer.before_update(training, &mut gradient);
        let report = training.apply(gradient)?; // mean, clip, AdamW

        if observer.after_step(training, &report)?.is_break() {
            break;
        }
    }
    Ok(())
}

/// One shape: forward, loss, backward. `None` if fewer than two labels are on its tokens.
fn shape_gradient(
    training: &Training,
    shape: &LoadedShape,
) -> Result<Option<(LossTerms, Vec<f32>)>, TrainError> {
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

impl Gradient {
    /// Adds the gradients of a batch, one thread per shape, in the order of the batch. Several batches add up to what
    /// one large batch would have given.
    ///
    /// # Errors
    /// If a number is NaN or infinite; the first such shape in the order of the batch is named.
    pub fn accumulate(
        &mut self,
        training: &Training,
        batch: &[LoadedShape],
    ) -> Result<(), TrainError> {
        if training.model.config().runs_batch_as_one() {
            self.accumulate_as_one(training, batch)?;
        } else {
            self.accumulate_shapes(training, batch)?;
        }
        self.shapes
            .extend(batch.iter().map(|shape| shape.id.clone()));
        Ok(())
    }

    fn accumulate_shapes(
        &mut self,
        training: &Training,
        batch: &[LoadedShape],
    ) -> Result<(), TrainError> {
        let ordered = OrderedSum::new(std::mem::take(&mut self.sum));
        let losses = training.workers.map(batch, |at, shape| {
            let (terms, gradient) = shape_gradient(training, shape)?.unzip();
            ordered.add(at, gradient);
            Ok(terms)
        });
        self.sum = ordered.into_sum();

        let losses: Vec<Option<LossTerms>> =
            losses.into_iter().collect::<Result<_, TrainError>>()?;
        self.losses.extend(losses.into_iter().flatten());
        Ok(())
    }

    /// A network with batch norms sees the whole batch at once. This is a single job: one worker takes it, and the
    /// tensor operations find one thread.
    fn accumulate_as_one(
        &mut self,
        training: &Training,
        batch: &[LoadedShape],
    ) -> Result<(), TrainError> {
        for found in training
            .workers
            .map(&[batch], |_, batch| joint_gradient(training, batch))
        {
            let found = found?;
            for (total, g) in self.sum.iter_mut().zip(&found.gradient) {
                *total += g;
            }
            self.losses.extend(found.losses);
            self.statistics.push(found.statistics);
        }
        Ok(())
    }
}
