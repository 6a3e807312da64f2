//! Lloyd's iteration with the bounds of Elkan (2003): most distances are never computed, and none that matters is missed.
//!
//! On unit rows and unit centers the Euclidean distance grows as the cosine falls, so the spherical variant
//! is the same iteration with centers put back on the sphere.

use crate::distance::squared_distance;
use crate::kmeans::KMeansSettings;
use crate::seeding::Seeds;

/// How a center follows from the sum of its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CenterRule {
    /// The mean.
    Mean,
    /// The direction of the mean.
    Direction,
}

/// Rows with multiplicities, as the iteration reads them.
pub(crate) struct Points<'a> {
    pub(crate) values: Vec<f32>,
    pub(crate) dim: usize,
    pub(crate) weights: &'a [u32],
    pub(crate) center_rule: CenterRule,
}

impl Points<'_> {
    pub(crate) fn n_rows(&self) -> usize {
        self.weights.len()
    }

    pub(crate) fn row(&self, idx: usize) -> &[f32] {
        &self.values[idx * self.dim..][..self.dim]
    }

    pub(crate) fn rows(&self) -> std::slice::ChunksExact<'_, f32> {
        self.values.chunks_exact(self.dim)
    }
}

/// The state of one restart.
///
/// Invariants: `upper[i]` is at least the distance of row i to its center, `lower[i * k + j]` at most its distance to
/// center j, and `sums` and `totals` are those of `assignment`.
pub(crate) struct Lloyd<'a> {
    points: &'a Points<'a>,
    k: usize,
    centers: Vec<f32>,
    sums: Vec<f64>,
    totals: Vec<u64>,
    pub(crate) assignment: Vec<u32>,
    upper: Vec<f32>,
    lower: Vec<f32>,
}

impl<'a> Lloyd<'a> {
    /// Every row at its nearest seed; the seeds' distances are the first bounds, so this costs no distance at all.
    pub(crate) fn from_seeds(points: &'a Points<'a>, seeds: &Seeds) -> Self {
        let (n, k, dim) = (points.n_rows(), seeds.rows.len(), points.dim);
        let mut lower = vec![0.0; n * k];
        for (center, column) in seeds.squared_distances.iter().enumerate() {
            for (row, &squared) in column.iter().enumerate() {
                lower[row * k + center] = squared.sqrt();
            }
        }
        let nearest = |bounds: &[f32]| {
            (1..k).fold(0, |best, j| if bounds[j] < bounds[best] { j } else { best })
        };
        let assignment: Vec<u32> = lower
            .chunks_exact(k)
            .map(|bounds| nearest(bounds) as u32)
            .collect();
        let upper = lower
            .chunks_exact(k)
            .zip(&assignment)
            .map(|(bounds, &own)| bounds[own as usize])
            .collect();
        let centers = seeds
            .rows
            .iter()
            .flat_map(|&row| points.row(row))
            .copied()
            .collect();
        let (sums, totals) = (vec![0.0; k * dim], vec![0; k]);
        let mut state = Self {
            points,
            k,
            centers,
            sums,
            totals,
            assignment,
            upper,
            lower,
        };
        for row in 0..n {
            state.add_to_sum(row, state.assignment[row] as usize, 1.0);
        }
        state
    }

    /// Iterates until no row changes its cluster, no center moves further than the tolerance, or the budget is spent.
    pub(crate) fn run(&mut self, settings: &KMeansSettings) {
        for _ in 0..settings.max_iterations {
            self.fill_empty_clusters();
            let moved = self.move_centers();
            self.loosen_bounds(&moved);
            let any_changed = self.reassign();
            if !any_changed
                || moved
                    .iter()
                    .all(|&distance| f64::from(distance) < settings.tolerance)
            {
                break;
            }
        }
    }

    /// The sum, over points, of the squared distance to the own center.
    pub(crate) fn objective(&self) -> f64 {
        let weighted = |(row, &weight): (usize, &u32)| {
            f64::from(weight)
                * f64::from(squared_distance(
                    self.points.row(row),
                    self.center(self.own(row)),
                ))
        };
        self.points.weights.iter().enumerate().map(weighted).sum()
    }

    fn center(&self, j: usize) -> &[f32] {
        &self.centers[j * self.points.dim..][..self.points.dim]
    }

    fn own(&self, row: usize) -> usize {
        self.assignment[row] as usize
    }

    fn distance(&self, row: usize, j: usize) -> f32 {
        squared_distance(self.points.row(row), self.center(j)).sqrt()
    }

    /// Adds `sign` times a row's points to the sum of cluster `j`.
    fn add_to_sum(&mut self, row: usize, j: usize, sign: f64) {
        let weight = self.points.weights[row];
        let dim = self.points.dim;
        for (sum, &x) in self.sums[j * dim..][..dim]
            .iter_mut()
            .zip(self.points.row(row))
        {
            *sum += sign * f64::from(weight) * f64::from(x);
        }
        let weight = u64::from(weight);
        self.totals[j] = if sign > 0.0 {
            self.totals[j] + weight
        } else {
            self.totals[j].saturating_sub(weight)
        };
    }

    fn change_cluster(&mut self, row: usize, to: usize) {
        self.add_to_sum(row, self.own(row), -1.0);
        self.add_to_sum(row, to, 1.0);
        self.assignment[row] = to as u32;
    }

