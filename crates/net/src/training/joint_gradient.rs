//! Computes the gradient of a batch whose shapes pass through the network together, for networks with batch norms.
//!
//! A batch norm sees the tokens of all shapes. Neighborhoods, patches, clusters and losses stay within their shapes. The
//! computation uses one thread, and memory grows with the batch.

use super::backward::backward;
use super::{LoadedShape, TrainError, Training};
use crate::model::backbones::ShapeInput;
use crate::model::device_of;
use crate::model::forward_mode::ForwardMode;
use crate::model::parameters::host_values;
use crate::training::loss::{LossTerms, cosdisc};
use burn::module::Module;

/// The contribution of a batch to an update.
pub(super) struct JointGradient {
    /// The losses of the shapes that had one.
    pub(super) losses: Vec<LossTerms>,
    /// The sum of their gradients.
    pub(super) gradient: Vec<f32>,
    /// The statistics of the batch norms.
    pub(super) statistics: Vec<f32>,
}

/// Passes all shapes through the network together. `batch` must contain at least one.
///
/// # Errors
/// If a loss or the gradient is NaN or infinite. Each shape influences all others, so the error names the first shape whose loss
/// is not finite, or else the whole batch.
pub(super) fn joint_gradient(
    training: &Training,
    batch: &[LoadedShape],
) -> Result<JointGradient, TrainError> {
    let (model, settings) = (&training.model, &training.settings);
    let network = model.network().clone().train();
    let inputs: Vec<&ShapeInput> = batch.iter().map(|shape| &shape.input).collect();
    let mut mode = ForwardMode::training(batch[0].path_rng(settings.train.seed));
    let z = network.forward(&inputs, &device_of(model.backend()).autodiff(), &mut mode);
    let host = host_values(z.clone());
    let (mut losses, mut by_row) = (Vec::new(), Vec::with_capacity(host.len()));
    let dim = model.config().embedding_dim;
    for shape in batch {
        let own = &host[by_row.len()..][..shape.labels.len() * dim];
        match cosdisc(own, dim, &shape.labels, &settings.loss) {
            Some(loss) if !loss.terms.total.is_finite() => {
                return Err(not_finite(&shape.id, shape.step));
            }
            Some(loss) => {
                losses.push(loss.terms);
                by_row.extend(loss.gradient);
            }
            None => by_row.resize(by_row.len() + own.len(), 0.0),
        }
    }
    let gradient = backward(&network, z, &by_row);
    let statistics = mode.into_statistics();
    if gradient.iter().chain(&statistics).any(|x| !x.is_finite()) {
        let ids: Vec<&str> = batch.iter().map(|shape| shape.id.as_str()).collect();
        return Err(not_finite(&ids.join(", "), batch[0].step));
    }
    Ok(JointGradient {
        losses,
        gradient,
        statistics,
    })
}

fn not_finite(shape: &str, step: usize) -> TrainError {
    TrainError::NonFinite {
        shape: shape.to_owned(),
        step: step + 1,
    }
}
