//! Holds the rows of k-means, each with its number of points.

/// The rule by which a center is computed from the sum of its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CenterRule {
    /// The mean.
    Mean,
    /// The direction of the mean, as a unit vector.
    Direction,
}

/// The number of rows that are processed at once.
pub(crate) const LANES: usize = 16;

/// One number of each of [`LANES`] rows.
pub(crate) type Lane = [f32; LANES];

/// Rows with multiplicities, in the forms that the algorithm reads.
pub(crate) struct Points<'a> {
    /// The entries, row by row: `n_rows * dim` of them.
    pub(crate) values: Vec<f32>,
    /// The same entries: `[block of rows, entry]`. The last block is filled up with zeros.
    blocks: Vec<Lane>,
    /// The number of entries per row.
    pub(crate) dim: usize,
    /// The number of points of each row.
    pub(crate) weights: &'a [u32],
    /// How the iteration computes a center.
    pub(crate) center_rule: CenterRule,
}

impl<'a> Points<'a> {
    /// Rows with one weight per row.
    pub(crate) fn new(
        values: Vec<f32>,
        dim: usize,
        weights: &'a [u32],
        center_rule: CenterRule,
    ) -> Self {
        let mut blocks = vec![[0.0; LANES]; weights.len().div_ceil(LANES) * dim];
        for (idx, row) in values.chunks_exact(dim).enumerate() {
            let block = &mut blocks[idx / LANES * dim..][..dim];
            for (lane, &x) in block.iter_mut().zip(row) {
                lane[idx % LANES] = x;
            }
        }
        Self {
            values,
            blocks,
            dim,
            weights,
            center_rule,
        }
    }

    #[inline(always)]
    pub(crate) fn n_rows(&self) -> usize {
        self.weights.len()
    }

    #[inline(always)]
    pub(crate) fn row(&self, idx: usize) -> &[f32] {
        &self.values[idx * self.dim..][..self.dim]
    }

    /// Blocks of [`LANES`] rows, each entry by entry.
    #[inline(always)]
    pub(crate) fn blocks(&self) -> std::slice::ChunksExact<'_, Lane> {
        self.blocks.chunks_exact(self.dim)
    }
}

/// Subtracts the weighted mean of the rows, then divides all entries by the largest one that is left.
///
/// Distances then lose no digits and do not overflow. Returns the divisor, which is 1 if all rows are equal.
pub(crate) fn center_and_scale(values: &mut [f32], dim: usize, weights: &[u32]) -> f64 {
    let mean = weighted_mean(values, dim, weights);
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

fn weighted_mean(values: &[f32], dim: usize, weights: &[u32]) -> Vec<f64> {
    let total: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
    let mut mean = vec![0.0; dim];
    for (row, &weight) in values.chunks_exact(dim).zip(weights) {
        for (mean, &x) in mean.iter_mut().zip(row) {
            *mean += f64::from(x) * (f64::from(weight) / total.max(1.0));
        }
    }
    mean
}
