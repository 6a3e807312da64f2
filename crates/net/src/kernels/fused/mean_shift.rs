//! Computes one step of mean shift for unit rows, without a matrix of all pairs.
//!
//! Each row moves to the mean of all rows, weighted by their similarity: a_ij = m_j · exp(κ (e_i·e_j − 1)), where m_j is the
//! multiplicity of row j. The result is scaled to length 1. This is the mean shift of Cheng (1995) with the von Mises–Fisher
//! kernel. It is computed like attention, 96 rows at a time, so memory grows with the number of rows and not with its square.
//! Each sum runs over the rows in their order, so the result does not depend on the number of threads.

use super::attention::exponentials;
use super::lanes::lane_sum;
use super::linear::multiply;
use super::tile::{Kernel, Panels, ROWS, vectorised};
use rayon::prelude::*;

/// Number of rows whose similarities to all rows are in memory at once.
const BLOCK: usize = 16 * ROWS;

/// The rows after one step.
///
/// # Shapes
/// - rows and output: `[row, dim]`, of length 1
/// - multiplicity: `[row]`
pub(crate) fn mean_shift_step(
    rows: &[f32],
    dim: usize,
    multiplicity: &[u32],
    kappa: f32,
) -> Vec<f32> {
    let n = multiplicity.len();
    let weighted: Vec<f32> = rows
        .chunks_exact(dim)
        .zip(multiplicity)
        .flat_map(|(row, &m)| row.iter().map(move |x| x * m as f32))
        .collect();
    let panels = RowPanels {
        keys: Panels::of_transpose(rows, dim, n),
        values: Panels::of(&weighted, n, dim),
    };

    let mut shifted = vec![0.0; rows.len()];
    shifted
        .par_chunks_mut(BLOCK * dim)
        .zip(rows.par_chunks(BLOCK * dim))
        .for_each(|(shifted, rows)| {
            vectorised(Shift {
                rows,
                panels: &panels,
                kappa,
                shifted,
            });
        });
    shifted
}

/// All rows, ready for products with a block of them.
struct RowPanels {
    /// `[dim, row]`.
    keys: Panels,
    /// `[row, dim]`, each row times its multiplicity.
    values: Panels,
}

/// # Shapes
/// - rows and shifted: `[row of the block, dim]`
struct Shift<'a> {
    rows: &'a [f32],
    panels: &'a RowPanels,
    kappa: f32,
    shifted: &'a mut [f32],
}

impl Kernel for Shift<'_> {
    #[inline(always)]
    fn run(self) {
        let dim = self.panels.keys.depth();
        let n_keys = self.panels.keys.n_columns();
        let mut similarity = vec![0.0; self.rows.len() / dim * n_keys];

        multiply(self.rows, &self.panels.keys, &[], &mut similarity);
        for row in similarity.chunks_exact_mut(n_keys) {
            exponentials(row, self.kappa, self.kappa);
        }
        multiply(&similarity, &self.panels.values, &[], self.shifted);

        for row in self.shifted.chunks_exact_mut(dim) {
            let length = lane_sum(row, row, |x, y| x * y).sqrt();
            // A row of zeros is the mean of rows that cancel each other. It does not change.
            let inverse = if length > 0.0 { 1.0 / length } else { 0.0 };
            row.iter_mut().for_each(|x| *x *= inverse);
        }
    }
}
