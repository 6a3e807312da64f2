//! Groups sampled points into the tokens that a backbone sees.
//!
//! A token is a voxel: the points that share a cell of a cubic grid *and* the dominant signed axis of their normals. Without the
//! normal ([`Voxels::Plain`]), the two sides of a thin plate would share tokens. No point is lost: each point has a token. The
//! edge of a cell is chosen so that a shape has about the wanted number of tokens, for any form. For a flat axis-parallel
//! surface, the edge is √(area / tokens).

use crate::config::Voxels;
use crate::data::curve::{Cell, Curve, MAX_DEPTH};
use crate::data::pose::Pose;
use partprobe_carrier::{Embeddings, IGNORE, PointSample};

/// The voxels of one shape, in Morton order.
#[derive(Clone, Debug, PartialEq)]
pub struct Tokens {
    /// The mean of the points of each token, in the unit sphere.
    pub(crate) positions: Vec<[f32; 3]>,
    /// The unit mean of their normals.
    pub(crate) normals: Vec<[f32; 3]>,
    /// The cell of the grid.
    pub(crate) cells: Vec<Cell>,
    /// Dominant signed axis of the normals: 0 +x, 1 −x, 2 +y, 3 −y, 4 +z, 5 −z. In plain voxels it is 0 for all.
    pub(crate) axes: Vec<u8>,
    /// The token of each sampled point.
    pub token_of_point: Vec<u32>,
    /// The number of points of each token, at least 1.
    pub multiplicity: Vec<u32>,
}

/// The reason why points cannot be grouped into tokens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TokenizeError {
    /// There is no point.
    #[error(
        "there are no points to make tokens of; sample the shape again with `sample.n_points` above 0"
    )]
    Empty,
    /// The numbers of points and normals differ.
    #[error("there are {n_normals} normals for {n_points} points; sample the shape again")]
    Length {
        /// How many points there are.
        n_points: usize,
        /// How many normals there are.
        n_normals: usize,
    },
    /// A position or a normal is NaN or infinite.
    #[error(
        "point {point} has a coordinate or a normal that is not a finite number; check the carrier's mesh"
    )]
    NotFinite {
        /// Index of the first such point.
        point: usize,
    },
}

impl Tokens {
    /// How many tokens there are.
    #[must_use]
    pub fn n(&self) -> usize {
        self.cells.len()
    }

    /// Half of the position and the normal of each token, six numbers per row. A clusterer can use them without a network.
    #[must_use]
    pub fn geometry_rows(&self) -> Embeddings {
        let rows = self
            .positions
            .iter()
            .zip(&self.normals)
            .map(|(p, n)| [0.5 * p[0], 0.5 * p[1], 0.5 * p[2], n[0], n[1], n[2]]);
        Embeddings::from_rows(rows)
    }

    /// The label of most points of each token. In a tie, it is the lowest label. If no point has a label, it is [`IGNORE`].
    #[must_use]
    pub fn majority_labels(&self, label_of_point: &[i32]) -> Vec<i32> {
        let mut votes: Vec<(u32, i32)> = self
            .token_of_point
            .iter()
            .zip(label_of_point)
            .filter(|(_, label)| **label >= 0)
            .map(|(&token, &label)| (token, label))
            .collect();
        votes.sort_unstable();
        let mut winner = vec![(0, IGNORE); self.n()];
        for group in votes.chunk_by(|a, b| a == b) {
            let (token, label) = group[0];
            // Groups are in the order of their labels, so in a tie the lowest label wins.
            if group.len() > winner[token as usize].0 {
                winner[token as usize] = (group.len(), label);
            }
        }
        winner.into_iter().map(|(_, label)| label).collect()
    }

    /// The fraction of points whose token has another label than their own. No score through tokens can recover these points.
    #[must_use]
    pub fn label_collisions(&self, label_of_point: &[i32]) -> f64 {
        let labels = self.majority_labels(label_of_point);
        let pairs = self
            .token_of_point
            .iter()
            .zip(label_of_point)
            .filter(|(_, label)| **label >= 0);
        let (mut n, mut lost) = (0usize, 0usize);
        for (&token, &label) in pairs {
            n += 1;
            lost += usize::from(labels[token as usize] != label);
        }
        if n == 0 { 0.0 } else { lost as f64 / n as f64 }
    }
}

/// Groups a sample into about `n_tokens` tokens.
///
/// The result is deterministic, and the same up to rounding for any order of the points.
///
/// # Errors
/// If there are no points, or one of them is not finite.
pub fn tokenize(
    sample: &PointSample,
    n_tokens: usize,
    voxels: Voxels,
) -> Result<Tokens, TokenizeError> {
    tokenize_posed(sample, n_tokens, voxels, &Pose::IDENTITY)
}

