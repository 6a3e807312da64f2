//! Draws the training points of a network, once per shape: on the surface, near it, and in its box.
//!
//! Every training of a shape uses the same points, for any labels and seed.

use super::reference::{Reference, ReferenceError};
use partprobe_carrier::{
    NormalKind, Point, PointSample, Rng, keyed_rng, sample_by_area, unit_interval,
};

/// The two distances, one standard deviation each, at which points lie near the surface, as fractions of the longest side.
const NEAR: [f64; 2] = [0.005, 0.02];
/// The box of the uniform points, relative to the frame's cube.
const BOX: f64 = 1.1;
/// A winding number that is farther than this from 0 and from 1 is undecided.
const UNDECIDED: f64 = 0.25;
/// The surface counts as open if there are more undecided points than this, in percent.
const MAX_OPEN_PERCENT: f64 = 2.0;

/// The number of points of each kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoolSizes {
    /// On the surface.
    pub surface: usize,
    /// Near the surface.
    pub near: usize,
    /// In the box.
    pub uniform: usize,
}

impl Default for PoolSizes {
    fn default() -> Self {
        Self {
            surface: 200_000,
            near: 200_000,
            uniform: 100_000,
        }
    }
}

/// Points of one shape, in the frame of the networks.
#[derive(Clone, Debug)]
pub struct Pools {
    /// Points on the surface.
    pub surface: SurfacePoints,
    /// Points near the surface. Each is one of the surface points, moved at random.
    pub near: OffSurfacePoints,
    /// Uniform points in the box.
    pub uniform: OffSurfacePoints,
}

/// Points on a surface.
#[derive(Clone, Debug)]
pub struct SurfacePoints {
    /// The points in millimeters, with the triangles from which they were drawn. A label source labels these points.
    pub sample: PointSample,
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) normals: Vec<[f32; 3]>,
}

/// Points in space.
#[derive(Clone, Debug)]
pub struct OffSurfacePoints {
    pub(crate) positions: Vec<[f32; 3]>,
    /// Signed distances in units of the frame.
    pub(crate) distances: Vec<f32>,
}

impl Pools {
    /// Draws the points of a shape. `key` names the shape.
    ///
    /// Cost: some microseconds per point, on all threads of the current pool.
    ///
    /// # Errors
    /// If the surface is not closed.
    pub fn new(reference: &Reference, sizes: PoolSizes, key: &str) -> Result<Self, ReferenceError> {
        let rng = &mut keyed_rng(0, &["implicit", "pools", key]);
        let sample = sample_by_area(reference.mesh(), sizes.surface, NormalKind::Triangle, rng)
            .map_err(|_| ReferenceError::NoExtent)?;
        let frame = reference.frame();
        let positions: Vec<Point> = sample
            .points
            .iter()
            .map(|point| frame.to_frame(point.map(f64::from)))
            .collect();

        let near: Vec<Point> = (0..sizes.near)
            .map(|idx| {
                let from = positions[(unit_interval(rng) * positions.len() as f64) as usize];
                let sigma = 2.0 * NEAR[idx % NEAR.len()];
                let moved = normal_numbers(rng);
                std::array::from_fn(|axis| from[axis] + sigma * moved[axis])
            })
            .collect();
        let (near, _) = with_distances(reference, &near);
        let uniform: Vec<Point> = (0..sizes.uniform)
            .map(|_| std::array::from_fn(|_| BOX * (2.0 * unit_interval(rng) - 1.0)))
            .collect();
        let (uniform, n_undecided) = with_distances(reference, &uniform);
        let percent = 100.0 * n_undecided as f64 / sizes.uniform.max(1) as f64;
        if percent > MAX_OPEN_PERCENT {
            return Err(ReferenceError::Open { percent });
        }
        Ok(Self {
            surface: SurfacePoints {
                positions: positions.into_iter().map(single).collect(),
                normals: sample.normals.clone(),
                sample,
            },
            near,
            uniform,
        })
    }
}

/// The points with their distances, and the number of undecided points.
fn with_distances(reference: &Reference, points: &[Point]) -> (OffSurfacePoints, usize) {
    let frame = reference.frame();
    let in_millimeters: Vec<Point> = points
        .iter()
        .map(|&point| frame.to_millimeters(point))
        .collect();
    let found = reference.signed_distances(&in_millimeters);
    let is_undecided = |number: f64| number.abs() > UNDECIDED && (number - 1.0).abs() > UNDECIDED;
    let n_undecided = found
        .iter()
        .filter(|found| is_undecided(found.winding_number))
        .count();
    let half = 0.5 * frame.longest_side();
    let points = OffSurfacePoints {
        positions: points.iter().copied().map(single).collect(),
        distances: found
            .iter()
            .map(|found| (found.distance / half) as f32)
            .collect(),
    };
    (points, n_undecided)
}

fn single(point: Point) -> [f32; 3] {
    point.map(|x| x as f32)
}

/// Three numbers with the normal distribution (Box and Muller 1958).
fn normal_numbers(rng: &mut Rng) -> [f64; 3] {
    std::array::from_fn(|_| {
        let radius = (-2.0 * libm::log(1.0 - unit_interval(rng))).sqrt();
        radius * libm::cos(2.0 * std::f64::consts::PI * unit_interval(rng))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::sphere;

    const SIZES: PoolSizes = PoolSizes {
        surface: 500,
        near: 500,
        uniform: 500,
    };

    #[test]
    fn points_have_the_distances_of_their_sphere() {
        let reference = Reference::new(&sphere(3.0, [200, 100])).unwrap();
        let pools = Pools::new(&reference, SIZES, "ball").unwrap();
        for pool in [&pools.near, &pools.uniform] {
            for (position, distance) in pool.positions.iter().zip(&pool.distances) {
                let radius = position.iter().map(|x| x * x).sum::<f32>().sqrt();
                assert!(
                    (radius - 1.0 - distance).abs() < 2e-3,
                    "{position:?}: {distance}"
                );
            }
        }
        let farthest = pools
            .near
            .distances
            .iter()
            .fold(0.0f32, |most, d| most.max(d.abs()));
        assert!(farthest > 0.02 && farthest < 0.2, "{farthest}");
        for (position, normal) in pools.surface.positions.iter().zip(&pools.surface.normals) {
            let along: f32 = position.iter().zip(normal).map(|(x, n)| x * n).sum();
            assert!(along > 0.99);
        }
    }

    #[test]
    fn an_open_surface_is_refused() {
        let mut mesh = sphere(1.0, [40, 20]);
        mesh.triangles.truncate(mesh.triangles.len() * 2 / 3);
        mesh.tri_face.truncate(mesh.triangles.len());
        let reference = Reference::new(&mesh).unwrap();
        let message = Pools::new(&reference, SIZES, "bowl").unwrap_err();
        assert!(
            matches!(message, ReferenceError::Open { percent } if percent > 2.0),
            "{message}"
        );
    }
}
