//! Computes the losses of mode `flatcad` (Yin et al., "FlatCAD", 2025, with the weights of its published code).
//!
//! Distances are those of the frame, in which the longest side is 2. The published code divides by the largest coordinate after
//! centering at the mean of the points, which is nearly the same.

use super::batch::Block;
use super::losses::{eikonal, length_of, sign};
use super::task::{Shared, Task};
use crate::network::{BLOCK, BackwardParts};

/// The step of the differences.
const STEP: f32 = 0.05;
/// The rate at which the penalty on small distances decreases away from the surface.
const DECAY: f32 = 100.0;
/// The signs of the four points around a point, along the two tangents.
const CORNERS: [[f32; 2]; 4] = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];

/// The weight of the off-diagonal loss: first constant, then decreasing, and 0 at the end.
pub(super) fn off_diagonal_weight(done: f64) -> f64 {
    const LEVELS: [(f64, f64); 4] = [(0.0, 10.0), (0.2, 10.0), (0.5, 0.001), (1.0, 0.0)];
    let after = LEVELS
        .iter()
        .position(|level| done < level.0)
        .unwrap_or(LEVELS.len() - 1);
    let [(from, high), (to, low)] = [LEVELS[after.max(1) - 1], LEVELS[after.max(1)]];
    high + (low - high) * ((done - from) / (to - from)).clamp(0.0, 1.0)
}

impl Task {
    /// The losses at the surface: the distance should be 0.
    pub(super) fn flatcad_surface(&mut self, shared: &Shared<'_>) -> bool {
        let factors = &shared.factors;
        for (&output, by_output) in self.main.outputs.iter().zip(&mut self.main.by_output) {
            *by_output = factors.surface as f32 * sign(output);
            self.losses.surface += f64::from(output.abs()) * factors.means.surface;
        }
        false
    }

    /// The losses away from the surface: the distance should not be 0, and its gradient should have the length 1.
    pub(super) fn flatcad_uniform(&mut self, shared: &Shared<'_>) -> bool {
        let (work, factors) = (&mut self.main, &shared.factors);
        for (&output, by_output) in work.outputs.iter().zip(&mut work.by_output) {
            let penalty = libm::expf(-DECAY * output.abs());
            *by_output = -DECAY * factors.off_surface as f32 * penalty * sign(output);
            self.losses.off_surface += f64::from(penalty) * factors.means.off_surface;
        }
        self.add_eikonal(shared);
        true
    }

    /// The losses near the surface: the gradient should have the length 1, and for two random orthogonal tangents u and v, the
    /// mixed second derivative uᵀHv should be 0. It is a difference of four values, and the tangents are treated as constants.
    pub(super) fn flatcad_near(&mut self, block: &Block, shared: &Shared<'_>) -> bool {
        self.main.by_output.fill(0.0);
        self.add_eikonal(shared);
        let factors = &shared.factors;
        let (Some(around), true) = (&mut self.around, factors.off_diagonal > 0.0) else {
            return true;
        };
        let (gradients, _) = self.main.gradients.as_chunks::<3>();
        let tangents: Vec<[[f32; 3]; 2]> = gradients
            .iter()
            .zip(&block.angles)
            .map(|(gradient, &angle)| tangents(gradient, angle))
            .collect();
        let (positions, _) = self.main.positions.as_chunks::<3>();
        let place = |corner: [f32; 2], targets: &mut [f32]| {
            let (targets, _) = targets.as_chunks_mut::<3>();
            for ((target, position), [u, v]) in targets.iter_mut().zip(positions).zip(&tangents) {
                *target = std::array::from_fn(|axis| {
                    position[axis] + STEP * (corner[0] * u[axis] + corner[1] * v[axis])
                });
            }
        };
        let mut mixed = [0.0f32; BLOCK];
        for corner in CORNERS {
            place(corner, &mut around.positions);
            around.forward(shared.network);
            for (mixed, output) in mixed.iter_mut().zip(&around.outputs) {
                *mixed += corner[0] * corner[1] * output / (4.0 * STEP * STEP);
            }
        }
        for corner in CORNERS {
            place(corner, &mut around.positions);
            around.forward(shared.network);
            let scale = corner[0] * corner[1] / (4.0 * STEP * STEP) * factors.off_diagonal as f32;
            for (by_output, &mixed) in around.by_output.iter_mut().zip(&mixed) {
                *by_output = scale * sign(mixed);
            }
            let parts = BackwardParts {
                has_head: false,
                has_gradient: false,
            };
            around.backward(shared.network, parts);
        }
        let total: f64 = mixed.iter().map(|&x| f64::from(x.abs())).sum();
        self.losses.off_diagonal += total * factors.means.near;
        true
    }

    /// The loss of both modes for the length of the gradient, which should be 1.
    pub(super) fn add_eikonal(&mut self, shared: &Shared<'_>) {
        let (work, factors) = (&mut self.main, &shared.factors);
        work.gradient(shared.network);
        work.by_gradient.fill(0.0);
        let rows = work
            .gradients
            .chunks_exact(3)
            .zip(work.by_gradient.chunks_exact_mut(3));
        for (gradient, by_gradient) in rows {
            self.losses.eikonal +=
                eikonal(gradient, by_gradient, factors.eikonal) * factors.means.eikonal;
        }
    }
}

/// Two orthonormal vectors that are orthogonal to a gradient, rotated by an angle.
fn tangents(gradient: &[f32; 3], angle: f32) -> [[f32; 3]; 2] {
    let length = length_of(gradient);
    let n = gradient.map(|x| x / length);
    // The axis that is farthest from the gradient gives the first tangent.
    let axis = if n[0].abs() <= n[1].abs() && n[0].abs() <= n[2].abs() {
        0
    } else if n[1].abs() <= n[2].abs() {
        1
    } else {
        2
    };
    let mut u: [f32; 3] = std::array::from_fn(|i| f32::from(u8::from(i == axis)) - n[axis] * n[i]);
    let length = length_of(&u);
    u = u.map(|x| x / length);
    let v = [
        n[1] * u[2] - n[2] * u[1],
        n[2] * u[0] - n[0] * u[2],
        n[0] * u[1] - n[1] * u[0],
    ];
    let [sine, cosine] = crate::kernels::sine_and_cosine(angle);
    [
        std::array::from_fn(|i| cosine * u[i] + sine * v[i]),
        std::array::from_fn(|i| cosine * v[i] - sine * u[i]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_are_orthonormal() {
        for gradient in [[0.0, 0.0, 2.0], [1.0, -3.0, 0.5], [0.7, 0.0, 0.0]] {
            let [u, v] = tangents(&gradient, 0.8);
            let dot = |a: &[f32; 3], b: &[f32; 3]| (0..3).map(|i| a[i] * b[i]).sum::<f32>();
            for (found, expected) in [
                (dot(&u, &u), 1.0),
                (dot(&v, &v), 1.0),
                (dot(&u, &v), 0.0),
                (dot(&u, &gradient), 0.0),
                (dot(&v, &gradient), 0.0),
            ] {
                assert!((found - expected).abs() < 1e-6, "{gradient:?}: {found}");
            }
        }
    }

    #[test]
    fn the_weight_falls_in_stages() {
        for (done, expected) in [
            (0.0, 10.0),
            (0.1, 10.0),
            (0.2, 10.0),
            (0.35, 5.0005),
            (0.5, 0.001),
            (0.75, 0.0005),
            (1.0, 0.0),
        ] {
            let found = off_diagonal_weight(done);
            assert!((found - expected).abs() < 1e-9, "{done}: {found}");
        }
    }
}
