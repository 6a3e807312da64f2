//! Computes one step of mean shift for unit rows, without a matrix of all pairs.
//!
//! Each row moves to the mean of all rows, weighted by their similarity: a_ij = m_j · exp(κ (e_i·e_j − 1)), where m_j is the
//! multiplicity of row j. The result is scaled to length 1. This is the mean shift of Cheng (1995) with the von Mises–Fisher
//! kernel.
//!
//! The rows are divided into blocks, and the similarities of two blocks are computed once for both directions, because e_i·e_j =
//! e_j·e_i. Only these are in memory, so memory grows with the number of rows and not with its square. The pairs of blocks are
//! visited in rounds: in round d, block b meets block b + d. No two pairs of a round add to the same sums, and the rounds follow
//! each other, so the result does not depend on the number of threads.

use super::attention::exponentials;
use super::lanes::{LANES, lane_sum};
use super::linear::multiply;
use super::tile::{
    Kernel, Panels, ROWS, RowPairs, add, add_outer_products, rows_of, tile, vectorised,
};
use rayon::prelude::*;

/// Number of rows of a block: whole tiles of rows and whole panels of columns.
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
    let blocks: Vec<Block<'_>> = rows
        .par_chunks(BLOCK * dim)
        .zip(multiplicity.par_chunks(BLOCK))
        .map(|(rows, multiplicity)| Block::new(rows, dim, multiplicity))
        .collect();
    let [from_next, from_previous] = sums_of_meetings(&blocks, kappa);

    let mut shifted = vec![0.0; rows.len()];
    shifted
        .par_chunks_mut(BLOCK * dim)
        .zip(from_next.par_iter().zip(&from_previous))
        .for_each(|(shifted, (from_next, from_previous))| {
            write_directions([from_next, from_previous], dim, shifted);
        });
    shifted
}

/// What each block receives from the blocks that follow it and from itself, and from the blocks before it. The blocks form a circle.
fn sums_of_meetings(blocks: &[Block<'_>], kappa: f32) -> [Vec<Sums>; 2] {
    let n_blocks = blocks.len();
    let mut from_next: Vec<Sums> = blocks.iter().map(Block::no_sums).collect();
    let mut from_previous = from_next.clone();
    for distance in 0..=n_blocks / 2 {
        // Blocks that are opposite each other on the circle meet in half of the pairs of this round.
        let are_opposite = distance > 0 && 2 * distance == n_blocks;
        let n_pairs = if are_opposite { distance } else { n_blocks };
        // The sums of a block's partner are now at the place of the block.
        from_previous.rotate_left(distance.min(1));
        from_next[..n_pairs]
            .par_iter_mut()
            .zip(&mut from_previous[..n_pairs])
            .enumerate()
            .for_each_init(
                || vec![0.0; BLOCK * BLOCK],
                |similarity, (at, (to_block, to_partner))| {
                    vectorised(Meeting {
                        block: &blocks[at],
                        partner: &blocks[(at + distance) % n_blocks],
                        kappa,
                        similarity,
                        to_block,
                        to_partner: (distance > 0).then_some(to_partner),
                    });
                },
            );
    }
    from_previous.rotate_right(n_blocks / 2);
    [from_next, from_previous]
}

/// Some rows, ready for products with those of other blocks.
struct Block<'a> {
    n_rows: usize,
    /// `[row, dim]`.
    rows: &'a [f32],
    /// The transpose of the rows: `[dim, row]`.
    keys: Panels,
    /// The rows times their multiplicities, without the last columns that do not fill a lane: `[row, wide]`.
    wide: Vec<f32>,
    /// The same numbers.
    wide_panels: Panels,
    /// The last columns of the rows times their multiplicities: `[dim - wide, row]`.
    narrow: Vec<f32>,
}

impl<'a> Block<'a> {
    /// # Shapes
    /// - rows: `[row, dim]`
    /// - multiplicity: `[row]`
    fn new(rows: &'a [f32], dim: usize, multiplicity: &[u32]) -> Self {
        let n_rows = multiplicity.len();
        let n_wide = dim / LANES * LANES;
        let mut wide = Vec::with_capacity(n_rows * n_wide);
        let mut narrow = vec![0.0; n_rows * (dim - n_wide)];
        for (at, (row, &m)) in rows.chunks_exact(dim).zip(multiplicity).enumerate() {
            let (row, rest) = row.split_at(n_wide);
            wide.extend(row.iter().map(|x| x * m as f32));
            for (column, x) in narrow.chunks_exact_mut(n_rows).zip(rest) {
                column[at] = x * m as f32;
            }
        }
        Self {
            n_rows,
            rows,
            keys: Panels::of_transpose(rows, dim, n_rows),
            wide_panels: Panels::of(&wide, n_rows, n_wide),
            wide,
            narrow,
        }
    }

    fn no_sums(&self) -> Sums {
        Sums {
            wide: vec![0.0; self.wide.len()],
            narrow: vec![0.0; self.narrow.len()],
        }
    }
}