/// The same after the shape was moved into the unit sphere, and rotated and scaled by `pose`.
pub(crate) fn tokenize_posed(
    sample: &PointSample,
    n_tokens: usize,
    voxels: Voxels,
    pose: &Pose,
) -> Result<Tokens, TokenizeError> {
    check_points(sample)?;
    let points: Vec<[f64; 3]> = in_unit_sphere(&sample.points)
        .into_iter()
        .map(|point| pose.point(point))
        .collect();
    let normals: Vec<[f64; 3]> = sample
        .normals
        .iter()
        .map(|normal| pose.normal(normal.map(f64::from)))
        .collect();
    let axes: Vec<u8> = match voxels {
        Voxels::NormalKeyed => normals.iter().map(dominant_axis).collect(),
        Voxels::Plain => vec![0; normals.len()],
    };
    let grid = Grid::with_about(n_tokens, &points, &axes);
    Ok(average_by_voxel(&points, &normals, &axes, &grid))
}

fn check_points(sample: &PointSample) -> Result<(), TokenizeError> {
    let (n_points, n_normals) = (sample.points.len(), sample.normals.len());
    if n_points != n_normals {
        return Err(TokenizeError::Length {
            n_points,
            n_normals,
        });
    }
    if n_points == 0 {
        return Err(TokenizeError::Empty);
    }
    let is_finite = |row: &[f32; 3]| row.iter().all(|x| x.is_finite());
    match sample
        .points
        .iter()
        .zip(&sample.normals)
        .position(|(point, normal)| !is_finite(point) || !is_finite(normal))
    {
        Some(point) => Err(TokenizeError::NotFinite { point }),
        None => Ok(()),
    }
}

/// Moves the center of the bounding box to the origin and the farthest point to distance 1.
fn in_unit_sphere(points: &[[f32; 3]]) -> Vec<[f64; 3]> {
    let (low, high) = bounds(points.iter().map(|point| point.map(f64::from)));
    let center = [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis]));
    let centered: Vec<[f64; 3]> = points
        .iter()
        .map(|point| [0, 1, 2].map(|axis| f64::from(point[axis]) - center[axis]))
        .collect();
    let radius = centered
        .iter()
        .map(|&point| partprobe_carrier::norm(point))
        .fold(0.0, f64::max);
    // If all points coincide, the radius is 0, and there is no scale.
    let scale = if radius > 0.0 { 1.0 / radius } else { 1.0 };
    centered
        .into_iter()
        .map(|point| point.map(|x| x * scale))
        .collect()
}

fn bounds(points: impl Iterator<Item = [f64; 3]>) -> ([f64; 3], [f64; 3]) {
    points.fold(
        ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]),
        |(low, high), point| {
            (
                [0, 1, 2].map(|axis| low[axis].min(point[axis])),
                [0, 1, 2].map(|axis| high[axis].max(point[axis])),
            )
        },
    )
}

/// The axis along which a normal is longest, and its sign. In a tie, x is preferred to y, and y to z.
fn dominant_axis(normal: &[f64; 3]) -> u8 {
    let axis = (1..3).fold(0, |best, axis| {
        if normal[axis].abs() > normal[best].abs() {
            axis
        } else {
            best
        }
    });
    2 * axis as u8 + u8::from(normal[axis] < 0.0)
}

/// A cubic grid that starts at the lowest corner of the points.
struct Grid {
    origin: [f64; 3],
    edge: f64,
}

impl Grid {
    /// Largest number of steps of the search for the edge. Four are enough for most shapes.
    const MAX_STEPS: usize = 8;
    /// The search ends if the number of tokens differs from the wanted one by at most this fraction.
    const TOLERANCE: f64 = 0.03;

    /// The grid whose number of voxels is nearest to `n_tokens`.
    ///
    /// The number of voxels on a surface is inversely proportional to the square of the edge. This gives the next guess.
    fn with_about(n_tokens: usize, points: &[[f64; 3]], axes: &[u8]) -> Self {
        let (low, high) = bounds(points.iter().copied());
        let [a, b, c] = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        let box_area = 2.0 * (a * b + b * c + c * a);
        let wanted = n_tokens.max(1) as f64;
        let finest = [a, b, c]
            .into_iter()
            .fold(0.0, f64::max)
            .max(f64::MIN_POSITIVE)
            / f64::from((1 << MAX_DEPTH) - 1);
        let mut grid = Self {
            origin: low,
            edge: (box_area / wanted).sqrt().max(finest),
        };
        let (mut best_edge, mut best_miss) = (grid.edge, f64::INFINITY);
        for _ in 0..Self::MAX_STEPS {
            let ratio = grid.count_voxels(points, axes) as f64 / wanted;
            let miss = ratio.ln().abs();
            if miss < best_miss {
                (best_edge, best_miss) = (grid.edge, miss);
            }
            if (ratio - 1.0).abs() <= Self::TOLERANCE {
                break;
            }
            grid.edge = (grid.edge * ratio.sqrt()).max(finest);
        }
        Self {
            edge: best_edge,
            ..grid
        }
    }

