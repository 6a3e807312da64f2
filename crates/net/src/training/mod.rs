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

/// One training shape: its sampled points and a label for each of them.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainShape {
    /// The id of the shape; it keys the augmentation.
    pub id: String,
    /// Points and normals.
    pub sample: PointSample,
    /// The supervision's label of each point; negative ones are ignored.
    pub labels: Vec<i32>,
}

/// A training that can be stopped after each update and gone on with.
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

/// What one update did.
#[derive(Clone, Debug, PartialEq)]
pub struct StepReport {
    /// Updates done, this one included.
    pub step: usize,
    /// The loss and its terms: means over the shapes that have at least two labels.
    pub loss: LossTerms,
    /// The learning rate.
    pub learning_rate: f64,
    /// Norm of the gradient over all parameters, before clipping.
    pub grad_norm: f64,
    /// Ids of the batch, in order.
    pub shapes: Vec<String>,
    /// Shapes of the batch that had no loss because fewer than two labels were left on their tokens.
    pub n_without_loss: usize,
}

impl Training {
    /// Starts from initial weights; one thread until [`Training::with_threads`] says otherwise.
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

    /// Starts from the weights of a model, as when a network is pre-trained on other shapes. The optimizer starts anew.
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
    /// If a setting is out of its range, or the schedule would have given one of the updates that are done another
    /// learning rate.
    pub fn extended(mut self, settings: &TrainSettings) -> Result<Self, TrainError> {
        settings.check()?;
        if let Some(step) = self.settings.first_other_rate(settings, self.n_done) {
            return Err(TrainError::OtherRate { step: step + 1 });
        }
        self.settings = settings.clone();
        self.groups = Group::of_tensors(&parameters::shapes(self.model.network()), settings);
        Ok(self)
    }

    /// Lets `n_threads` shapes of a batch be computed at once. The result is the same, byte for byte.
    ///
    /// # Errors
    /// If the threads cannot be started.
    pub fn with_threads(mut self, n_threads: usize) -> Result<Self, TrainError> {
        self.workers = Workers::new(n_threads)?;
        Ok(self)
    }

    /// Notes what tells the shapes and labels of this training from others; its checkpoints keep it.
    #[must_use]
    pub fn with_data(self, data: String) -> Self {
        Self {
            data: Some(data),
            ..self
        }
    }

    /// What [`Training::with_data`] noted; `None` if nothing was.
    #[must_use]
    pub fn data(&self) -> Option<&str> {
        self.data.as_deref()
    }

    /// Updates done so far.
    #[must_use]
    pub fn n_steps_done(&self) -> usize {
        self.n_done
    }

    /// Whether all updates of the settings are done.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.n_done >= self.settings.train.steps
    }

    /// The network with its present weights.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Names of the tensors that no gradient other than 0 has ever reached; a sound training has none.
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

    /// What the training was started with.
    #[must_use]
    pub fn settings(&self) -> &TrainSettings {
        &self.settings
    }

    /// What loads shapes for this training, on any thread.
    #[must_use]
    pub fn loading(&self) -> Loading {
        Loading {
            net: self.model.config().clone(),
            settings: self.settings.clone(),
        }
    }

    /// Loads the next batch of the seeded order, with the threads of the training.
    ///
    /// `shapes` must be the same at each call: the order is one of their indices.
    ///
    /// # Errors
    /// If there is no shape, or one of the batch is unusable.
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
    /// If there is no shape, or the numbers stop being finite; the weights stay as they were.
    pub fn step(&mut self, shapes: &[LoadedShape]) -> Result<StepReport, TrainError> {
        let mut gradient = Gradient::zero(self);
        for batch in shapes.chunks(self.settings.train.batch_shapes) {
            gradient.accumulate(self, batch)?;
        }
        self.apply(gradient)
    }

    /// Moves the running statistics of batch norms, which have no gradient: the update leaves them as they are.
    fn move_statistics(&mut self, statistics: &[Vec<f32>]) {
        let shapes = parameters::shapes(self.model.network());
        let config = &self.settings.train;
        for recorded in statistics {
            move_running_statistics(&shapes, &mut self.values, recorded, |name| {
                config.freezes(name)
            });
        }
    }

    /// Takes the gradient of each tensor away that keeps its weights.
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
