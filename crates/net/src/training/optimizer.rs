//! Moves the weights: AdamW (Loshchilov and Hutter, ICLR 2019), the clipping of gradients and the learning-rate schedule,
//! on plain vectors.
//!
//! The state is two vectors and a count. A checkpoint contains all of it, so a resumed training is exact. The ε of 1e-8 and the
//! decay rates 0.9 and 0.999 of the moments are those of PyTorch. burn's AdamW has another ε.

use crate::config::{OptimConfig, ScheduleConfig, TrainSettings};
use crate::model::parameters::ParameterShape;

const FIRST_DECAY: f64 = 0.9;
const SECOND_DECAY: f64 = 0.999;
const EPSILON: f64 = 1e-8;

/// The running moments of the gradient.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AdamW {
    pub(crate) first: Vec<f32>,
    pub(crate) second: Vec<f32>,
}

/// The parameters of one tensor. An update treats them alike.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Group {
    /// The number of parameters.
    pub(crate) len: usize,
    /// Whether weight decay applies to them. It applies to matrices, but not to biases and norms.
    pub(crate) decays: bool,
    /// Their learning rate, as a multiple of the learning rate of the step. With 0 they do not change.
    pub(crate) rate: f64,
}

impl Group {
    /// One group per tensor with these names and shapes.
    pub(crate) fn of_tensors(shapes: &[ParameterShape], settings: &TrainSettings) -> Vec<Self> {
        let group = |shape: &ParameterShape| {
            let rate = if settings.train.freezes(&shape.name) {
                0.0
            } else if shape.name.contains(".blocks.") {
                settings.optim.block_lr_factor
            } else {
                1.0
            };
            Self {
                len: shape.len(),
                decays: shape.dims.len() > 1,
                rate,
            }
        };
        shapes.iter().map(group).collect()
    }
}

/// Numbers of one update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Update {
    /// The learning rate of this step.
    pub(crate) learning_rate: f64,
    /// The fraction that weight decay removes from a parameter at a learning rate of 1.
    pub(crate) weight_decay: f64,
    /// The number of previous updates.
    pub(crate) n_before: usize,
}

impl AdamW {
    pub(crate) fn new(n_parameters: usize) -> Self {
        Self {
            first: vec![0.0; n_parameters],
            second: vec![0.0; n_parameters],
        }
    }

    /// Moves `values` against `gradient`, each group in its own way.
    pub(crate) fn update(
        &mut self,
        values: &mut [f32],
        gradient: &[f32],
        groups: &[Group],
        update: &Update,
    ) {
        let mut first = 0;
        for group in groups {
            let own = first..first + group.len;
            let moments = (&mut self.first[own.clone()], &mut self.second[own.clone()]);
            update_group(
                &mut values[own.clone()],
                &gradient[own.clone()],
                moments,
                group,
                update,
            );
            first = own.end;
        }
    }

    /// The indices of the groups whose gradients have always been 0.
    pub(crate) fn untouched(&self, groups: &[Group]) -> Vec<usize> {
        let mut rest = self.second.as_slice();
        let is_untouched = |group: &Group| {
            let (own, after) = rest.split_at(group.len.min(rest.len()));
            rest = after;
            own.iter().all(|&square| square == 0.0)
        };
        let flags: Vec<bool> = groups.iter().map(is_untouched).collect();
        (0..groups.len()).filter(|&idx| flags[idx]).collect()
    }
}

fn update_group(
    values: &mut [f32],
    gradient: &[f32],
    (first, second): (&mut [f32], &mut [f32]),
    group: &Group,
    update: &Update,
) {
    let count = update.n_before as i32 + 1;
    let first_scale = 1.0 / (1.0 - FIRST_DECAY.powi(count));
    let second_scale = 1.0 / (1.0 - SECOND_DECAY.powi(count));
    let learning_rate = update.learning_rate * group.rate;
    let kept = if group.decays {
        1.0 - learning_rate * update.weight_decay
    } else {
        1.0
    };
    for ((value, &g), (first, second)) in values
        .iter_mut()
        .zip(gradient)
        .zip(first.iter_mut().zip(second))
    {
        let g = f64::from(g);
        let mean = FIRST_DECAY * f64::from(*first) + (1.0 - FIRST_DECAY) * g;
        let square = SECOND_DECAY * f64::from(*second) + (1.0 - SECOND_DECAY) * g * g;
        let step = mean * first_scale / ((square * second_scale).sqrt() + EPSILON);
        *value = (f64::from(*value) * kept - learning_rate * step) as f32;
        (*first, *second) = (mean as f32, square as f32);
    }
}

