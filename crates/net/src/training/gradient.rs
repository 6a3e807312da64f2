//! Holds the gradient of an update: a sum over shapes, added in the order of the batch.
//!
//! Several threads compute shapes at the same time. Their gradients are added in the order of the batch, so the sum does not
//! depend on the number of threads. A gradient that is ready too early waits for the previous ones.

use super::Training;
use crate::model::parameters;
use crate::training::loss::LossTerms;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// The gradient of an update while it is computed.
#[derive(Debug)]
pub struct Gradient {
    /// The sum over the shapes that had a loss, one number per parameter.
    pub(super) sum: Vec<f32>,
    /// The losses of these shapes.
    pub(super) losses: Vec<LossTerms>,
    /// The statistics of the batch norms, pass by pass. The list is empty without batch norms.
    pub(super) statistics: Vec<Vec<f32>>,
    /// The ids of all shapes, with or without a loss.
    pub(super) shapes: Vec<String>,
}

impl Gradient {
    /// The gradient before the first batch.
    #[must_use]
    pub fn zero(training: &Training) -> Self {
        Self {
            sum: vec![0.0; training.values.len()],
            losses: Vec::new(),
            statistics: Vec::new(),
            shapes: Vec::new(),
        }
    }

    /// Reverses the sign of the gradient.
    pub(super) fn negate(&mut self) {
        self.sum.iter_mut().for_each(|g| *g = -*g);
    }

    /// Sets the gradient of tensors to 0 if their names satisfy `is_cleared`.
    pub(super) fn clear_tensors(&mut self, training: &Training, is_cleared: impl Fn(&str) -> bool) {
        let mut rest = self.sum.as_mut_slice();
        for tensor in parameters::shapes(training.model.network()) {
            let (own, after) = rest.split_at_mut(tensor.len().min(rest.len()));
            if is_cleared(&tensor.name) {
                own.fill(0.0);
            }
            rest = after;
        }
    }

    /// The mean over the `n_shapes` shapes that had a loss.
    pub(super) fn into_mean(mut self, n_shapes: usize) -> Vec<f32> {
        let weight = 1.0 / n_shapes.max(1) as f32;
        self.sum.iter_mut().for_each(|g| *g *= weight);
        self.sum
    }
}

/// A sum whose terms arrive in any order and are added in the order of their indices.
pub(super) struct OrderedSum(Mutex<Terms>);

struct Terms {
    sum: Vec<f32>,
    next: usize,
    /// Terms that arrived too early. A shape without a loss is `None`.
    waiting: BTreeMap<usize, Option<Vec<f32>>>,
}

impl OrderedSum {
    /// A sum that starts from `sum` and waits for the term with the index 0.
    pub(super) fn new(sum: Vec<f32>) -> Self {
        Self(Mutex::new(Terms {
            sum,
            next: 0,
            waiting: BTreeMap::new(),
        }))
    }

    /// Adds a term as soon as all previous terms have arrived.
    pub(super) fn add(&self, at: usize, term: Option<Vec<f32>>) {
        let mut terms = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        terms.waiting.insert(at, term);
        let next = terms.next;
        for at in next.. {
            let Some(term) = terms.waiting.remove(&at) else {
                break;
            };
            for (total, g) in terms.sum.iter_mut().zip(term.unwrap_or_default()) {
                *total += g;
            }
            terms.next += 1;
        }
    }

    /// The sum of all terms.
    pub(super) fn into_sum(self) -> Vec<f32> {
        self.0
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
            .sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_are_added_in_order_for_any_arrival() {
        // In f32, 1 + 1e8 − 1e8 is 0 and 1e8 − 1e8 + 1 is 1.
        let terms = [Some(vec![1e8f32]), None, Some(vec![-1e8]), Some(vec![1.0])];
        for arrival in [[0, 1, 2, 3], [3, 2, 1, 0], [3, 0, 2, 1]] {
            let sum = OrderedSum::new(vec![0.0]);
            arrival
                .into_iter()
                .for_each(|at| sum.add(at, terms[at].clone()));
            assert_eq!(sum.into_sum(), [1.0]);
        }
    }
}
