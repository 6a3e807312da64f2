//! The loss of a batch and its gradient: loaded shapes and weights in, one vector out.
//!
//! Shapes are computed side by side, one thread each; their gradients are added in the order of the batch, so that the
//! number of threads does not reach the sum. No more gradients are kept at a time than the order demands.
//! Where a network runs the batch as one, one thread computes all of it.

use super::joint_gradient::joint_gradient;
use super::workers::Workers;
use super::{LoadedShape, TrainError};
use crate::config::TrainSettings;
use crate::loss::{LossTerms, cosdisc};
use crate::model::{Model, device_of};
use crate::network::Network;
use crate::ops;
use crate::parameters;
use crate::pass::Pass;
use burn::module::Module;
use burn::tensor::Tensor;
use carrier::{Rng, keyed_rng};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// The gradient of an update in the making: a sum over shapes, and the losses of those that had one.
#[derive(Debug)]
pub(super) struct BatchGradient {
    sum: Vec<f32>,
    pub(super) losses: Vec<LossTerms>,
    /// What the batch norms counted, pass by pass; nothing without batch norms.
    pub(super) statistics: Vec<Vec<f32>>,
}

impl BatchGradient {
    pub(super) fn zero(n_parameters: usize) -> Self {
        Self { sum: vec![0.0; n_parameters], losses: Vec::new(), statistics: Vec::new() }
    }

    /// Adds the gradients of the shapes of a batch, in their order; the first error in that order wins.
    pub(super) fn add(
        &mut self,
        model: &Model,
        settings: &TrainSettings,
        batch: &[LoadedShape],
        workers: &Workers,
    ) -> Result<(), TrainError> {
        if model.config().runs_batch_as_one() {
            return self.add_as_one(model, settings, batch, workers);
        }
        let ordered = Mutex::new(OrderedSum { sum: std::mem::take(&mut self.sum), next: 0, waiting: BTreeMap::new() });
        let losses: Vec<Result<_, TrainError>> = workers.map(batch, |at, shape| {
            let found = shape_gradient(model, settings, shape)?;
            let (terms, gradient) = found.unzip();
            ordered.lock().unwrap_or_else(PoisonError::into_inner).add(at, gradient);
            Ok(terms)
        });
        self.sum = ordered.into_inner().unwrap_or_else(PoisonError::into_inner).sum;
        let losses: Vec<Option<LossTerms>> = losses.into_iter().collect::<Result<_, _>>()?;
        self.losses.extend(losses.into_iter().flatten());
        Ok(())
    }

    fn add_as_one(
        &mut self,
        model: &Model,
        settings: &TrainSettings,
        batch: &[LoadedShape],
        workers: &Workers,
    ) -> Result<(), TrainError> {
        // A single job: one worker takes it, and the tensor operations find one thread.
        for found in workers.map(&[batch], |_, batch| joint_gradient(model, settings, batch)) {
            let found = found?;
            for (total, g) in self.sum.iter_mut().zip(&found.gradient) {
                *total += g;
            }
            self.losses.extend(found.losses);
            self.statistics.push(found.statistics);
        }
        Ok(())
    }

    /// The mean over the shapes that had a loss.
    pub(super) fn into_mean(mut self) -> Vec<f32> {
        let share = 1.0 / self.losses.len().max(1) as f32;
        self.sum.iter_mut().for_each(|g| *g *= share);
        self.sum
    }
}

/// A sum whose terms come in any order and are added in that of their indices.
struct OrderedSum {
    sum: Vec<f32>,
    next: usize,
    /// Terms that came before their turn; none for a shape without a loss.
    waiting: BTreeMap<usize, Option<Vec<f32>>>,
}

impl OrderedSum {
    fn add(&mut self, at: usize, term: Option<Vec<f32>>) {
        self.waiting.insert(at, term);
        while let Some(term) = self.waiting.remove(&self.next) {
            for (total, g) in self.sum.iter_mut().zip(term.unwrap_or_default()) {
                *total += g;
            }
            self.next += 1;
        }
    }
}

/// The loss of one shape and its gradient by every parameter; none if fewer than two labels are on its tokens.
fn shape_gradient(
    model: &Model,
    settings: &TrainSettings,
    shape: &LoadedShape,
) -> Result<Option<(LossTerms, Vec<f32>)>, TrainError> {
    let device = device_of(model.backend());
    let network = model.network().clone().train();
    let mut pass = Pass::training(path_rng(settings, shape));
    let z = network.forward(&[&shape.input], &device.autodiff(), &mut pass);
    let Some(mut loss) =
        cosdisc(&parameters::host_values(z.clone()), model.config().embedding_dim, &shape.labels, &settings.loss)
    else {
        return Ok(None);
    };
    settings.train.sabotage.flip(&mut loss);
    let gradient = backward(&network, z, &loss.gradient);
    if !loss.terms.total.is_finite() || gradient.iter().any(|g| !g.is_finite()) {
        return Err(TrainError::NonFinite { shape: shape.id.clone(), step: shape.step + 1 });
    }
    Ok(Some((loss.terms, gradient)))
}

/// Where the dropped paths of a shape are drawn from.
pub(super) fn path_rng(settings: &TrainSettings, shape: &LoadedShape) -> Rng {
    keyed_rng(settings.train.seed, &["drop path", &shape.id, &shape.step.to_string()])
}

/// Takes ∂L/∂z back to the parameters.
pub(super) fn backward(network: &Network, z: Tensor<2>, gradient: &[f64]) -> Vec<f32> {
    let mut gradients = ops::with_gradient(z, gradient.iter().map(|&g| g as f32).collect()).backward();
    parameters::gradients(network, &mut gradients)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_are_added_in_their_order_whenever_they_come() {
        // In f32, 1 + 1e8 − 1e8 is 0 and 1e8 − 1e8 + 1 is 1.
        let terms = [Some(vec![1e8f32]), None, Some(vec![-1e8]), Some(vec![1.0])];
        for arrival in [[0, 1, 2, 3], [3, 2, 1, 0], [3, 0, 2, 1]] {
            let mut sum = OrderedSum { sum: vec![0.0], next: 0, waiting: BTreeMap::new() };
            arrival.into_iter().for_each(|at| sum.add(at, terms[at].clone()));
            assert_eq!((sum.sum, sum.waiting.len()), (vec![1.0], 0));
        }
    }
}
