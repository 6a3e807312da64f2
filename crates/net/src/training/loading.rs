//! Prepares a labeled shape for an update: random pose, tokens, jitter, levels, labels.
//!
//! Nothing here needs tensors or the weights, so it can run on any thread, some steps ahead of the update. The result depends
//! only on the settings, the shape and the step.

use super::{TrainError, TrainShape};
use crate::config::{TokenConfig, TrainSettings};
use crate::data::hierarchy::CurveOrders;
use crate::data::jitter::jitter;
use crate::data::pose::Pose;
use crate::data::shape_order::batch;
use crate::data::tokens::{TokenizeError, Tokens, tokenize_posed};
use crate::model::backbones::ShapeInput;
use crate::model::net_config::NetConfig;
use partprobe_carrier::{Rng, keyed_rng};

/// A shape that is prepared for an update.
pub struct LoadedShape {
    /// The id of the shape.
    pub(super) id: String,
    /// The number of updates before the one for which it was loaded.
    pub(super) step: usize,
    /// The input of the network.
    pub(super) input: ShapeInput,
    /// The label of each token. Negative labels are ignored.
    pub(super) labels: Vec<i32>,
}

impl LoadedShape {
    /// The stream of random numbers from which the dropped paths of this shape are drawn.
    pub(super) fn path_rng(&self, seed: u64) -> Rng {
        keyed_rng(seed, &["drop path", &self.id, &self.step.to_string()])
    }
}

/// The settings on which loading depends.
#[derive(Clone, Debug, PartialEq)]
pub struct Loading {
    pub(super) net: NetConfig,
    pub(super) settings: TrainSettings,
}

impl Loading {
    /// The indices of the shapes of an update, in their order, if there are `n_shapes` shapes and `step` updates are done.
    #[must_use]
    pub fn batch(&self, n_shapes: usize, step: usize) -> Vec<usize> {
        let train = &self.settings.train;
        if n_shapes == 0 {
            Vec::new()
        } else {
            batch(train.seed, n_shapes, train.update_shapes(), step)
        }
    }

    /// Prepares a shape for the update after `step` others.
    ///
    /// # Errors
    /// If its labels do not fit its points, or its points cannot be grouped into tokens.
    pub fn load(&self, shape: &TrainShape, step: usize) -> Result<LoadedShape, TrainError> {
        let PosedShape {
            tokens,
            labels,
            orders,
        } = self.pose(shape, step)?;
        Ok(LoadedShape {
            id: shape.id.clone(),
            step,
            input: self.net.backbone.prepare(&tokens, &orders),
            labels,
        })
    }

    /// The tokens that [`Loading::load`] prepares, and the label of each.
    ///
    /// # Errors
    /// As for [`Loading::load`].
    pub fn tokens(
        &self,
        shape: &TrainShape,
        step: usize,
    ) -> Result<(Tokens, Vec<i32>), TrainError> {
        self.pose(shape, step)
            .map(|posed| (posed.tokens, posed.labels))
    }

    fn pose(&self, shape: &TrainShape, step: usize) -> Result<PosedShape, TrainError> {
        let (n_points, n_labels) = (shape.sample.points.len(), shape.labels.len());
        if n_points != n_labels {
            return Err(TrainError::Labels {
                shape: shape.id.clone(),
                n_labels,
                n_points,
            });
        }
        let rng = &mut keyed_rng(
            self.settings.train.seed,
            &["augment", &shape.id, &step.to_string()],
        );
        let pose = Pose::random(&self.settings.augment, rng);
        let orders = self.net.backbone.training_orders(rng);
        let TokenConfig {
            train_tokens,
            voxels,
            ..
        } = self.settings.tokens;
        // The resolution has a separate random stream, so a range of resolutions has the same poses as a fixed number.
        let resolution = &mut keyed_rng(
            self.settings.train.seed,
            &["resolution", &shape.id, &step.to_string()],
        );
        let n_tokens = train_tokens.drawn(resolution);
        let mut tokens = tokenize_posed(&shape.sample, n_tokens, voxels, &pose)
            .map_err(|problem| bad_tokens(shape, problem, step))?;
        jitter(&mut tokens, &self.settings.augment, rng);
        let labels = tokens.majority_labels(&shape.labels);
        Ok(PosedShape {
            tokens,
            labels,
            orders,
        })
    }
}

/// A shape in the pose of one update.
struct PosedShape {
    tokens: Tokens,
    labels: Vec<i32>,
    orders: CurveOrders,
}

fn bad_tokens(shape: &TrainShape, problem: TokenizeError, step: usize) -> TrainError {
    let shape = shape.id.clone();
    match problem {
        TokenizeError::NotFinite { .. } => TrainError::NonFinite {
            shape,
            step: step + 1,
        },
        _ => TrainError::Tokens { shape, problem },
    }
}
