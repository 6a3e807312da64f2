//! The training loop, one update at a time: shapes in, better weights out.
//!
//! All randomness is keyed by the seed, the shape's id and the step, never by labels: whatever supervises, the initial
//! weights, the order of the shapes, their poses and their number of updates are the same. Gradients are summed in the
//! order of the batch, so that the number of threads does not reach the result.

use crate::augment::{Pose, jitter};
use crate::config::{Backend, ConfigError, NetConfig, TrainSettings};
use crate::hierarchy::shuffled_turns;
use crate::loss::{Loss, cosdisc};
use crate::model::{Model, device_of};
use crate::network::{n_levels, prepare};
use crate::one_thread::{ThreadError, one_thread_pool};
use crate::optimizer::{AdamW, Update, clip, learning_rate};
use crate::parameters;
use crate::shape_order::batch;
use crate::tokens::{TokenizeError, tokenize_posed};
use burn::module::Module;
use burn::tensor::{Tensor, TensorData};
use carrier::{PointSample, keyed_rng};
use rayon::ThreadPool;

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
    /// Which parameters weight decay shrinks: matrices, no biases and no norms.
    decays: Vec<bool>,
    workers: Vec<ThreadPool>,
}

/// What one update did. Losses are means over the shapes that have at least two labels.
#[derive(Clone, Debug, PartialEq)]
pub struct StepReport {
    /// Updates done, this one included.
    pub step: usize,
    /// The weighted loss.
    pub loss: f64,
    /// The pull, before its weight.
    pub pull: f64,
    /// The push, before its weight.
    pub push: f64,
    /// The prototype cross-entropy, before its weight.
    pub ce: f64,
    /// The learning rate.
    pub learning_rate: f64,
    /// Norm of the gradient over all parameters, before clipping.
    pub grad_norm: f64,
    /// Ids of the batch, in order.
    pub shapes: Vec<String>,
    /// Shapes of the batch that had no loss because fewer than two labels were left on their tokens.
    pub n_without_loss: usize,
}

/// Why an update could not be made; the training stays as it was before.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TrainError {
    /// A setting is out of its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The operating system gave no thread.
    #[error(transparent)]
    Thread(#[from] ThreadError),
    /// There is nothing to train on.
    #[error("there is no shape to train on; widen `select` or give more data")]
    NoShapes,
    /// A shape has not one label a point.
    #[error("shape `{shape}` has {n_labels} labels for {n_points} points; label and sample it again")]
    Labels {
        /// The id of the shape.
        shape: String,
        /// How many labels it has.
        n_labels: usize,
        /// How many points it has.
        n_points: usize,
    },
    /// A shape's points cannot be cut into tokens.
    #[error("shape `{shape}`: {problem}")]
    Tokens {
        /// The id of the shape.
        shape: String,
        /// What is wrong with its points.
        problem: TokenizeError,
    },
    /// Points, loss or gradient of a shape are NaN or infinite.
    #[error(
        "step {step}: shape `{shape}` gave numbers that are not finite; lower `optim.learning_rate` or leave the shape out"
    )]
    NonFinite {
        /// The id of the shape.
        shape: String,
        /// The update that was tried, counted from 1.
        step: usize,
    },
}

/// What one shape adds to an update.
struct ShapeGradient {
    loss: Loss,
    by_parameter: Vec<f32>,
}

impl Training {
    /// Starts from initial weights; one thread until [`Training::with_threads`] says otherwise.
    ///
    /// # Errors
    /// If a setting is out of its range or no thread can be started.
    pub fn new(net: &NetConfig, settings: &TrainSettings, backend: Backend) -> Result<Self, TrainError> {
        let model = Model::init(net, settings.train.seed, backend)?;
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
        let decays = parameters::shapes(model.network())
            .iter()
            .flat_map(|shape| std::iter::repeat_n(shape.dims.len() > 1, shape.len()))
            .collect();
        let values = model.values();
        let workers = vec![one_thread_pool()?];
        Ok(Self { settings: settings.clone(), model, values, adam, n_done, decays, workers })
    }

