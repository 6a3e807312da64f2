//! Computes the losses of mode `oracle-sdf`: exact signed distances.
//!
//! Distances are in units of the longest side of the shape: half the output of the network.

use super::batch::Block;
use super::losses::{eikonal, normal, sign};
use super::task::{Shared, Task};

/// Larger distances than this are not fitted: only their sign counts. It is in units of the longest side.
const CLAMP: f32 = 0.1;

impl Task {
    /// The losses at the surface: the distance should be 0, the gradient should be the normal, and its length should be 1.
    pub(super) fn oracle_surface(&mut self, block: &Block, shared: &Shared<'_>) -> bool {
        let (work, factors) = (&mut self.main, &shared.factors);
        work.gradient(shared.network);
        work.by_gradient.fill(0.0);
        let rows = work
            .gradients
            .chunks_exact(3)
            .zip(work.by_gradient.chunks_exact_mut(3));
        let outputs = work.outputs.iter().zip(&mut work.by_output);
        for (((gradient, by_gradient), (&output, by_output)), &point) in
            rows.zip(outputs).zip(&block.points)
        {
            *by_output = 0.5 * factors.surface as f32 * sign(output);
            let expected = &shared.pools.surface.normals[point as usize];
            self.losses.surface += f64::from(0.5 * output.abs()) * factors.means.surface;
            self.losses.normal +=
                normal(gradient, expected, by_gradient, factors.normal) * factors.means.surface;
            self.losses.eikonal +=
                eikonal(gradient, by_gradient, factors.eikonal) * factors.means.eikonal;
        }
        true
    }

    /// The loss near the surface: the distance should be that of the mesh.
    pub(super) fn oracle_near(&mut self, block: &Block, shared: &Shared<'_>) -> bool {
        self.fit_distances(&shared.pools.near.distances, block, shared);
        false
    }

    /// The losses in the box: the distance should be that of the mesh, and the length of its gradient should be 1.
    pub(super) fn oracle_uniform(&mut self, block: &Block, shared: &Shared<'_>) -> bool {
        self.fit_distances(&shared.pools.uniform.distances, block, shared);
        self.add_eikonal(shared);
        true
    }

    fn fit_distances(&mut self, distances: &[f32], block: &Block, shared: &Shared<'_>) {
        let factors = &shared.factors;
        let outputs = self.main.outputs.iter().zip(&mut self.main.by_output);
        for ((&output, by_output), &point) in outputs.zip(&block.points) {
            let excess = beyond(0.5 * output, 0.5 * distances[point as usize]);
            *by_output = 0.5 * factors.off_surface as f32 * sign(excess);
            self.losses.off_surface += f64::from(excess.abs()) * factors.means.off_surface;
        }
    }
}

/// The difference between a distance and the exact one. If the exact one is beyond the clamp, any distance beyond the clamp on
/// the same side is correct. (If both were clamped, a network that is far off on the wrong side would get no gradient.)
fn beyond(found: f32, exact: f32) -> f32 {
    if exact >= CLAMP {
        (found - CLAMP).min(0.0)
    } else if exact <= -CLAMP {
        (found + CLAMP).max(0.0)
    } else {
        found - exact
    }
}

#[cfg(test)]
mod tests {
    use super::beyond;

    #[test]
    fn far_away_only_the_side_counts() {
        for (found, exact, expected) in [
            (0.05, 0.02, 0.03),
            (0.5, 0.3, 0.0),
            (0.05, 0.3, -0.05),
            (-0.4, 0.3, -0.5),
            (-0.5, -0.3, 0.0),
            (0.5, 0.05, 0.45),
            (0.0, -0.2, 0.1),
        ] {
            assert!(
                (beyond(found, exact) - expected).abs() < 1e-6,
                "{found} {exact}"
            );
        }
    }
}
