//! Implements Adam without weight decay (Kingma and Ba 2015). Its step decreases along a half cosine.

/// The state of Adam: the running means of the gradient and of its squares.
#[derive(Clone, Debug)]
pub(super) struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
    n_updates: i32,
}

/// The decay of the two running means.
const BETA: [f32; 2] = [0.9, 0.999];
/// A small number that prevents a division by 0.
const EPSILON: f32 = 1e-8;

impl Adam {
    pub(super) fn new(n_parameters: usize) -> Self {
        Self {
            first: vec![0.0; n_parameters],
            second: vec![0.0; n_parameters],
            n_updates: 0,
        }
    }

    pub(super) fn update(&mut self, parameters: &mut [f32], gradient: &[f32], learning_rate: f64) {
        self.n_updates += 1;
        let unbiased = |beta: f32| 1.0 - f64::from(beta).powi(self.n_updates);
        let rate = (learning_rate / unbiased(BETA[0])) as f32;
        let scale = unbiased(BETA[1]).sqrt().recip() as f32;
        let state = self.first.iter_mut().zip(&mut self.second);
        for ((parameter, &g), (first, second)) in parameters.iter_mut().zip(gradient).zip(state) {
            *first += (1.0 - BETA[0]) * (g - *first);
            *second += (1.0 - BETA[1]) * (g * g - *second);
            *parameter -= rate * *first / (second.sqrt() * scale + EPSILON);
        }
    }
}

/// The step of the update `index` of `n`.
pub(super) fn learning_rate(first: f64, last: f64, index: usize, n: usize) -> f64 {
    let done = index as f64 / n.saturating_sub(1).max(1) as f64;
    last + 0.5 * (first - last) * (1.0 + libm::cos(std::f64::consts::PI * done))
}

/// Scales a gradient down to a norm. A value of 0 means no limit.
pub(super) fn clip(gradient: &mut [f32], most: f64) {
    let norm = gradient
        .iter()
        .map(|&g| f64::from(g) * f64::from(g))
        .sum::<f64>()
        .sqrt();
    if most > 0.0 && norm > most {
        let scale = (most / norm) as f32;
        gradient.iter_mut().for_each(|g| *g *= scale);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_steps_are_as_long_as_the_learning_rate() {
        let (mut adam, mut parameters) = (Adam::new(2), vec![1.0, 1.0]);
        adam.update(&mut parameters, &[1e-3, -50.0], 0.01);
        assert!((parameters[0] - 0.99).abs() < 1e-5 && (parameters[1] - 1.01).abs() < 1e-5);
    }

    #[test]
    fn it_finds_the_minimum_of_a_parabola() {
        let (mut adam, mut x) = (Adam::new(1), vec![3.0f32]);
        for index in 0..400 {
            let gradient = [2.0 * (x[0] - 1.0)];
            adam.update(&mut x, &gradient, learning_rate(0.1, 1e-4, index, 400));
        }
        assert!((x[0] - 1.0).abs() < 1e-3, "{x:?}");
    }

    #[test]
    fn steps_fall_from_the_first_to_the_last() {
        assert_eq!(learning_rate(1.0, 0.1, 0, 11), 1.0);
        assert!((learning_rate(1.0, 0.1, 10, 11) - 0.1).abs() < 1e-12);
        assert!((learning_rate(1.0, 0.0, 5, 11) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn long_gradients_are_scaled_and_short_ones_are_not() {
        let mut gradient = vec![3.0, 4.0];
        clip(&mut gradient, 1.0);
        assert!((gradient[0] - 0.6).abs() < 1e-6);
        for most in [0.0, 5.0] {
            let mut gradient = vec![3.0, 4.0];
            clip(&mut gradient, most);
            assert_eq!(gradient, [3.0, 4.0]);
        }
    }
}
