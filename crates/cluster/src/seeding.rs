//! Chooses the first centers of a restart by greedy k-means++.
//!
//! The method is that of Arthur and Vassilvitskii 2007, "k-means++: the advantages of careful seeding", §2.2, with the
//! several trials per center that its §7 recommends: each center after the first is the best of 2 + ⌊ln k⌋ rows. They
//! are drawn in proportion to multiplicity times squared distance to the nearest center so far.

use crate::distance::squared_distances;
use crate::points::{LANES, Points};
use crate::vector_unit::{Kernel, vectorized};
use partprobe_carrier::Rng;
use rand::Rng as _;

/// Rows that were chosen as centers, and each one's squared distances to all rows.
pub(crate) struct Seeds {
    /// The index of each center's row.
    pub(crate) rows: Vec<usize>,
    /// For each center, its squared distance to each row.
    pub(crate) squared_distances: Vec<Vec<f32>>,
}

/// Chooses up to `k` different rows. There are fewer if no row is left that differs from all chosen ones.
pub(crate) fn greedy_seeds(points: &Points<'_>, k: usize, rng: &mut Rng) -> Seeds {
    let n_trials = 2 + (k as f64).ln().floor() as usize;
    let mut seeds = Seeds {
        rows: Vec::new(),
        squared_distances: Vec::new(),
    };
    // The squared distance of each row to the nearest seed: before the first seed, every row has the same chance.
    let mut nearest = vec![1.0; points.n_rows()];
    while seeds.rows.len() < k {
        let Some(mut candidates) = draw_rows(points, &nearest, n_trials, rng) else {
            break;
        };
        if seeds.rows.is_empty() {
            // Any row can be the first center. Trials are drawn for it only to keep the order of random numbers.
            candidates.truncate(1);
            nearest.fill(f32::INFINITY);
        }

        let mut columns = distances_to_candidates(points, &candidates);
        let best = lowest_potential(points, &nearest, &columns);
        for (near, &distance) in nearest.iter_mut().zip(&columns[best]) {
            *near = near.min(distance);
        }
        seeds.rows.push(candidates[best]);
        seeds.squared_distances.push(columns.swap_remove(best));
    }
    seeds
}

/// Draws rows in proportion to multiplicity times `mass`. Returns `None` if all of these products are 0.
fn draw_rows(
    points: &Points<'_>,
    mass: &[f32],
    n_draws: usize,
    rng: &mut Rng,
) -> Option<Vec<usize>> {
    let mut total = 0.0;
    let cumulative: Vec<f64> = points
        .weights
        .iter()
        .zip(mass)
        .map(|(&weight, &mass)| {
            total += f64::from(weight) * f64::from(mass);
            total
        })
        .collect();
    let draw = |_| {
        let pick = (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64 * total;
        // Rounding may make the pick equal to the total. Then the last row with a positive mass is taken.
        let last = cumulative.partition_point(|&sum| sum < total);
        cumulative.partition_point(|&sum| sum <= pick).min(last)
    };
    (total > 0.0).then(|| (0..n_draws).map(draw).collect())
}

/// The squared distance of every row to each candidate, as one column per candidate.
fn distances_to_candidates(points: &Points<'_>, candidates: &[usize]) -> Vec<Vec<f32>> {
    vectorized(CandidateDistances { points, candidates })
}

struct CandidateDistances<'a> {
    points: &'a Points<'a>,
    candidates: &'a [usize],
}

impl Kernel for CandidateDistances<'_> {
    type Output = Vec<Vec<f32>>;

    #[inline(always)]
    fn run(self) -> Vec<Vec<f32>> {
        let Self { points, candidates } = self;
        let mut columns = vec![vec![0.0; points.n_rows()]; candidates.len()];
        let (fours, rest) = candidates.as_chunks::<4>();
        let (columns_of_fours, columns_of_rest) = columns.as_chunks_mut::<4>();
        for (columns, candidates) in columns_of_fours.iter_mut().zip(fours) {
            write_distances(points, *candidates, columns);
        }
        for (column, &candidate) in columns_of_rest.iter_mut().zip(rest) {
            write_distances(points, [candidate], std::array::from_mut(column));
        }
        columns
    }
}

/// Writes the squared distance of every row to each candidate. Each row is read from memory once.
#[inline(always)]
fn write_distances<const N: usize>(
    points: &Points<'_>,
    candidates: [usize; N],
    columns: &mut [Vec<f32>; N],
) {
    let candidates = candidates.map(|candidate| points.row(candidate));
    for (block, rows) in points.blocks().enumerate() {
        let distances = squared_distances(rows, candidates);
        for (column, distances) in columns.iter_mut().zip(distances) {
            let column = &mut column[block * LANES..];
            let n = column.len().min(LANES);
            column[..n].copy_from_slice(&distances[..n]);
        }
    }
}

/// The column whose candidate gives the smallest sum of squared distances. If several are equal, it is the first one.
fn lowest_potential(points: &Points<'_>, nearest: &[f32], columns: &[Vec<f32>]) -> usize {
    let mut best = 0;
    let mut lowest = f64::INFINITY;
    for (trial, potential) in potentials(points, nearest, columns).into_iter().enumerate() {
        if potential < lowest {
            best = trial;
            lowest = potential;
        }
    }
    best
}

/// For each column, the sum, over points, of the squared distance to the nearest center, if its candidate were a center too.
fn potentials(points: &Points<'_>, nearest: &[f32], columns: &[Vec<f32>]) -> Vec<f64> {
    let mut sums = Vec::with_capacity(columns.len());
    let (fours, rest) = columns.as_chunks::<4>();
    for columns in fours {
        sums.extend(sums_of_nearest(points, nearest, columns.each_ref()));
    }
    for column in rest {
        sums.extend(sums_of_nearest(points, nearest, [column]));
    }
    sums
}

/// The potentials of some columns. Their sums do not wait for each other.
fn sums_of_nearest<const N: usize>(
    points: &Points<'_>,
    nearest: &[f32],
    columns: [&Vec<f32>; N],
) -> [f64; N] {
    let mut sums = [0.0; N];
    for (row, (&weight, &near)) in points.weights.iter().zip(nearest).enumerate() {
        for at in 0..N {
            sums[at] += f64::from(weight) * f64::from(near.min(columns[at][row]));
        }
    }
    sums
}
