//! Greedy k-means++: the first centers of a restart.
//!
//! Each further center is the best of 2 + ⌊ln K⌋ rows that were drawn in proportion to multiplicity times
//! squared distance to the nearest center so far (Arthur and Vassilvitskii 2007, §2.2 and the remark on several trials).

use crate::distance::squared_distance;
use crate::lloyd::Points;
use partprobe_carrier::Rng;
use rand::Rng as _;

/// Rows that were chosen as centers, and each one's squared distances to all rows.
pub(crate) struct Seeds {
    /// Index of the row that each center is.
    pub(crate) rows: Vec<usize>,
    /// For each center, its squared distance to each row.
    pub(crate) squared_distances: Vec<Vec<f32>>,
}

/// Chooses up to `k` different rows; fewer if no row is left that differs from all chosen ones.
pub(crate) fn greedy_seeds(points: &Points<'_>, k: usize, rng: &mut Rng) -> Seeds {
    let n_trials = 2 + (k as f64).ln().floor() as usize;
    let mut seeds = Seeds {
        rows: Vec::new(),
        squared_distances: Vec::new(),
    };
    let mut nearest = vec![1.0; points.n_rows()];
    while seeds.rows.len() < k {
        let Some(candidates) = draw_rows(points, &nearest, n_trials, rng) else {
            break;
        };
        let is_first = seeds.rows.is_empty();
        // Any row serves as the first center; only later draws know what a good one is.
        let candidates = if is_first {
            &candidates[..1]
        } else {
            &candidates[..]
        };
        let columns = distances_to_candidates(points, candidates);
        let best = lowest_potential(points, &nearest, &columns, is_first);
        for (near, &distance) in nearest.iter_mut().zip(&columns[best]) {
            *near = if is_first {
                distance
            } else {
                near.min(distance)
            };
        }
        seeds.rows.push(candidates[best]);
        seeds
            .squared_distances
            .extend(columns.into_iter().nth(best));
    }
    seeds
}

/// Draws rows in proportion to multiplicity times `mass`; none if all of that is 0.
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
        // Rounding may push the pick to the total itself: the last row with any mass answers for it.
        let last = cumulative.partition_point(|&sum| sum < total);
        cumulative.partition_point(|&sum| sum <= pick).min(last)
    };
    (total > 0.0).then(|| (0..n_draws).map(draw).collect())
}

/// The squared distances of every row to each candidate, one column a candidate.
fn distances_to_candidates(points: &Points<'_>, candidates: &[usize]) -> Vec<Vec<f32>> {
    let mut columns = vec![Vec::with_capacity(points.n_rows()); candidates.len()];
    // Rows outside, candidates inside: a row is read from memory once.
    for row in points.rows() {
        for (column, &candidate) in columns.iter_mut().zip(candidates) {
            column.push(squared_distance(row, points.row(candidate)));
        }
    }
    columns
}

/// The column that would leave the smallest sum of squared distances; the first of equals.
fn lowest_potential(
    points: &Points<'_>,
    nearest: &[f32],
    columns: &[Vec<f32>],
    is_first: bool,
) -> usize {
    if is_first {
        return 0;
    }
    let potential = |column: &Vec<f32>| -> f64 {
        let nearest = nearest
            .iter()
            .zip(column)
            .map(|(&near, &distance)| f64::from(near.min(distance)));
        points
            .weights
            .iter()
            .zip(nearest)
            .map(|(&weight, near)| f64::from(weight) * near)
            .sum()
    };
    let potentials: Vec<f64> = columns.iter().map(potential).collect();
    (0..potentials.len()).fold(0, |best, trial| {
        if potentials[trial] < potentials[best] {
            trial
        } else {
            best
        }
    })
}
