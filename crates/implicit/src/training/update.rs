//! Makes the updates of a training.

use super::adam::{Adam, clip, learning_rate};
use super::batch::draw;
use super::flatcad::off_diagonal_weight;
use super::losses::{Factors, Losses, Means};
use super::settings::{Mode, Settings};
use super::task::{Shared, Task};
use crate::geometry::Pools;
use crate::network::{BLOCK, Network, PreparedNetwork};
use partprobe_carrier::{Rng, keyed_rng};
use rayon::prelude::*;

/// The number of tasks to which blocks are distributed, for any number of threads. Each task adds up its own blocks, and then the
/// sums are added in order.
const TASKS: usize = 16;

/// The label of each surface point of the pools, and the weight of each label.
#[derive(Clone, Debug, PartialEq)]
pub struct PointLabels {
    of_point: Vec<i32>,
    weights: Vec<f32>,
}

/// The reason why labels cannot be used for training.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LabelError {
    /// The number of labels differs from the number of surface points.
    #[error("{n_labels} labels for {n_points} surface points; give one per point")]
    Length {
        /// The number of labels.
        n_labels: usize,
        /// The number of points.
        n_points: usize,
    },
    /// No point has a label.
    #[error("no point of the surface has a label")]
    Nothing,
}

impl PointLabels {
    /// Labels are numbered from 0, and a negative number means no label. The weight of a label is n^(−1/2), where n is its number
    /// of points, normalized so that the mean weight of the labeled points is 1.
    ///
    /// # Errors
    /// If there is not one label per surface point, or no point has a label.
    pub fn new(of_point: Vec<i32>, pools: &Pools) -> Result<Self, LabelError> {
        let n_points = pools.surface.positions.len();
        if of_point.len() != n_points {
            return Err(LabelError::Length {
                n_labels: of_point.len(),
                n_points,
            });
        }
        let n_labels = of_point
            .iter()
            .max()
            .map_or(0, |&most| usize::try_from(most + 1).unwrap_or(0));
        let mut counts = vec![0usize; n_labels];
        for label in &of_point {
            if let Some(count) = usize::try_from(*label)
                .ok()
                .and_then(|label| counts.get_mut(label))
            {
                *count += 1;
            }
        }
        let n_labeled: usize = counts.iter().sum();
        if n_labeled == 0 {
            return Err(LabelError::Nothing);
        }
        // Σ n · n^(−1/2) over the labels.
        let total: f64 = counts.iter().map(|&n| (n as f64).sqrt()).sum();
        let weight = |&n: &usize| match n {
            0 => 0.0,
            n => (n_labeled as f64 / total / (n as f64).sqrt()) as f32,
        };
        Ok(Self {
            weights: counts.iter().map(weight).collect(),
            of_point,
        })
    }

    /// One more than the highest label.
    #[must_use]
    pub fn n_labels(&self) -> usize {
        self.weights.len()
    }

    pub(super) fn of_point(&self, point: u32) -> i32 {
        self.of_point[point as usize]
    }

    pub(super) fn weight(&self, label: i32) -> f32 {
        let weight = usize::try_from(label)
            .ok()
            .and_then(|label| self.weights.get(label));
        weight.copied().unwrap_or(0.0)
    }
}

/// A training in progress.
///
/// The same arguments give the same bytes for any number of threads. The initial weights of the trunk and the points of each
/// update depend on the seed and the key, and not on the labels.
#[derive(Debug)]
pub struct Training<'a> {
    pools: &'a Pools,
    labels: Option<&'a PointLabels>,
    settings: &'a Settings,
    network: Network,
    prepared: PreparedNetwork,
    tasks: Vec<Task>,
    gradient: Vec<f32>,
    adam: Adam,
    rng: Rng,
    n_updates: usize,
}

