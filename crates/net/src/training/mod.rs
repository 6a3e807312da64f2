//! Trains a network, one update at a time. Start with `fit`, which is the loop.
//!
//! All randomness is keyed by the seed, the shape's id and the step, never by labels. Every supervision therefore gets the
//! same initial weights, order of shapes, poses and number of updates. Gradients are summed in the order of the batch, so
//! the number of threads does not change the result.

mod accumulate;
mod backward;
mod batches;
pub(crate) mod checkpoint;
mod error;
mod fault;
mod fit;
mod gradient;
mod joint_gradient;
mod loading;
pub(crate) mod loss;
mod observer;
pub(crate) mod optimizer;
mod workers;

pub use batches::{Batches, MemoryBatches};
pub use error::TrainError;
pub use fault::{Fault, FaultInjection};
pub use fit::fit;
pub use gradient::Gradient;
pub use loading::{LoadedShape, Loading};
pub use observer::Observer;

use crate::config::{Backend, TrainConfig, TrainSettings};
use crate::model::Model;
use crate::model::batch_norm::move_running_statistics;
use crate::model::net_config::NetConfig;
use crate::model::parameters;
use crate::training::loss::LossTerms;
use crate::training::optimizer::{AdamW, Group};
use partprobe_carrier::PointSample;
use workers::Workers;

/// One training shape: its sampled points and one label per point.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainShape {
    /// The id of the shape. It is a key of the random augmentation.
    pub id: String,
    /// Points and normals.
    pub sample: PointSample,
    /// The supervision's label of each point. Negative labels are ignored.
    pub labels: Vec<i32>,
}

/// A training that can be stopped after each update and resumed.
#[derive(Debug)]
pub struct Training {
    pub(crate) settings: TrainSettings,
    pub(crate) model: Model,
    pub(crate) values: Vec<f32>,
    pub(crate) adam: AdamW,
    pub(crate) n_done: usize,
    pub(crate) data: Option<String>,
    groups: Vec<Group>,
    workers: Workers,
}

/// The report of one update.
#[derive(Clone, Debug, PartialEq)]
pub struct StepReport {
    /// The number of updates, including this one.
    pub step: usize,
    /// The loss and its terms: means over the shapes that have at least two labels.
    pub loss: LossTerms,
    /// The learning rate.
    pub learning_rate: f64,
    /// Norm of the gradient over all parameters, before clipping.
    pub grad_norm: f64,
    /// Ids of the batch, in order.
    pub shapes: Vec<String>,
    /// The number of shapes of the batch without a loss, because their tokens had fewer than two labels.
    pub n_without_loss: usize,
}

impl Training {
    /// Starts from initial weights, with one thread. [`Training::with_threads`] changes the number of threads.
    ///
    /// # Errors
    /// If a setting is out of its range or no thread can be started.
    pub fn new(
        net: &NetConfig,
        settings: &TrainSettings,
        backend: Backend,
    ) -> Result<Self, TrainError> {
        let model = Model::init(net, settings.train.seed, backend)?;
        let adam = AdamW::new(model.values().len());
        Self::from_state(model, settings, adam, 0)
    }

    /// Starts from the weights of a model, for example of a network that is pre-trained on other shapes. The state of the
    /// optimizer starts at zero.
    ///
    /// # Errors
    /// If the model has another network, a setting is out of its range or no thread can be started.
    pub fn from_weights(
        net: &NetConfig,
        settings: &TrainSettings,
        initial: &Model,
    ) -> Result<Self, TrainError> {
        if initial.config().without_refine() != net.without_refine() {
            return Err(TrainError::OtherNetwork);
        }
        let model = Model::blank(net, initial.backend())?.with_values(&initial.values());
        let adam = AdamW::new(model.values().len());
        Self::from_state(model, settings, adam, 0)
    }

    pub(crate) fn from_state(
        model: Model,
        settings: &TrainSettings,
        adam: AdamW,
        n_done: usize,
    ) -> Result<Self, TrainError> {
        settings.check()?;
        let shapes = parameters::shapes(model.network());
        let part_of_none = settings.train.freeze.iter().find(|part| {
            let alone = TrainConfig {
                freeze: vec![(*part).clone()],
                ..TrainConfig::default()
            };
            !shapes.iter().any(|shape| alone.freezes(&shape.name))
        });
        if let Some(part) = part_of_none {
            return Err(TrainError::NoSuchPart(part.clone()));
        }
        let groups = Group::of_tensors(&shapes, settings);
        let values = model.values();
        let workers = Workers::new(1)?;
        Ok(Self {
            settings: settings.clone(),
            model,
            values,
            adam,
            n_done,
            data: None,
            groups,
            workers,
        })
    }

