//! Runs Lloyd's iteration (Lloyd 1982, "Least squares quantization in PCM") from given seeds until it converges.
//!
//! Upper and lower bounds of the distances avoid most of the distance computations and do not change the result (Elkan 2003,
//! "Using the triangle inequality to accelerate k-means"). For unit rows and unit centers, the Euclidean distance increases as
//! the cosine decreases, so the spherical variant is the same iteration with centers of norm 1 (Dhillon and Modha 2001).

use crate::distance::squared_distance;
use crate::points::{CenterRule, LANES, Lane, Points};
use crate::seeding::Seeds;
use crate::settings::KMeansSettings;
use crate::vector_unit::{Kernel, vectorized};

/// The state of one restart.
///
/// Invariants: `upper[i]` is at least the distance of row i to its center. Bound j of `lower` of row i is at most its distance to
/// center j. `sums` and `totals` are those of `assignment`.
pub(crate) struct Lloyd<'a> {
    points: &'a Points<'a>,
    k: usize,
    /// The number of lanes that `k` bounds fill. The rest of the last one is infinite, because no center is there.
    n_lanes: usize,
    centers: Vec<f32>,
    sums: Vec<f64>,
    totals: Vec<u64>,
    pub(crate) assignment: Vec<u32>,
    upper: Vec<f32>,
    /// `[row, lane]`.
    lower: Vec<Lane>,
}

/// Half of the distances between centers: `[center, lane]`, infinite between a center and itself.
struct HalfGaps(Vec<Lane>);

impl<'a> Lloyd<'a> {
    /// Assigns every row to its nearest seed. The distances of the seeds are the first bounds, so no distance is computed.
    pub(crate) fn from_seeds(points: &'a Points<'a>, seeds: &Seeds) -> Self {
        let k = seeds.rows.len();
        let n_lanes = k.div_ceil(LANES);
        let lower = row_major_distances(seeds, points.n_rows());
        let of_row = || lower.chunks_exact(n_lanes).map(<[Lane]>::as_flattened);
        let assignment: Vec<u32> = of_row()
            .map(|bounds| first_minimum(bounds) as u32)
            .collect();
        let upper = of_row()
            .zip(&assignment)
            .map(|(bounds, &own)| bounds[own as usize])
            .collect();
        let seed_rows = seeds.rows.iter().map(|&row| points.row(row));

        let mut state = Self {
            points,
            k,
            n_lanes,
            centers: seed_rows.flatten().copied().collect(),
            sums: vec![0.0; k * points.dim],
            totals: vec![0; k],
            assignment,
            upper,
            lower,
        };
        for row in 0..points.n_rows() {
            state.add_to_sum(row, state.cluster_of(row), 1.0);
        }
        state
    }

    /// Iterates until no row changes its cluster, no center moves further than the tolerance, or the budget is spent.
    pub(crate) fn run(&mut self, settings: &KMeansSettings) {
        for _ in 0..settings.max_iterations {
            self.fill_empty_clusters();
            let moved = self.move_centers();
            let any_changed = vectorized(Reassignment {
                lloyd: self,
                moved: &moved,
            });
            let is_settled = moved
                .iter()
                .all(|&distance| f64::from(distance) < settings.tolerance);
            if !any_changed || is_settled {
                break;
            }
        }
    }

    /// The sum, over points, of the squared distance to the own center.
    pub(crate) fn objective(&self) -> f64 {
        let squared =
            |row| squared_distance(self.points.row(row), self.center(self.cluster_of(row)));
        let weights = self.points.weights.iter().enumerate();
        weights
            .map(|(row, &weight)| f64::from(weight) * f64::from(squared(row)))
            .sum()
    }

    #[inline(always)]
    fn center(&self, j: usize) -> &[f32] {
        &self.centers[j * self.points.dim..][..self.points.dim]
    }

    #[inline(always)]
    fn cluster_of(&self, row: usize) -> usize {
        self.assignment[row] as usize
    }

    #[inline(always)]
    fn distance(&self, row: usize, j: usize) -> f32 {
        squared_distance(self.points.row(row), self.center(j)).sqrt()
    }

    /// Adds `sign` times a row's points to the sum of cluster `j`.
    #[inline(always)]
    fn add_to_sum(&mut self, row: usize, j: usize, sign: f64) {
        let weight = self.points.weights[row];
        let dim = self.points.dim;
        let sum_of_cluster = &mut self.sums[j * dim..][..dim];
        for (sum, &x) in sum_of_cluster.iter_mut().zip(self.points.row(row)) {
            *sum += sign * f64::from(weight) * f64::from(x);
        }

        let weight = u64::from(weight);
        self.totals[j] = if sign > 0.0 {
            self.totals[j] + weight
        } else {
            self.totals[j].saturating_sub(weight)
        };
    }