impl<'a> Training<'a> {
    /// Starts a training. Without labels, the network has no head: the control.
    #[must_use]
    pub fn new(
        pools: &'a Pools,
        labels: Option<&'a PointLabels>,
        settings: &'a Settings,
        seed: u64,
    ) -> Self {
        let n_labels = labels.map_or(0, PointLabels::n_labels);
        let network = Network::new(settings.trunk, n_labels, seed);
        let (prepared, layout) = (network.prepared(), network.layout());
        Self {
            pools,
            labels,
            settings,
            tasks: vec![Task::new(&layout, settings.mode); TASKS],
            gradient: vec![0.0; layout.n_parameters()],
            adam: Adam::new(layout.n_parameters()),
            rng: keyed_rng(seed, &["implicit", "points"]),
            network,
            prepared,
            n_updates: 0,
        }
    }

    /// The number of updates that were made.
    #[must_use]
    pub fn n_updates(&self) -> usize {
        self.n_updates
    }

    /// Makes one update on the threads of the current pool. Returns the losses before it.
    pub fn update(&mut self) -> Losses {
        let losses = self.add_up();
        let settings = self.settings;
        clip(&mut self.gradient, settings.clip_norm);
        let rate = learning_rate(
            settings.learning_rate,
            settings.final_learning_rate,
            self.n_updates,
            settings.iterations,
        );
        let (adam, gradient) = (&mut self.adam, &self.gradient);
        self.prepared
            .update(|parameters| adam.update(parameters, gradient, rate));
        self.n_updates += 1;
        losses
    }

    /// Ends the training. The network is the one after the last update.
    #[must_use]
    pub fn finish(mut self) -> Network {
        self.network.set_parameters(self.prepared.into_parameters());
        self.network
    }

    /// Computes the gradient of the loss on new points.
    fn add_up(&mut self) -> Losses {
        let with_angles = self.settings.mode == Mode::FlatCad;
        let blocks = draw(self.pools, self.settings.points, with_angles, &mut self.rng);
        let shared = Shared {
            network: &self.prepared,
            pools: self.pools,
            labels: self.labels,
            mode: self.settings.mode,
            seg_grad: self.settings.seg_grad,
            factors: self.factors(),
        };
        self.tasks
            .par_iter_mut()
            .enumerate()
            .for_each(|(index, task)| {
                task.reset();
                for block in blocks.iter().skip(index).step_by(TASKS) {
                    task.add(block, &shared);
                }
            });
        let mut losses = Losses::default();
        self.gradient.fill(0.0);
        for task in &self.tasks {
            losses += task.losses;
            let sums = std::iter::once(&task.main.sums)
                .chain(task.around.as_ref().map(|around| &around.sums));
            for sums in sums {
                for (total, x) in self.gradient.iter_mut().zip(sums) {
                    *total += x;
                }
            }
        }
        losses
    }

    fn factors(&self) -> Factors {
        let settings = self.settings;
        let [surface, near, uniform] = settings.points.map(|n| n.next_multiple_of(BLOCK) as f64);
        let one_over = |n: f64| if n > 0.0 { n.recip() } else { 0.0 };
        let (weights, n_off, n_eikonal) = match settings.mode {
            Mode::OracleSdf => (
                [50.0, 20.0, 1.0, 0.1, 0.0],
                near + uniform,
                surface + uniform,
            ),
            Mode::FlatCad => {
                let done = self.n_updates as f64 / settings.iterations.max(1) as f64;
                (
                    [7000.0, 600.0, 0.0, 50.0, off_diagonal_weight(done)],
                    uniform,
                    near + uniform,
                )
            }
        };
        let means = Means {
            surface: one_over(surface),
            off_surface: one_over(n_off),
            eikonal: one_over(n_eikonal),
            near: one_over(near),
        };
        Factors {
            surface: weights[0] * means.surface,
            off_surface: weights[1] * means.off_surface,
            normal: weights[2] * means.surface,
            eikonal: weights[3] * means.eikonal,
            off_diagonal: weights[4] * means.near,
            segmentation: settings.segmentation_weight * means.surface,
            means,
        }
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
