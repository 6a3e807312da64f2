//! Adds the gradients of a batch to the gradient of an update, with several threads.

use super::fit::shape_gradient;
use super::gradient::{Gradient, OrderedSum};
use super::joint_gradient::joint_gradient;
use super::loss::LossTerms;
use super::{LoadedShape, TrainError, Training};

impl Gradient {
    /// Adds the gradients of a batch, one thread per shape, in the order of the batch. Several batches give the same sum as one
    /// large batch.
    ///
    /// # Errors
    /// If a number is NaN or infinite. The error names the first such shape in the order of the batch.
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

    /// A network with batch norms sees the whole batch at once. This is a single job for one worker, so the tensor operations use
    /// one thread.
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
