//! Draws the points of one update.

use crate::geometry::Pools;
use crate::network::BLOCK;
use partprobe_carrier::{Rng, unit_interval};

/// The kind of a point of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Surface,
    Near,
    Uniform,
}

/// One block of points: their indices in the pool of their kind.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub(super) kind: Kind,
    pub(super) points: Vec<u32>,
    /// A random direction in each tangent plane, in radians. Only the off-diagonal loss reads it.
    pub(super) angles: Vec<f32>,
}

/// The blocks of an update: surface points, then near ones, then uniform ones.
pub(super) fn draw(
    pools: &Pools,
    points: [usize; 3],
    with_angles: bool,
    rng: &mut Rng,
) -> Vec<Block> {
    let of_kind = [
        (Kind::Surface, pools.surface.positions.len()),
        (Kind::Near, pools.near.positions.len()),
        (Kind::Uniform, pools.uniform.positions.len()),
    ];
    let mut blocks = Vec::new();
    for ((kind, n_all), n_points) in of_kind.into_iter().zip(points) {
        for _ in 0..n_points.div_ceil(BLOCK) {
            let point = |rng: &mut Rng| (unit_interval(rng) * n_all as f64) as u32;
            let points = (0..BLOCK).map(|_| point(rng)).collect();
            let n_angles = if with_angles && kind == Kind::Near {
                BLOCK
            } else {
                0
            };
            let angle = |rng: &mut Rng| (std::f64::consts::TAU * unit_interval(rng)) as f32;
            let angles = (0..n_angles).map(|_| angle(rng)).collect();
            blocks.push(Block {
                kind,
                points,
                angles,
            });
        }
    }
    blocks
}