    #[inline(always)]
    fn change_cluster(&mut self, row: usize, to: usize) {
        self.add_to_sum(row, self.cluster_of(row), -1.0);
        self.add_to_sum(row, to, 1.0);
        self.assignment[row] = to as u32;
    }

    /// Gives each empty cluster the row that is farthest from its center, unless that would empty another cluster.
    fn fill_empty_clusters(&mut self) {
        for empty in 0..self.k {
            if self.totals[empty] > 0 {
                continue;
            }
            if let Some(row) = self.farthest_movable_row() {
                self.change_cluster(row, empty);
                self.upper[row] = self.distance(row, empty);
            }
        }
    }

    /// The row that is farthest from its center, among rows that are not alone in their cluster. If several are equal, it is the
    /// first one.
    fn farthest_movable_row(&self) -> Option<usize> {
        let mut farthest = None;
        let mut longest = 0.0;
        for (row, &weight) in self.points.weights.iter().enumerate() {
            let is_alone = self.totals[self.cluster_of(row)] <= u64::from(weight);
            if weight == 0 || is_alone {
                continue;
            }
            let distance = self.distance(row, self.cluster_of(row));
            if longest < distance {
                longest = distance;
                farthest = Some(row);
            }
        }
        farthest
    }

    /// Moves each center by its rule. Returns the distances.
    fn move_centers(&mut self) -> Vec<f32> {
        let dim = self.points.dim;
        let mut moved = Vec::with_capacity(self.k);
        for j in 0..self.k {
            let new = self.center_of_sum(j);
            moved.push(squared_distance(&new, self.center(j)).sqrt());
            self.centers[j * dim..][..dim].copy_from_slice(&new);
        }
        moved
    }

    /// The center that follows from the sum of cluster `j`.
    fn center_of_sum(&self, j: usize) -> Vec<f32> {
        let dim = self.points.dim;
        let sum = &self.sums[j * dim..][..dim];
        let length = match self.points.center_rule {
            CenterRule::Mean => self.totals[j] as f64,
            CenterRule::Direction => sum.iter().map(|x| x * x).sum::<f64>().sqrt(),
        };

        // An empty cluster, or a cluster whose points cancel, keeps its center.
        let is_defined = self.totals[j] > 0 && length > 1e-12 * self.totals[j] as f64;
        if is_defined {
            sum.iter().map(|x| (x / length) as f32).collect()
        } else {
            self.center(j).to_vec()
        }
    }

    /// Assigns every row to its nearest center, after the centers moved by the given distances. Returns whether any row changed its
    /// cluster.
    #[inline(always)]
    fn reassign(&mut self, moved: &[f32]) -> bool {
        // The distance is slightly increased, so that rounding cannot make a bound wrong.
        let mut loosening = vec![[0.0; LANES]; self.n_lanes];
        for (loosening, &distance) in loosening.as_flattened_mut().iter_mut().zip(moved) {
            *loosening = distance * (1.0 + 1e-5);
        }
        let gaps = self.half_gaps();
        let mut undecided = vec![0; self.points.n_rows()];
        let n_undecided = self.loosen_bounds(&loosening, &gaps, &mut undecided);

        let mut any_changed = false;
        for &row in &undecided[..n_undecided] {
            let row = row as usize;
            let nearest = self.nearest_center(row, &gaps);
            if nearest != self.cluster_of(row) {
                self.change_cluster(row, nearest);
                any_changed = true;
            }
        }
        any_changed
    }

    #[inline(always)]
    fn half_gaps(&self) -> HalfGaps {
        let mut gaps = vec![[f32::INFINITY; LANES]; self.k * self.n_lanes];
        for (a, gaps) in gaps.chunks_exact_mut(self.n_lanes).enumerate() {
            for b in (0..self.k).filter(|&b| b != a) {
                let gap = 0.5 * squared_distance(self.center(a), self.center(b)).sqrt();
                gaps[b / LANES][b % LANES] = gap;
            }
        }
        HalfGaps(gaps)
    }

