//! Defines the actions of the caller between two updates: logs, validations, checkpoints, early stopping.

use super::gradient::Gradient;
use super::{StepReport, Training};
use std::ops::ControlFlow;

/// An observer of a training.
pub trait Observer {
    /// The error of the observer.
    type Error;

    /// Called when the gradient of an update is complete, before the weights move. It may change the gradient.
    fn before_update(&mut self, _training: &Training, _gradient: &mut Gradient) {}

    /// Called after each update. `Break` ends the training here.
    ///
    /// # Errors
    /// If a log, a validation or a checkpoint fails. The training ends with this error.
    fn after_step(
        &mut self,
        training: &Training,
        report: &StepReport,
    ) -> Result<ControlFlow<()>, Self::Error>;
}
