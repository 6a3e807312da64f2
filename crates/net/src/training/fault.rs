//! Injects a fault into a training, to test the expectations of a run.
//!
//! If the expectations of a run still hold with a [`Fault`], they are too weak. A fault wraps the batches and the observer of
//! [`fit`](super::fit::fit). The loop and the settings of a training do not depend on it.

use super::batches::Batches;
use super::gradient::Gradient;
use super::observer::Observer;
use super::{LoadedShape, StepReport, Training};
use partprobe_carrier::keyed_rng;
use rand::Rng as _;
use std::ops::ControlFlow;

/// A fault that is injected into a training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The gradient has the wrong sign.
    FlipLoss,
    /// The labels of a shape's tokens are permuted at random.
    ShuffleLabels,
    /// Only the head gets a gradient.
    FreezeEncoder,
    /// The first block of the network gets no gradient.
    ZeroBlockGradient,
}

impl Fault {
    /// Every fault, in the order in which they are listed.
    pub const ALL: [Self; 4] = [
        Self::FlipLoss,
        Self::ShuffleLabels,
        Self::FreezeEncoder,
        Self::ZeroBlockGradient,
    ];

    /// The name of the fault, as a user writes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::FlipLoss => "flip-loss",
            Self::ShuffleLabels => "shuffle-labels",
            Self::FreezeEncoder => "freeze-encoder",
            Self::ZeroBlockGradient => "zero-block-gradient",
        }
    }

    fn spoil_labels(self, shape: &mut LoadedShape) {
        if self == Self::ShuffleLabels {
            shuffle(&mut shape.labels, &shape.id);
        }
    }

    fn spoil_gradient(self, training: &Training, gradient: &mut Gradient) {
        match self {
            Self::FlipLoss => gradient.negate(),
            Self::ShuffleLabels => {}
            Self::FreezeEncoder => {
                gradient.clear_tensors(training, |name| !name.starts_with("head."))
            }
            Self::ZeroBlockGradient => {
                gradient.clear_tensors(training, |name| name.contains("encoder.0.blocks.0."))
            }
        }
    }
}

/// Permutes labels at random, always in the same way for the same shape.
fn shuffle(labels: &mut [i32], shape: &str) {
    let rng = &mut keyed_rng(0, &["fault", shape]);
    for last in (1..labels.len()).rev() {
        labels.swap(last, (rng.next_u64() % (last as u64 + 1)) as usize);
    }
}

/// Batches or an observer with an injected fault.
#[derive(Debug)]
pub struct FaultInjection<T> {
    inner: T,
    fault: Fault,
}

impl<T> FaultInjection<T> {
    /// Injects the fault.
    pub fn new(inner: T, fault: Fault) -> Self {
        Self { inner, fault }
    }
}

impl<B: Batches> Batches for FaultInjection<&mut B> {
    type Error = B::Error;

    fn next_batch(&mut self) -> Result<Vec<LoadedShape>, Self::Error> {
        let mut batch = self.inner.next_batch()?;
        batch
            .iter_mut()
            .for_each(|shape| self.fault.spoil_labels(shape));
        Ok(batch)
    }
}

impl<O: Observer> Observer for FaultInjection<&mut O> {
    type Error = O::Error;

    fn before_update(&mut self, training: &Training, gradient: &mut Gradient) {
        self.inner.before_update(training, gradient);
        self.fault.spoil_gradient(training, gradient);
    }

    fn after_step(
        &mut self,
        training: &Training,
        report: &StepReport,
    ) -> Result<ControlFlow<()>, Self::Error> {
        self.inner.after_step(training, report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shuffled_labels_are_the_same_ones() {
        let labels: Vec<i32> = (0..50).map(|k| k / 10).collect();
        let mut shuffled = labels.clone();
        shuffle(&mut shuffled, "a");
        assert_ne!(shuffled, labels);
        shuffled.sort_unstable();
        assert_eq!(shuffled, labels);
    }
}