    /// Corrects all bounds after the centers moved. Writes the rows whose bounds do not prove that their center is still the nearest
    /// one, and returns how many these are.
    #[inline(always)]
    fn loosen_bounds(
        &mut self,
        loosening: &[Lane],
        gaps: &HalfGaps,
        undecided: &mut [u32],
    ) -> usize {
        let n_lanes = loosening.len();
        let rows = self.lower.chunks_exact_mut(n_lanes).zip(&mut self.upper);
        let mut n_undecided = 0;
        for (row, ((lower, upper), &own)) in rows.zip(&self.assignment).enumerate() {
            let own = own as usize;
            *upper += loosening.as_flattened()[own];
            let gaps = &gaps.0[own * n_lanes..][..n_lanes];
            let mut may_change = false;
            for lane in 0..n_lanes {
                let mut bounds = lower[lane];
                for at in 0..LANES {
                    bounds[at] -= loosening[lane][at];
                }
                lower[lane] = bounds;
                may_change |= nearer_candidates(*upper, &bounds, &gaps[lane]) != 0;
            }
            undecided[n_undecided] = row as u32;
            n_undecided += usize::from(may_change);
        }
        n_undecided
    }

    /// The nearest center of a row. If several are equal, it is the current one. Tightens the bounds of the row.
    #[inline(always)]
    fn nearest_center(&mut self, row: usize, gaps: &HalfGaps) -> usize {
        let mut nearest = self.cluster_of(row);
        let mut is_exact = false;
        for lane in 0..self.n_lanes {
            let lower = &self.lower[row * self.n_lanes + lane];
            let gaps_of_lane = &gaps.0[nearest * self.n_lanes + lane];
            let mut candidates = nearer_candidates(self.upper[row], lower, gaps_of_lane);
            while candidates != 0 {
                let j = lane * LANES + candidates.trailing_zeros() as usize;
                candidates &= candidates - 1;
                if j == nearest || self.cannot_be_nearer(row, j, nearest, gaps) {
                    continue;
                }
                if !is_exact {
                    self.upper[row] = self.distance(row, nearest);
                    *self.lower_bound(row, nearest) = self.upper[row];
                    is_exact = true;
                    if self.cannot_be_nearer(row, j, nearest, gaps) {
                        continue;
                    }
                }

                let distance = self.distance(row, j);
                *self.lower_bound(row, j) = distance;
                if distance < self.upper[row] {
                    self.upper[row] = distance;
                    nearest = j;
                }
            }
        }
        nearest
    }

    #[inline(always)]
    fn lower_bound(&mut self, row: usize, j: usize) -> &mut f32 {
        &mut self.lower[row * self.n_lanes + j / LANES][j % LANES]
    }

    /// Whether the bounds prove that center `j` is not nearer to the row than center `nearest` (lemma 1 of Elkan 2003).
    #[inline(always)]
    fn cannot_be_nearer(&self, row: usize, j: usize, nearest: usize, gaps: &HalfGaps) -> bool {
        let upper = self.upper[row];
        let (lane, at) = (j / LANES, j % LANES);
        upper <= self.lower[row * self.n_lanes + lane][at]
            || upper <= gaps.0[nearest * self.n_lanes + lane][at]
    }
}

/// One bit for each center of a lane that may be nearer than the own one. `gaps` are those of the own center.
#[inline(always)]
fn nearer_candidates(upper: f32, lower: &Lane, gaps: &Lane) -> u32 {
    let mut bits = 0;
    for at in 0..LANES {
        bits |= u32::from((upper > lower[at]) & (upper > gaps[at])) << at;
    }
    bits
}

/// The loop that takes most of the time.
struct Reassignment<'a, 'b> {
    lloyd: &'b mut Lloyd<'a>,
    /// For each center, how far it moved.
    moved: &'b [f32],
}

impl Kernel for Reassignment<'_, '_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        self.lloyd.reassign(self.moved)
    }
}

/// The distance of each row to each seed: `[row, lane]`.
fn row_major_distances(seeds: &Seeds, n_rows: usize) -> Vec<Lane> {
    let n_lanes = seeds.rows.len().div_ceil(LANES);
    let mut distances = vec![[f32::INFINITY; LANES]; n_rows * n_lanes];
    for (center, column) in seeds.squared_distances.iter().enumerate() {
        for (row, &squared) in column.iter().enumerate() {
            distances[row * n_lanes + center / LANES][center % LANES] = squared.sqrt();
        }
    }
    distances
}

/// The index of the smallest number. If several are equal, it is the first one.
fn first_minimum(numbers: &[f32]) -> usize {
    let mut best = 0;
    for (at, &number) in numbers.iter().enumerate() {
        if number < numbers[best] {
            best = at;
        }
    }
    best
}