    /// The same training with another length or schedule.
    ///
    /// # Errors
    /// If a setting is out of its range, or an earlier update would have had another learning rate with the new schedule.
    pub fn extended(mut self, settings: &TrainSettings) -> Result<Self, TrainError> {
        settings.check()?;
        if let Some(step) = self.settings.first_other_rate(settings, self.n_done) {
            return Err(TrainError::OtherRate { step: step + 1 });
        }
        self.settings = settings.clone();
        self.groups = Group::of_tensors(&parameters::shapes(self.model.network()), settings);
        Ok(self)
    }

    /// Computes `n_threads` shapes of a batch at the same time. The result is the same, byte for byte.
    ///
    /// # Errors
    /// If the threads cannot be started.
    pub fn with_threads(mut self, n_threads: usize) -> Result<Self, TrainError> {
        self.workers = Workers::new(n_threads)?;
        Ok(self)
    }

    /// Sets a text that identifies the shapes and labels of this training. Checkpoints contain it.
    #[must_use]
    pub fn with_data(self, data: String) -> Self {
        Self {
            data: Some(data),
            ..self
        }
    }

    /// The text of [`Training::with_data`], or `None` if it was not set.
    #[must_use]
    pub fn data(&self) -> Option<&str> {
        self.data.as_deref()
    }

    /// The number of updates so far.
    #[must_use]
    pub fn n_steps_done(&self) -> usize {
        self.n_done
    }

    /// Whether all updates of the settings are done.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.n_done >= self.settings.train.steps
    }

    /// The network with its current weights.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Names of the tensors whose gradients have always been 0. A correct training has none.
    #[must_use]
    pub fn untouched_tensors(&self) -> Vec<String> {
        let shapes = parameters::shapes(self.model.network());
        let untouched = self
            .adam
            .untouched(&self.groups)
            .into_iter()
            .map(|idx| &shapes[idx]);
        untouched
            .filter(|shape| !shape.is_statistic() && !self.settings.train.freezes(&shape.name))
            .map(|shape| shape.name.clone())
            .collect()
    }

    /// The settings of the training.
    #[must_use]
    pub fn settings(&self) -> &TrainSettings {
        &self.settings
    }

    /// The loader of shapes for this training. It can be used on any thread.
    #[must_use]
    pub fn loading(&self) -> Loading {
        Loading {
            net: self.model.config().clone(),
            settings: self.settings.clone(),
        }
    }

    /// Loads the next batch of the seeded order, with the threads of the training.
    ///
    /// `shapes` must be the same at each call, because the order refers to their indices.
    ///
    /// # Errors
    /// If there is no shape, or a shape of the batch cannot be used.
    pub fn load(&self, shapes: &[TrainShape]) -> Result<Vec<LoadedShape>, TrainError> {
        let loading = self.loading();
        let batch = loading.batch(shapes.len(), self.n_done);
        self.workers
            .map(&batch, |_, &idx| loading.load(&shapes[idx], self.n_done))
            .into_iter()
            .collect()
    }

    /// Makes one update from the shapes that were loaded for it, outside of [`fit()`].
    ///
    /// # Errors
    /// If there is no shape, or the numbers are not finite. The weights do not change.
    pub fn step(&mut self, shapes: &[LoadedShape]) -> Result<StepReport, TrainError> {
        let mut gradient = Gradient::zero(self);
        for batch in shapes.chunks(self.settings.train.batch_shapes) {
            gradient.accumulate(self, batch)?;
        }
        self.apply(gradient)
    }

    /// Moves the running statistics of batch norms. They have no gradient, so the update does not change them.
    fn move_statistics(&mut self, statistics: &[Vec<f32>]) {
        let shapes = parameters::shapes(self.model.network());
        let config = &self.settings.train;
        for recorded in statistics {
            move_running_statistics(&shapes, &mut self.values, recorded, |name| {
                config.freezes(name)
            });
        }
    }

    /// Sets the gradients of frozen tensors to 0.
    fn freeze_gradient(&self, gradient: &mut [f32]) {
        if self.settings.train.freeze.is_empty() {
            return;
        }
        let mut rest = gradient;
        for shape in parameters::shapes(self.model.network()) {
            let (own, after) = rest.split_at_mut(shape.len());
            rest = after;
            if self.settings.train.freezes(&shape.name) {
                own.fill(0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests;