/// Sums of weighted rows, one for each row of a block, with the shapes of its `wide` and `narrow`.
#[derive(Clone)]
struct Sums {
    wide: Vec<f32>,
    narrow: Vec<f32>,
}

/// The sums of two blocks that meet, or of a block that meets itself.
struct Meeting<'a> {
    block: &'a Block<'a>,
    partner: &'a Block<'a>,
    kappa: f32,
    /// At least `[row of the block, row of the partner]`, overwritten.
    similarity: &'a mut [f32],
    to_block: &'a mut Sums,
    /// `None` if a block meets itself.
    to_partner: Option<&'a mut Sums>,
}

impl Kernel for Meeting<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { block, partner, .. } = self;
        let similarity = &mut self.similarity[..block.n_rows * partner.n_rows];
        multiply(block.rows, &partner.keys, &[], similarity);
        for row in similarity.chunks_exact_mut(partner.n_rows) {
            exponentials(row, self.kappa, self.kappa);
        }
        add_weighted_rows(similarity, partner, self.to_block);
        if let Some(to_partner) = self.to_partner {
            add_transposed_weighted_rows(similarity, block, to_partner);
        }
    }
}

/// Adds the rows of a block, weighted by the rows of `similarity`.
///
/// # Shapes
/// - similarity: `[sum, row of the block]`
#[inline(always)]
fn add_weighted_rows(similarity: &[f32], block: &Block<'_>, sums: &mut Sums) {
    add_product(similarity, &block.wide_panels, &mut sums.wide);
    let n_sums = similarity.len() / block.n_rows;
    let columns = block.narrow.chunks_exact(block.n_rows);
    for (sums, column) in sums.narrow.chunks_exact_mut(n_sums).zip(columns) {
        for (sum, row) in sums.iter_mut().zip(similarity.chunks_exact(block.n_rows)) {
            *sum += lane_sum(row, column, |x, y| x * y);
        }
    }
}

/// Adds the rows of a block, weighted by the columns of `similarity`.
///
/// # Shapes
/// - similarity: `[row of the block, sum]`
#[inline(always)]
fn add_transposed_weighted_rows(similarity: &[f32], block: &Block<'_>, sums: &mut Sums) {
    let n_sums = similarity.len() / block.n_rows;
    let n_wide = block.wide_panels.n_columns();
    let pairs = RowPairs {
        a: similarity,
        b: &block.wide,
        widths: [n_sums, n_wide],
    };
    add_outer_products(pairs, [n_sums, n_wide], &mut sums.wide);
    let columns = block.narrow.chunks_exact(block.n_rows);
    for (sums, column) in sums.narrow.chunks_exact_mut(n_sums).zip(columns) {
        for (row, &x) in similarity.chunks_exact(n_sums).zip(column) {
            for (sum, &weight) in sums.iter_mut().zip(row) {
                *sum = weight.mul_add(x, *sum);
            }
        }
    }
}

/// Adds the product of a matrix and panels.
///
/// # Shapes
/// - x: `[row, depth]`
/// - panels: `[depth, column]`
/// - sum: `[row, column]`
#[inline(always)]
fn add_product(x: &[f32], panels: &Panels, sum: &mut [f32]) {
    let (depth, width) = (panels.depth(), panels.n_columns());
    for (columns, panel) in panels.iter() {
        let n_rows = x.len() / depth;
        let mut row = 0;
        while row + ROWS <= n_rows {
            let lanes = tile::<ROWS>(
                rows_of(&x[row * depth..], depth),
                panel,
                [[0.0; LANES]; ROWS],
            );
            for (at, lane) in lanes.iter().enumerate() {
                add(lane, &mut sum[(row + at) * width..][columns.clone()]);
            }
            row += ROWS;
        }
        while row < n_rows {
            let [lane] = tile::<1>(rows_of(&x[row * depth..], depth), panel, [[0.0; LANES]]);
            add(&lane, &mut sum[row * width..][columns.clone()]);
            row += 1;
        }
    }
}

/// Adds up the sums of a block's rows and scales them to length 1.
///
/// # Shapes
/// - shifted: `[row, dim]`
fn write_directions(sums: [&Sums; 2], dim: usize, shifted: &mut [f32]) {
    let n_wide = dim / LANES * LANES;
    let n_rows = shifted.len() / dim;
    for (at, row) in shifted.chunks_exact_mut(dim).enumerate() {
        for Sums { wide, narrow } in sums {
            let columns = narrow.chunks_exact(n_rows).map(|column| &column[at]);
            let sums = wide[at * n_wide..][..n_wide].iter().chain(columns);
            row.iter_mut().zip(sums).for_each(|(x, sum)| *x += sum);
        }
        let length = lane_sum(row, row, |x, y| x * y).sqrt();
        // A row of zeros is the mean of rows that cancel each other. It does not change.
        let inverse = if length > 0.0 { 1.0 / length } else { 0.0 };
        row.iter_mut().for_each(|x| *x *= inverse);
    }
}