/// Scales a gradient down to `max_norm` and returns its Euclidean norm before that.
pub(crate) fn clip(gradient: &mut [f32], max_norm: f64) -> f64 {
    let norm = gradient
        .iter()
        .map(|&g| f64::from(g).powi(2))
        .sum::<f64>()
        .sqrt();
    if norm > max_norm {
        let factor = (max_norm / norm) as f32;
        gradient.iter_mut().for_each(|g| *g *= factor);
    }
    norm
}

/// The learning rate of the step with this index, of `n_steps`.
///
/// `OneCycle` is the schedule of Smith and Topin ("Super-convergence", 2019) with half cosines, as in PyTorch.
pub(crate) fn learning_rate(config: &OptimConfig, step: usize, n_steps: usize) -> f64 {
    let highest = config.learning_rate;
    match &config.schedule {
        ScheduleConfig::Constant => highest,
        ScheduleConfig::Trapezoid {
            warmup_steps,
            cooldown_steps,
        } => {
            let share_of =
                |steps: usize, length: &usize| (steps as f64 / (*length as f64 + 1.0)).min(1.0);
            let up = share_of(step + 1, warmup_steps);
            let down = share_of(n_steps.saturating_sub(step), cooldown_steps);
            highest * up.min(down)
        }
        ScheduleConfig::Cosine {
            warmup_fraction,
            final_fraction,
        } => {
            let (step, warmup) = (step as f64, (warmup_fraction * n_steps as f64).floor());
            let end = (n_steps as f64 - 1.0).max(warmup + 1.0);
            if step < warmup {
                highest * (step + 1.0) / (warmup + 1.0)
            } else {
                half_cosine(
                    highest,
                    highest * final_fraction,
                    ((step - warmup) / (end - warmup)).min(1.0),
                )
            }
        }
        ScheduleConfig::OneCycle {
            warmup_fraction,
            div,
            final_div,
        } => {
            let (first, last) = (highest / div, highest / div / final_div);
            let end = n_steps.saturating_sub(1) as f64;
            let peak = (warmup_fraction * n_steps as f64 - 1.0).max(0.0);
            let step = step as f64;
            if step < peak {
                half_cosine(first, highest, step / peak)
            } else if end > peak {
                half_cosine(highest, last, ((step - peak) / (end - peak)).min(1.0))
            } else {
                highest
            }
        }
    }
}

impl TrainSettings {
    /// The index of the first of `n_steps` steps that has another learning rate in `other`.
    #[must_use]
    pub fn first_other_rate(&self, other: &Self, n_steps: usize) -> Option<usize> {
        let rate = |of: &Self, step| learning_rate(&of.optim, step, of.train.steps).to_bits();
        (0..n_steps).find(|&step| rate(self, step) != rate(other, step))
    }
}

