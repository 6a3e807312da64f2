//! Rotates queries and keys by the positions of their tokens (rotary encoding, Su et al., 2021), in one forward and one backward
//! pass.
//!
//! A pair of channels (u, v) and an angle θ give (u·cos θ − v·sin θ, v·cos θ + u·sin θ). The product of a query and a key then
//! depends only on the difference of their positions. Values do not change.

use super::{Flexible, flexible, record, slice, tensor_of};
use crate::kernels::rotary_axes::{Pair, RotaryAxes};
use burn::tensor::Tensor;

/// Rotated queries and keys, and unchanged values. Returns `None` if the tensors are not of the flex backend.
///
/// # Shapes
/// - qkv and output: `[token, 3 × head × channel]`
/// - coordinates: `[token, head × 3]`
pub(crate) fn rotary(
    qkv: &Tensor<2>,
    coordinates: &Tensor<2>,
    axes: RotaryAxes,
) -> Option<Tensor<2>> {
    let ([n, width], [_, n_coordinates]) = (qkv.dims(), coordinates.dims());
    let inputs = [flexible(qkv)?, flexible(coordinates)?];
    let [x, at] = inputs.each_ref().map(Flexible::values);
    let turns = Turns::new(slice(&at), n, axes);

    let mut y = slice(&x).to_vec();
    turns.for_each(|_, [first, second], [cos, sin]| {
        let (u, v) = (y[first], y[second]);
        (y[first], y[second]) = (u * cos - v * sin, v * cos + u * sin);
    });
    let turned = y.clone();

    record(
        inputs,
        tensor_of(y, [n, width]),
        move |by_output, [_, wants_coordinates]| {
            let mut by_qkv = slice(by_output).to_vec();
            let mut by_coordinates = vec![0.0; n * n_coordinates];
            turns.for_each(|turn, [first, second], [cos, sin]| {
                let (g_first, g_second) = (by_qkv[first], by_qkv[second]);
                if wants_coordinates {
                    let by_angle = g_second * turned[first] - g_first * turned[second];
                    by_coordinates[turn.coordinate] += turn.frequency * by_angle;
                }
                by_qkv[first] = g_first * cos + g_second * sin;
                by_qkv[second] = g_second * cos - g_first * sin;
            });
            [
                tensor_of(by_qkv, [n, width]),
                tensor_of(by_coordinates, [n, n_coordinates]),
            ]
        },
    )
}

/// The coordinate by which a pair of channels is rotated, and its frequency.
#[derive(Clone, Copy)]
struct Turn {
    /// The index in the row-major matrix of coordinates.
    coordinate: usize,
    frequency: f32,
}

/// The angles of all pairs of all heads and tokens.
struct Turns {
    n: usize,
    axes: RotaryAxes,
    pairs: Vec<Pair>,
    /// Cosine and sine: `[token, head, pair]`.
    cos_sin: Vec<[f32; 2]>,
}

impl Turns {
    fn new(coordinates: &[f32], n: usize, axes: RotaryAxes) -> Self {
        let pairs = axes.pairs();
        let of_pair = |at: &[f32], pair: &Pair| {
            // The sine is computed in f64, so that the last bit of the result does not depend on the implementation of the sine.
            let (sin, cos) = (f64::from(at[pair.axis]) * f64::from(pair.frequency)).sin_cos();
            [cos as f32, sin as f32]
        };
        let cos_sin = coordinates
            .chunks_exact(3)
            .flat_map(|at| pairs.iter().map(move |pair| of_pair(at, pair)))
            .collect();
        Self {
            n,
            axes,
            pairs,
            cos_sin,
        }
    }

    /// Visits each pair of channels of the queries, then of the keys, with its turn, the indices of its channels in the row-major
    /// qkv, and cosine and sine.
    fn for_each(&self, mut visit: impl FnMut(Turn, [usize; 2], [f32; 2])) {
        let (width, head_dim) = (self.axes.width(), self.axes.head_dim);
        for token in 0..self.n {
            for third in 0..2 {
                for head in 0..self.axes.n_heads {
                    let slot = token * self.axes.n_heads + head;
                    let start = (3 * token + third) * width + head * head_dim;
                    let angles = &self.cos_sin[slot * self.pairs.len()..];
                    for (pair, &cos_sin) in self.pairs.iter().zip(angles) {
                        let turn = Turn {
                            coordinate: 3 * slot + pair.axis,
                            frequency: pair.frequency,
                        };
                        visit(turn, [start + pair.first, start + pair.second], cos_sin);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check, input};
    use super::*;
    use crate::kernels::ops::composed_rotary;
    use crate::model::parameters::host_values;
    use burn::tensor::{Device, TensorData};

    #[test]
    fn fused_and_composed_agree() {
        for (n, n_heads, head_dim) in [(1, 1, 6), (5, 2, 16), (33, 3, 18), (7, 1, 7)] {
            let axes = RotaryAxes {
                n_heads,
                head_dim,
                base: 100.0,
            };
            check(
                &[
                    input([n, 3 * axes.width()], "qkv"),
                    input([n, 3 * n_heads], "coordinates"),
                ],
                |[qkv, at]| rotary(&qkv, &at, axes).unwrap(),
                |[qkv, at]| composed_rotary(qkv, at, axes),
            );
        }
    }

    #[test]
    fn products_of_queries_and_keys_depend_on_differences_of_positions_only() {
        let axes = RotaryAxes {
            n_heads: 1,
            head_dim: 18,
            base: 100.0,
        };
        let row: Vec<f32> = (0..54)
            .map(|i| ((i * 37 % 101) as f32 - 50.0) / 50.0)
            .collect();
        let products = |shift: f32| {
            let qkv = TensorData::new([row.clone(), row.clone()].concat(), [2, 54]);
            let at = [1.0, 2.0, 3.0, 4.0, 0.0, 7.0].map(|x| x + shift).to_vec();
            let turned = rotary(
                &Tensor::from_data(qkv, &Device::flex()),
                &Tensor::from_data(TensorData::new(at, [2, 3]), &Device::flex()),
                axes,
            );
            let values = host_values(turned.unwrap());
            let product: f32 = (0..18).map(|i| values[i] * values[54 + 18 + i]).sum();
            product
        };
        assert!((products(0.0) - products(11.0)).abs() < 1e-4);
        assert!(
            (products(0.0)
                - row[..18]
                    .iter()
                    .zip(&row[18..])
                    .map(|(a, b)| a * b)
                    .sum::<f32>())
            .abs()
                > 0.1
        );
    }
}
