//! Draws random poses of a shape for training, from a generator that is keyed by seed, shape and step.
//!
//! Backbones that are trained with the same seed see the same poses in the same order, with any supervision.

use crate::config::AugmentConfig;
use partprobe_carrier::{Rng, rotation_of_quaternion, unit_interval};
use rand::Rng as _;

/// A rotation or reflection with a scale. It is applied to a shape in the unit sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    /// An orthogonal matrix. Its rows are the new axes.
    rotation: [[f64; 3]; 3],
    scale: f64,
}

impl Pose {
    /// The pose that does not change a shape.
    pub(crate) const IDENTITY: Self = Self {
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        scale: 1.0,
    };

    /// Draws a pose. It draws the same number of random numbers with any settings, so switching one change off does not affect
    /// the others.
    pub(crate) fn random(config: &AugmentConfig, rng: &mut Rng) -> Self {
        let axes = axis_rotation(rng.next_u64());
        let free = free_rotation([(); 3].map(|()| unit_interval(rng)));
        let [rotates_freely, reflects, size] = [(); 3].map(|()| unit_interval(rng));
        let mut rotation = if config.axis_rotations {
            axes
        } else {
            Self::IDENTITY.rotation
        };
        if rotates_freely < config.free_rotation_probability {
            rotation = product(free, rotation);
        }
        if reflects < config.reflect_probability {
            rotation[0] = rotation[0].map(|x| -x);
        }
        let [low, high] = config.scale;
        Self {
            rotation,
            scale: low + (high - low) * size,
        }
    }

    /// `n` different rotations that map the axes onto each other, at most 24. The first one does not change a shape.
    pub(crate) fn spread(n: usize) -> Vec<Self> {
        let n = n.clamp(1, N_AXIS_ROTATIONS);
        (0..n)
            .map(|idx| Self {
                rotation: axis_rotation((idx * N_AXIS_ROTATIONS / n) as u64),
                scale: 1.0,
            })
            .collect()
    }

    /// The new position of a point in the unit sphere.
    pub(crate) fn point(&self, point: [f64; 3]) -> [f64; 3] {
        self.normal(point).map(|x| x * self.scale)
    }

    /// The new direction of a normal. An outward normal is still outward after a reflection.
    pub(crate) fn normal(&self, normal: [f64; 3]) -> [f64; 3] {
        self.rotation.map(|row| partprobe_carrier::dot(row, normal))
    }
}

/// The number of rotations that map the axes onto each other.
const N_AXIS_ROTATIONS: usize = 24;

/// One of the 24 rotations that map the axes onto each other, for any `draw`.
fn axis_rotation(draw: u64) -> [[f64; 3]; 3] {
    const PERMUTATIONS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [1, 2, 0],
        [2, 0, 1],
        [0, 2, 1],
        [2, 1, 0],
        [1, 0, 2],
    ];
    let choice = (draw % N_AXIS_ROTATIONS as u64) as usize;
    let permutation = PERMUTATIONS[choice / 4];
    let [flip_x, flip_y] =
        [choice % 4 / 2, choice % 2].map(|flip| if flip == 0 { 1.0 } else { -1.0 });
    // The last three permutations are odd. The sign of z makes the determinant 1.
    let parity = if choice / 4 < 3 { 1.0 } else { -1.0 };
    let signs = [flip_x, flip_y, parity * flip_x * flip_y];
    let mut rotation = [[0.0; 3]; 3];
    for row in 0..3 {
        rotation[row][permutation[row]] = signs[row];
    }
    rotation
}

/// A rotation, uniform over all of them if the numbers are uniform in [0, 1) (Shoemake's quaternion).
fn free_rotation([u, v, w]: [f64; 3]) -> [[f64; 3]; 3] {
    let tau = std::f64::consts::TAU;
    let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
    rotation_of_quaternion([
        a * (tau * v).sin(),
        a * (tau * v).cos(),
        b * (tau * w).sin(),
        b * (tau * w).cos(),
    ])
}

fn product(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    a.map(|row| [0, 1, 2].map(|column| (0..3).map(|k| row[k] * b[k][column]).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::{cross, dot, keyed_rng};

    fn config() -> AugmentConfig {
        AugmentConfig {
            axis_rotations: true,
            free_rotation_probability: 0.5,
            reflect_probability: 0.0,
            scale: [0.8, 1.2],
            jitter_sigma: 0.005,
            jitter_clip: 0.02,
        }
    }

    fn determinant([a, b, c]: [[f64; 3]; 3]) -> f64 {
        dot(a, cross(b, c))
    }

    #[test]
    fn the_axis_rotations_are_24_different_ones() {
        let mut rotations: Vec<_> = (0..24).map(axis_rotation).collect();
        assert!(
            rotations
                .iter()
                .all(|&rotation| determinant(rotation) == 1.0)
        );
        rotations.sort_by(|a, b| a.partial_cmp(b).unwrap());
        rotations.dedup();
        assert_eq!(rotations.len(), 24);
    }

    #[test]
    fn spread_poses_differ_and_begin_with_none() {
        for n in [1, 3, 8, 24] {
            let poses = Pose::spread(n);
            assert_eq!((poses.len(), poses[0]), (n, Pose::IDENTITY));
            let is_new = |idx: usize| !poses[..idx].contains(&poses[idx]);
            assert!((0..n).all(is_new));
        }
    }

    #[test]
    fn poses_keep_angles_and_scale_within_their_range() {
        for id in 0..100 {
            let rng = &mut keyed_rng(1, &["pose", &id.to_string()]);
            let pose = Pose::random(&config(), rng);
            assert!((determinant(pose.rotation) - 1.0).abs() < 1e-12);
            for (i, row) in pose.rotation.iter().enumerate() {
                assert!(
                    (dot(*row, *row) - 1.0).abs() < 1e-12
                        && dot(*row, pose.rotation[(i + 1) % 3]).abs() < 1e-12
                );
            }
            assert!((0.8..=1.2).contains(&pose.scale));
        }
    }

    #[test]
    fn reflections_happen_and_nothing_happens_when_all_is_off() {
        let reflecting = AugmentConfig {
            reflect_probability: 1.0,
            ..config()
        };
        assert!(
            determinant(Pose::random(&reflecting, &mut keyed_rng(0, &["pose"])).rotation) < 0.0
        );
        let off = AugmentConfig {
            axis_rotations: false,
            free_rotation_probability: 0.0,
            scale: [1.0, 1.0],
            ..config()
        };
        assert_eq!(
            Pose::random(&off, &mut keyed_rng(0, &["pose"])),
            Pose::IDENTITY
        );
    }
}