    /// Lets `n_threads` shapes of a batch be computed at once. The result is the same, byte for byte.
    ///
    /// # Errors
    /// If the threads cannot be started.
    pub fn with_threads(mut self, n_threads: usize) -> Result<Self, TrainError> {
        self.workers = (0..n_threads.max(1)).map(|_| one_thread_pool()).collect::<Result<_, _>>()?;
        Ok(self)
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

    /// What the training was started with.
    #[must_use]
    pub fn settings(&self) -> &TrainSettings {
        &self.settings
    }

    /// Makes one update from the next shapes of the seeded order.
    ///
    /// `shapes` must be the same at each call: the order is one of their indices.
    ///
    /// # Errors
    /// If a shape is unusable or the numbers stop being finite; the weights stay as they were.
    pub fn step(&mut self, shapes: &[TrainShape]) -> Result<StepReport, TrainError> {
        if shapes.is_empty() {
            return Err(TrainError::NoShapes);
        }
        let chosen = self.next_batch(shapes);
        let results: Vec<ShapeGradient> = self.in_parallel(&chosen)?.into_iter().flatten().collect();
        let mut gradient = mean_gradient(&results, self.values.len());
        let grad_norm = clip(&mut gradient, self.settings.optim.clip_norm);
        let learning_rate = self.update(&gradient);
        let mean = |term: fn(&Loss) -> f64| {
            results.iter().map(|result| term(&result.loss)).sum::<f64>() / results.len().max(1) as f64
        };
        Ok(StepReport {
            step: self.n_done,
            loss: mean(|loss| loss.total),
            pull: mean(|loss| loss.pull),
            push: mean(|loss| loss.push),
            ce: mean(|loss| loss.ce),
            learning_rate,
            grad_norm,
            n_without_loss: chosen.len() - results.len(),
            shapes: chosen.into_iter().map(|shape| shape.id.clone()).collect(),
        })
    }

    fn next_batch<'a>(&self, shapes: &'a [TrainShape]) -> Vec<&'a TrainShape> {
        let train = &self.settings.train;
        let indices = batch(train.seed, shapes.len(), train.batch_shapes, self.n_done);
        indices.into_iter().map(|idx| &shapes[idx]).collect()
    }

    /// Moves the weights against the gradient and counts the update; returns its learning rate.
    fn update(&mut self, gradient: &[f32]) -> f64 {
        let optim = &self.settings.optim;
        let learning_rate = learning_rate(optim, self.n_done, self.settings.train.steps);
        let update = Update { learning_rate, weight_decay: optim.weight_decay, n_before: self.n_done };
        self.adam.update(&mut self.values, gradient, &self.decays, &update);
        self.model = self.model.clone().with_values(&self.values);
        self.n_done += 1;
        learning_rate
    }

    /// Gradients of the shapes in their order, computed by all workers; the first error in that order wins.
    fn in_parallel(&self, chosen: &[&TrainShape]) -> Result<Vec<Option<ShapeGradient>>, TrainError> {
        let n_workers = self.workers.len();
        let mut results = Vec::new();
        results.resize_with(chosen.len(), || Ok(None));
        std::thread::scope(|scope| {
            let mut slots: Vec<Vec<_>> = (0..n_workers).map(|_| Vec::new()).collect();
            for (at, job) in chosen.iter().zip(&mut results).enumerate() {
                slots[at % n_workers].push(job);
            }
            for (worker, jobs) in self.workers.iter().zip(slots) {
                scope.spawn(move || {
                    worker.install(|| {
                        for (shape, result) in jobs {
                            *result = self.shape_gradient(shape);
                        }
                    });
                });
            }
        });
        results.into_iter().collect()
    }

    fn shape_gradient(&self, shape: &TrainShape) -> Result<Option<ShapeGradient>, TrainError> {
        let (n_points, n_labels) = (shape.sample.points.len(), shape.labels.len());
        if n_points != n_labels {
            return Err(TrainError::Labels { shape: shape.id.clone(), n_labels, n_points });
        }
        let config = self.model.config();
        let rng = &mut keyed_rng(self.settings.train.seed, &["augment", &shape.id, &self.n_done.to_string()]);
        let pose = Pose::random(&self.settings.augment, rng);
        let turns = shuffled_turns(n_levels(config), rng);
        let mut tokens = tokenize_posed(&shape.sample, self.settings.tokens.train_tokens, &pose)
            .map_err(|problem| self.bad_tokens(shape, problem))?;
        jitter(&mut tokens, &self.settings.augment, rng);
        let labels = tokens.majority_labels(&shape.labels);

        let device = device_of(self.model.backend());
        let network = self.model.network().clone().train();
        let z = network.forward(&prepare(config, &tokens, &turns), &device.autodiff());
        let host: Vec<f64> = parameters::host_values(z.clone()).into_iter().map(f64::from).collect();
        let Some(loss) = cosdisc(&host, config.embedding_dim, &labels, &self.settings.loss) else { return Ok(None) };
        let by_parameter = backward(&network, z, &loss.gradient);
        let is_finite = loss.total.is_finite() && by_parameter.iter().all(|g| g.is_finite());
        if is_finite { Ok(Some(ShapeGradient { loss, by_parameter })) } else { Err(self.non_finite(shape)) }
    }

    fn bad_tokens(&self, shape: &TrainShape, problem: TokenizeError) -> TrainError {
        match problem {
            TokenizeError::NotFinite { .. } => self.non_finite(shape),
            _ => TrainError::Tokens { shape: shape.id.clone(), problem },
        }
    }

    fn non_finite(&self, shape: &TrainShape) -> TrainError {
        TrainError::NonFinite { shape: shape.id.clone(), step: self.n_done + 1 }
    }
}

/// Takes ∂L/∂z back to the parameters: the sum of z · constant has exactly that gradient, on every backend.
fn backward(network: &crate::network::Network, z: Tensor<2>, gradient: &[f64]) -> Vec<f32> {
    let values: Vec<f32> = gradient.iter().map(|&g| g as f32).collect();
    let constant = Tensor::from_data(TensorData::new(values, z.dims()), &z.device());
    let mut gradients = (z * constant).sum().backward();
    parameters::gradients(network, &mut gradients)
}

fn mean_gradient(results: &[ShapeGradient], n_parameters: usize) -> Vec<f32> {
    let mut sum = vec![0.0f32; n_parameters];
    for result in results {
        for (total, g) in sum.iter_mut().zip(&result.by_parameter) {
            *total += g;
        }
    }
    let share = 1.0 / results.len().max(1) as f32;
    sum.iter_mut().for_each(|g| *g *= share);
    sum
}

#[cfg(test)]
mod tests;