/// A smooth function of `share` from `from` at 0 to `to` at 1.
fn half_cosine(from: f64, to: f64, share: f64) -> f64 {
    to + (from - to) * 0.5 * (1.0 + (std::f64::consts::PI * share).cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config() -> OptimConfig {
        let schedule = ScheduleConfig::OneCycle {
            warmup_fraction: 0.1,
            div: 10.0,
            final_div: 100.0,
        };
        OptimConfig {
            learning_rate: 1e-3,
            weight_decay: 0.0,
            block_lr_factor: 1.0,
            clip_norm: 1.0,
            schedule,
        }
    }

    fn group(len: usize, decays: bool) -> Group {
        Group {
            len,
            decays,
            rate: 1.0,
        }
    }

    #[test]
    fn a_cosine_warms_up_linearly_and_ends_at_the_given_rate() {
        let schedule = ScheduleConfig::Cosine {
            warmup_fraction: 0.1,
            final_fraction: 0.2,
        };
        let cosine = OptimConfig {
            schedule,
            ..config()
        };
        let at = |step| learning_rate(&cosine, step, 100);
        assert!((0..10).all(|step| (at(step) - 1e-3 * (step as f64 + 1.0) / 11.0).abs() < 1e-12));
        assert_eq!(at(10), 1e-3);
        assert!((10..99).all(|step| at(step + 1) < at(step)));
        assert!((at(99) - 2e-4).abs() < 1e-12);
        assert_eq!(learning_rate(&cosine, 0, 1), 1e-3);
    }

    #[test]
    fn groups_have_their_own_rates_and_untouched_ones_are_known() {
        let mut adam = AdamW::new(3);
        let slow = Group {
            rate: 0.1,
            ..group(1, true)
        };
        let groups = [group(1, false), slow, group(1, false)];
        let (mut values, gradient) = (vec![1.0; 3], [1.0, 1.0, 0.0]);
        let update = Update {
            learning_rate: 0.1,
            weight_decay: 0.5,
            n_before: 0,
        };
        adam.update(&mut values, &gradient, &groups, &update);
        for (value, expected) in values.iter().zip([0.9, 0.985, 1.0]) {
            assert!((value - expected).abs() < 1e-6, "{values:?}");
        }
        assert_eq!(adam.untouched(&groups), [2]);
    }

    #[test]
    fn one_cycle_starts_low_peaks_after_the_warm_up_and_ends_lowest() {
        let at = |step| learning_rate(&config(), step, 100);
        assert!((at(0) - 1e-4).abs() < 1e-12);
        assert!((at(9) - 1e-3).abs() < 1e-12);
        assert!((at(99) - 1e-6).abs() < 1e-12);
        assert!((10..99).all(|step| at(step + 1) < at(step)));
        assert_eq!(learning_rate(&config(), 0, 1), 1e-3);
        let constant = OptimConfig {
            schedule: ScheduleConfig::Constant,
            ..config()
        };
        assert_eq!(learning_rate(&constant, 50, 100), 1e-3);
    }

    #[test]
    fn the_first_update_has_the_size_of_the_learning_rate_and_only_some_values_decay() {
        let mut adam = AdamW::new(3);
        let mut values = vec![1.0, 1.0, 1.0];
        let update = Update {
            learning_rate: 0.1,
            weight_decay: 0.5,
            n_before: 0,
        };
        adam.update(
            &mut values,
            &[4.0, -0.01, 0.0],
            &[group(1, false), group(2, true)],
            &update,
        );
        let expected = [0.9, 1.05, 0.95];
        for (value, expected) in values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-6, "{values:?}");
        }
    }

    #[test]
    fn repeated_updates_find_the_minimum_of_a_bowl() {
        let mut adam = AdamW::new(2);
        let mut values = vec![3.0, -2.0];
        for n_before in 0..2000 {
            let gradient = [2.0 * (values[0] - 1.0), 20.0 * (values[1] - 0.5)];
            let update = Update {
                learning_rate: 0.01,
                weight_decay: 0.0,
                n_before,
            };
            adam.update(&mut values, &gradient, &[group(2, true)], &update);
        }
        assert!(
            (values[0] - 1.0).abs() < 1e-2 && (values[1] - 0.5).abs() < 1e-2,
            "{values:?}"
        );
    }

    #[test]
    fn clipping_keeps_the_direction() {
        let mut gradient = vec![3.0, 4.0];
        assert_eq!(clip(&mut gradient, 10.0), 5.0);
        assert_eq!(gradient, [3.0, 4.0]);
        assert_eq!(clip(&mut gradient, 1.0), 5.0);
        assert!((gradient[0] - 0.6).abs() < 1e-6 && (gradient[1] - 0.8).abs() < 1e-6);
    }
}