    fn cell(&self, point: &[f64; 3]) -> Cell {
        let highest = f64::from((1 << MAX_DEPTH) - 1);
        [0, 1, 2]
            .map(|axis| ((point[axis] - self.origin[axis]) / self.edge).clamp(0.0, highest) as u32)
    }

    /// Cell and axis in one number. It is equal for points of the same voxel.
    fn voxel_key(&self, point: &[f64; 3], axis: u8) -> u64 {
        let [x, y, z] = self.cell(point).map(u64::from);
        x << 35 | y << 19 | z << 3 | u64::from(axis)
    }

    fn count_voxels(&self, points: &[[f64; 3]], axes: &[u8]) -> usize {
        let mut keys: Vec<u64> = points
            .iter()
            .zip(axes)
            .map(|(point, &axis)| self.voxel_key(point, axis))
            .collect();
        keys.sort_unstable();
        keys.chunk_by(|a, b| a == b).count()
    }
}

fn average_by_voxel(points: &[[f64; 3]], normals: &[[f64; 3]], axes: &[u8], grid: &Grid) -> Tokens {
    let mut by_voxel: Vec<(u64, u32)> = (0..)
        .zip(points.iter().zip(axes))
        .map(|(idx, (point, &axis))| (grid.voxel_key(point, axis), idx))
        .collect();
    by_voxel.sort_unstable();
    let mut voxels: Vec<&[(u64, u32)]> = by_voxel.chunk_by(|a, b| a.0 == b.0).collect();
    let cell_and_axis = |voxel: &[(u64, u32)]| {
        let first = voxel[0].1 as usize;
        (grid.cell(&points[first]), axes[first])
    };
    voxels.sort_by_cached_key(|voxel| {
        let (cell, axis) = cell_and_axis(voxel);
        (Curve::Z.code(cell, MAX_DEPTH), axis)
    });
    let (cells, axes) = voxels.iter().map(|voxel| cell_and_axis(voxel)).unzip();
    let mut tokens = Tokens {
        positions: Vec::with_capacity(voxels.len()),
        normals: Vec::with_capacity(voxels.len()),
        cells,
        axes,
        token_of_point: vec![0; points.len()],
        multiplicity: voxels.iter().map(|voxel| voxel.len() as u32).collect(),
    };
    for (token, voxel) in (0..).zip(voxels) {
        let members = voxel.iter().map(|(_, idx)| *idx as usize);
        tokens
            .positions
            .push(mean(points, members.clone()).map(|x| x as f32));
        tokens
            .normals
            .push(unit_mean(normals, members.clone()).map(|x| x as f32));
        for idx in members {
            tokens.token_of_point[idx] = token;
        }
    }
    tokens
}

fn mean(rows: &[[f64; 3]], members: impl ExactSizeIterator<Item = usize>) -> [f64; 3] {
    let count = members.len() as f64;
    let sum = members.fold([0.0; 3], |sum, idx| {
        [0, 1, 2].map(|axis| sum[axis] + rows[idx][axis])
    });
    sum.map(|x| x / count)
}

