//! Computes the activation functions of neurons, with their first and second derivatives.

use crate::kernels::{sigmoid_and_softplus, sine_and_cosine};

/// The function that a neuron applies to its weighted sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Activation {
    /// sin(30 a).
    Sine,
    /// ln(1 + e^(100 a)) / 100.
    Softplus,
}

/// The frequency of a sine (Sitzmann et al., "Implicit neural representations with periodic activation functions", 2020).
pub(crate) const FREQUENCY: f32 = 30.0;

/// The sharpness of softplus (Gropp et al., "Implicit geometric regularization for learning shapes", 2020).
const SHARPNESS: f32 = 100.0;

impl Activation {
    /// Values and slopes of the weighted sums `a`.
    #[inline(always)]
    pub(super) fn apply(self, a: &[f32], values: &mut [f32], slopes: &mut [f32]) {
        let all = a.iter().zip(values).zip(slopes);
        match self {
            Self::Sine => {
                for ((&a, value), slope) in all {
                    let [sine, cosine] = sine_and_cosine(FREQUENCY * a);
                    *value = sine;
                    *slope = FREQUENCY * cosine;
                }
            }
            Self::Softplus => {
                for ((&a, value), slope) in all {
                    let [sigmoid, softplus] = sigmoid_and_softplus(SHARPNESS * a);
                    *value = softplus / SHARPNESS;
                    *slope = sigmoid;
                }
            }
        }
    }

    /// `g ← r · g · φ″` and `r ← r · φ′`, from values and slopes.
    #[inline(always)]
    pub(super) fn bend(self, values: &[f32], slopes: &[f32], r: &mut [f32], g: &mut [f32]) {
        let all = values.iter().zip(slopes).zip(r).zip(g);
        match self {
            Self::Sine => {
                for (((&value, &slope), r), g) in all {
                    *g *= *r * (-FREQUENCY * FREQUENCY * value);
                    *r *= slope;
                }
            }
            Self::Softplus => {
                for (((_, &slope), r), g) in all {
                    *g *= *r * (SHARPNESS * slope * (1.0 - slope));
                    *r *= slope;
                }
            }
        }
    }
}