    /// Gives each empty cluster the row that is farthest from its center, as long as that empties no other cluster.
    fn fill_empty_clusters(&mut self) {
        for empty in 0..self.k {
            if self.totals[empty] > 0 {
                continue;
            }
            let mut farthest = None;
            for (row, &weight) in self.points.weights.iter().enumerate() {
                let is_alone = self.totals[self.own(row)] <= u64::from(weight);
                let distance = if weight == 0 || is_alone {
                    0.0
                } else {
                    self.distance(row, self.own(row))
                };
                if farthest.map_or(0.0, |(_, longest)| longest) < distance {
                    farthest = Some((row, distance));
                }
            }
            if let Some((row, _)) = farthest {
                self.change_cluster(row, empty);
                self.upper[row] = self.distance(row, empty);
            }
        }
    }

    /// Puts each center where its rule says; how far each one went.
    fn move_centers(&mut self) -> Vec<f32> {
        let dim = self.points.dim;
        let mut moved = Vec::with_capacity(self.k);
        for j in 0..self.k {
            let sum = &self.sums[j * dim..][..dim];
            let length = match self.points.center_rule {
                CenterRule::Mean => self.totals[j] as f64,
                CenterRule::Direction => sum.iter().map(|x| x * x).sum::<f64>().sqrt(),
            };
            // An empty cluster, or one whose points cancel out, keeps its center.
            let is_defined = self.totals[j] > 0 && length > 1e-12 * self.totals[j] as f64;
            let new: Vec<f32> = match is_defined {
                true => sum.iter().map(|x| (x / length) as f32).collect(),
                false => self.center(j).to_vec(),
            };
            moved.push(squared_distance(&new, self.center(j)).sqrt());
            self.centers[j * dim..][..dim].copy_from_slice(&new);
        }
        moved
    }

    /// Keeps the bounds true after the centers went that far.
    fn loosen_bounds(&mut self, moved: &[f32]) {
        // A little more than the distance itself, so that rounding cannot make a bound false.
        let moved: Vec<f32> = moved
            .iter()
            .map(|&distance| distance * (1.0 + 1e-5))
            .collect();
        for (row, bounds) in self.lower.chunks_exact_mut(self.k).enumerate() {
            self.upper[row] += moved[self.assignment[row] as usize];
            for (bound, &distance) in bounds.iter_mut().zip(&moved) {
                *bound -= distance;
            }
        }
    }

    /// Sends every row to its nearest center; whether any row went.
    fn reassign(&mut self) -> bool {
        let gaps = self.half_gaps();
        let mut any_changed = false;
        for row in 0..self.points.n_rows() {
            let own = self.own(row);
            let nearest_gap = gaps[own * self.k + own];
            if self.upper[row] <= nearest_gap {
                continue;
            }
            let nearest = self.nearest_center(row, &gaps);
            if nearest != own {
                self.change_cluster(row, nearest);
                any_changed = true;
            }
        }
        any_changed
    }

    /// Half the distance between each two centers; on the diagonal, half of that to the nearest other center.
    fn half_gaps(&self) -> Vec<f32> {
        let mut gaps = vec![f32::INFINITY; self.k * self.k];
        for a in 0..self.k {
            for b in (0..self.k).filter(|&b| b != a) {
                let gap = 0.5 * squared_distance(self.center(a), self.center(b)).sqrt();
                gaps[a * self.k + b] = gap;
                gaps[a * self.k + a] = gaps[a * self.k + a].min(gap);
            }
        }
        gaps
    }

    /// The nearest center of a row, the present one among equals; tightens the row's bounds on its way.
    fn nearest_center(&mut self, row: usize, gaps: &[f32]) -> usize {
        let k = self.k;
        let mut nearest = self.own(row);
        let mut is_exact = false;
        for j in 0..k {
            let cannot_be_nearer = |upper: f32, bound: f32, nearest: usize| {
                upper <= bound || upper <= gaps[nearest * k + j]
            };
            if j == nearest || cannot_be_nearer(self.upper[row], self.lower[row * k + j], nearest) {
                continue;
            }
            if !is_exact {
                self.upper[row] = self.distance(row, nearest);
                self.lower[row * k + nearest] = self.upper[row];
                is_exact = true;
                if cannot_be_nearer(self.upper[row], self.lower[row * k + j], nearest) {
                    continue;
                }
            }
            let distance = self.distance(row, j);
            self.lower[row * k + j] = distance;
            if distance < self.upper[row] {
                self.upper[row] = distance;
                nearest = j;
            }
        }
        nearest
    }
}

/// The weighted mean of the rows taken away, and everything divided by the largest entry that is left:
/// distances then lose no digits and overflow nothing. Returns the divisor.
pub(crate) fn center_and_scale(values: &mut [f32], dim: usize, weights: &[u32]) -> f64 {
    let total: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
    let mut mean = vec![0.0; dim];
    for (row, &weight) in values.chunks_exact(dim).zip(weights) {
        for (mean, &x) in mean.iter_mut().zip(row) {
            *mean += f64::from(x) * (f64::from(weight) / total.max(1.0));
        }
    }
    let centered = |values: &[f32], at: usize| f64::from(values[at]) - mean[at % dim];
    let largest = (0..values.len())
        .map(|at| centered(values, at).abs())
        .fold(0.0, f64::max);
    let scale = if largest > 0.0 { largest } else { 1.0 };
    for at in 0..values.len() {
        values[at] = (centered(values, at) / scale) as f32;
    }
    scale
}