/// The mean, scaled to length 1. If the normals cancel, as those of two sides in a plain voxel may, it is the mean itself.
fn unit_mean(rows: &[[f64; 3]], members: impl ExactSizeIterator<Item = usize>) -> [f64; 3] {
    let mean = mean(rows, members);
    let length = partprobe_carrier::norm(mean);
    if length > 1e-12 {
        mean.map(|x| x / length)
    } else {
        mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The upper and the lower side of a plate of side 1, `thickness` apart, on a lattice of `side`² points each.
    fn plate(side: usize, thickness: f32) -> PointSample {
        let mut sample = PointSample::default();
        for (height, up) in [(0.0, -1.0), (thickness, 1.0)] {
            for i in 0..side * side {
                let [x, y] = [i / side, i % side].map(|k| (k as f32 + 0.5) / side as f32);
                sample.points.push([x, y, height]);
                sample.normals.push([0.0, 0.0, up]);
                sample.triangles.push(u32::from(up > 0.0));
            }
        }
        sample
    }

    #[test]
    fn the_sides_of_a_thin_plate_share_no_token() {
        let sample = plate(64, 1e-3);
        let tokens = tokenize(&sample, 512, Voxels::NormalKeyed).unwrap();
        let labels: Vec<i32> = sample.triangles.iter().map(|&side| side as i32).collect();
        assert_eq!(tokens.label_collisions(&labels), 0.0);
        let half = tokens
            .majority_labels(&labels)
            .iter()
            .filter(|&&label| label == 0)
            .count();
        assert_eq!(2 * half, tokens.n());
    }

    #[test]
    fn plain_voxels_merge_the_sides_of_a_thin_plate() {
        let sample = plate(64, 1e-3);
        let tokens = tokenize(&sample, 512, Voxels::Plain).unwrap();
        let labels: Vec<i32> = sample.triangles.iter().map(|&side| side as i32).collect();
        assert_eq!(tokens.label_collisions(&labels), 0.5);
        assert_eq!(tokens.multiplicity.iter().sum::<u32>(), 2 * 64 * 64);
        assert!(tokens.normals.iter().flatten().all(|x| x.is_finite()));
    }

    #[test]
    fn every_point_has_a_token_and_the_number_of_tokens_is_near_the_requested_one() {
        for n_tokens in [64, 512, 1024] {
            let tokens = tokenize(&plate(100, 0.05), n_tokens, Voxels::NormalKeyed).unwrap();
            assert_eq!(tokens.token_of_point.len(), 20_000);
            assert_eq!(tokens.multiplicity.iter().sum::<u32>(), 20_000);
            assert!(
                (tokens.n() as f64 / n_tokens as f64 - 1.0).abs() < 0.15,
                "{} for {n_tokens}",
                tokens.n()
            );
            for (token, &count) in (0..).zip(&tokens.multiplicity) {
                assert_eq!(
                    tokens
                        .token_of_point
                        .iter()
                        .filter(|&&of_point| of_point == token)
                        .count(),
                    count as usize
                );
            }
        }
    }

    #[test]
    fn fewer_points_than_tokens_and_equal_points_are_accepted() {
        let few = tokenize(&plate(3, 0.5), 1000, Voxels::NormalKeyed).unwrap();
        assert_eq!(few.n(), 18);
        let one = PointSample {
            points: vec![[7.0; 3]; 5],
            normals: vec![[0.0; 3]; 5],
            triangles: vec![0; 5],
        };
        assert_eq!(
            tokenize(&one, 1000, Voxels::NormalKeyed)
                .unwrap()
                .multiplicity,
            [5]
        );
    }

    #[test]
    fn samples_without_valid_positions_are_refused() {
        let one = |point, normal| PointSample {
            points: vec![point],
            normals: vec![normal],
            triangles: vec![0],
        };
        assert_eq!(
            tokenize(&PointSample::default(), 8, Voxels::NormalKeyed),
            Err(TokenizeError::Empty)
        );
        let not_finite = Err(TokenizeError::NotFinite { point: 0 });
        assert_eq!(
            tokenize(
                &one([0.0, f32::NAN, 0.0], [1.0, 0.0, 0.0]),
                8,
                Voxels::NormalKeyed
            ),
            not_finite
        );
        assert_eq!(
            tokenize(
                &one([0.0; 3], [f32::INFINITY, 0.0, 0.0]),
                8,
                Voxels::NormalKeyed
            ),
            not_finite
        );
        let short = PointSample {
            normals: vec![],
            ..one([0.0; 3], [0.0; 3])
        };
        assert_eq!(
            tokenize(&short, 8, Voxels::NormalKeyed),
            Err(TokenizeError::Length {
                n_points: 1,
                n_normals: 0
            })
        );
    }

    #[test]
    fn the_majority_decides_and_ties_go_to_the_lowest_label() {
        let mut tokens = tokenize(&plate(3, 0.5), 1000, Voxels::NormalKeyed).unwrap();
        tokens.token_of_point = vec![0, 0, 0, 1, 1, 2];
        tokens.token_of_point.resize(18, 3);
        let labels = [5, 2, 5, 4, 3, IGNORE]
            .into_iter()
            .chain([IGNORE; 12])
            .collect::<Vec<_>>();
        assert_eq!(tokens.majority_labels(&labels)[..4], [5, 3, IGNORE, IGNORE]);
    }

    proptest! {
        #[test]
        fn order_of_points_does_not_matter(shift in 1usize..799) {
            let sample = plate(20, 0.1);
            let mut turned = sample.clone();
            turned.points.rotate_left(shift);
            turned.normals.rotate_left(shift);
            let cut = |sample| tokenize(sample, 64, Voxels::NormalKeyed).unwrap();
            let (tokens, other) = (cut(&sample), cut(&turned));
            prop_assert_eq!(&tokens.cells, &other.cells);
            prop_assert_eq!(&tokens.axes, &other.axes);
            let mut back = other.token_of_point.clone();
            back.rotate_right(shift);
            prop_assert_eq!(&tokens.token_of_point, &back);
            for (a, b) in tokens.positions.iter().flatten().zip(other.positions.iter().flatten()) {
                prop_assert!((a - b).abs() < 1e-6);
            }
        }
    }
}
