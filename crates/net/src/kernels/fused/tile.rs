//! Computes the two loops of which all matrix products here consist: a few rows times 16 columns, and a sum of outer products.
//!
//! The loops read slices and keep their sums in registers. Products and sums are fused, and the sum of each element always runs
//! in the same order, so a tile has the same bits on every processor.

use super::lanes::LANES;
use macerator::{AutoArch, Simd, WithSimd};

/// Number of rows of a tile. With two vectors of eight columns each, the sums fill the registers of a processor.
pub(super) const ROWS: usize = 6;
/// Number of rows that go through all steps of an operation before the next rows. They stay in the second-level cache.
pub(super) const CHUNK: usize = 8 * ROWS;
/// Number of pairs of rows whose outer products are summed in registers before the sum is added to memory. For all widths used
/// here, both factors stay in the first-level cache while all of their columns are processed.
pub(super) const OUTER_CHUNK: usize = 64;

/// Sixteen consecutive numbers.
pub(super) type Lane = [f32; LANES];

/// Work that is compiled once for each kind of vector unit. `run` and all functions that it calls must be `#[inline(always)]`.
pub(crate) trait Kernel {
    fn run(self);
}

struct VectorizedKernel<K>(K);

impl<K: Kernel> WithSimd for VectorizedKernel<K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self) {
        self.0.run();
    }
}

/// Runs the work with the widest vectors that this processor has.
pub(crate) fn vectorised(kernel: impl Kernel) {
    AutoArch::new().dispatch(VectorizedKernel(kernel));
}

/// A matrix, divided into panels of 16 columns. Each panel is stored row by row. The last one is filled up with zeros.
#[derive(Debug)]
pub(super) struct Panels {
    depth: usize,
    n_columns: usize,
    values: Vec<Lane>,
}

impl Panels {
    /// The panels of a row-major `[depth, n_columns]` matrix.
    pub(super) fn of(matrix: &[f32], depth: usize, n_columns: usize) -> Self {
        let mut values = vec![[0.0; LANES]; depth * n_columns.div_ceil(LANES)];
        for (first, panel) in (0..n_columns)
            .step_by(LANES)
            .zip(values.chunks_exact_mut(depth.max(1)))
        {
            let columns = first..(first + LANES).min(n_columns);
            for (lane, row) in panel.iter_mut().zip(matrix.chunks_exact(n_columns)) {
                lane[..columns.len()].copy_from_slice(&row[columns.clone()]);
            }
        }
        Self {
            depth,
            n_columns,
            values,
        }
    }

    /// The panels of the transpose of a row-major `[n_columns, depth]` matrix.
    pub(super) fn of_transpose(matrix: &[f32], depth: usize, n_columns: usize) -> Self {
        Self::of_transposes(matrix, 1, depth, n_columns)
    }

    /// The panels of the transposes of `n` row-major `[n_columns, depth]` matrices, one below the other.
    pub(super) fn of_transposes(
        matrices: &[f32],
        n: usize,
        depth: usize,
        n_columns: usize,
    ) -> Self {
        let mut values = vec![[0.0; LANES]; n * depth * n_columns.div_ceil(LANES)];
        for (at, matrix) in matrices
            .chunks_exact((depth * n_columns).max(1))
            .enumerate()
        {
            let panels = values.chunks_exact_mut((n * depth).max(1));
            for (rows, panel) in matrix.chunks(LANES * depth).zip(panels) {
                for (column, row) in rows.chunks_exact(depth).enumerate() {
                    for (lane, &x) in panel[at * depth..].iter_mut().zip(row) {
                        lane[column] = x;
                    }
                }
            }
        }
        Self {
            depth: n * depth,
            n_columns,
            values,
        }
    }

    pub(super) fn depth(&self) -> usize {
        self.depth
    }

    pub(super) fn n_columns(&self) -> usize {
        self.n_columns
    }

    /// Each panel with the range of its columns.
    #[inline(always)]
    pub(super) fn iter(&self) -> impl Iterator<Item = (std::ops::Range<usize>, &[Lane])> {
        let columns = (0..self.n_columns)
            .step_by(LANES)
            .map(|first| first..(first + LANES).min(self.n_columns));
        columns.zip(self.values.chunks_exact(self.depth.max(1)))
    }
}

/// `sums` plus the product of R rows and a panel.
///
/// # Shapes
/// - rows: `[R, depth]`
/// - panel: `[depth, 16]`
/// - sums and output: `[R, 16]`
#[inline(always)]
pub(super) fn tile<const R: usize>(
    mut rows: [&[f32]; R],
    panel: &[Lane],
    mut sums: [Lane; R],
) -> [Lane; R] {
    // Loops are used because the array's own methods are not inlined, and rows of known length because they need no bounds check.
    for row in &mut rows {
        *row = &row[..panel.len()];
    }
    for (k, b) in panel.iter().enumerate() {
        let b = *b;
        for r in 0..R {
            let a = rows[r][k];
            for c in 0..LANES {
                sums[r][c] = a.mul_add(b[c], sums[r][c]);
            }
        }
    }
    sums
}

/// Writes as many numbers as fit into `target`. A whole lane is written without a function call.
#[inline(always)]
fn store(lane: &Lane, target: &mut [f32]) {
    match target.first_chunk_mut::<LANES>() {
        Some(target) => *target = *lane,
        None => target
            .iter_mut()
            .zip(lane)
            .for_each(|(target, x)| *target = *x),
    }
}

/// Adds as many numbers as `target` has.
#[inline(always)]
pub(super) fn add(lane: &Lane, target: &mut [f32]) {
    match target.first_chunk_mut::<LANES>() {
        Some(target) => {
            for c in 0..LANES {
                target[c] += lane[c];
            }
        }
        None => target
            .iter_mut()
            .zip(lane)
            .for_each(|(target, x)| *target += x),
    }
}

/// Writes R rows of 16 sums to columns of R rows of `y`.
///
/// The loops have constant bounds. Otherwise the sums would be moved from registers to the stack first.
///
/// # Shapes
/// - sums: `[R, 16]`
/// - y: `[R, width]`, of which `columns` are written
#[inline(always)]
pub(super) fn store_tile<const R: usize>(
    sums: [Lane; R],
    y: &mut [f32],
    width: usize,
    columns: &std::ops::Range<usize>,
) {
    let y = &mut y[..R * width];
    if columns.len() == LANES {
        for r in 0..R {
            if let Some(target) = y[r * width + columns.start..].first_chunk_mut::<LANES>() {
                *target = sums[r];
            }
        }
    } else {
        for r in 0..R {
            let lane = sums[r];
            store(&lane, &mut y[r * width..][columns.clone()]);
        }
    }
}

/// Appends `n` zeros and returns them. Memory that is cleared just before it is filled is still in the cache.
#[inline(always)]
pub(super) fn extend_zeroed(y: &mut Vec<f32>, n: usize) -> &mut [f32] {
    let start = y.len();
    y.resize(start + n, 0.0);
    &mut y[start..]
}

/// The first R rows of a matrix.
///
/// # Shapes
/// - x: `[row, depth]`, at least R rows
/// - output: `[R, depth]`
#[inline(always)]
pub(super) fn rows_of<const R: usize>(x: &[f32], depth: usize) -> [&[f32]; R] {
    let mut rows = [&x[..0]; R];
    for (r, row) in rows.iter_mut().enumerate() {
        *row = &x[r * depth..][..depth];
    }
    rows
}

/// Pairs of rows whose outer products are summed.
///
/// An iterator would be called for each pair instead of being inlined, and the sums would be moved out of their registers for the
/// call.
pub(super) trait Pairs: Copy {
    /// How many pairs there are.
    fn len(self) -> usize;

    /// Both rows of a pair. It must be `#[inline(always)]`.
    fn rows(&self, at: usize) -> (&[f32], &[f32]);
}

/// Pairs of the rows of two matrices.
///
/// # Shapes
/// - a: `[row, width of a]`
/// - b: `[row, width of b]`
#[derive(Clone, Copy)]
pub(super) struct RowPairs<'a> {
    pub(super) a: &'a [f32],
    pub(super) b: &'a [f32],
    pub(super) widths: [usize; 2],
}

impl Pairs for RowPairs<'_> {
    #[inline(always)]
    fn len(self) -> usize {
        self.a.len() / self.widths[0].max(1)
    }

    #[inline(always)]
    fn rows(&self, at: usize) -> (&[f32], &[f32]) {
        let [a, b] = self.widths;
        (&self.a[at * a..][..a], &self.b[at * b..][..b])
    }
}

/// The sum of the outer products of R numbers beginning at `row` and 16 numbers beginning at `column`. The rows must be long
/// enough.
///
/// # Shapes
/// - output: `[R, 16]`
#[inline(always)]
fn outer_sum<const R: usize>(pairs: impl Pairs, [row, column]: [usize; 2]) -> [Lane; R] {
    let mut sums = [[0.0; LANES]; R];
    for at in 0..pairs.len() {
        let (a, b) = pairs.rows(at);
        let a = &a[row..][..R];
        let b = &b[column..][..LANES];
        for r in 0..R {
            let a = a[r];
            for c in 0..LANES {
                sums[r][c] = a.mul_add(b[c], sums[r][c]);
            }
        }
    }
    sums
}

/// Adds Σ aᵀb over pairs of rows to a matrix.
///
/// # Shapes
/// - pairs: `[n_rows]` and `[n_columns]`
/// - sum: `[n_rows, n_columns]`
#[inline(always)]
pub(super) fn add_outer_products(
    pairs: impl Pairs,
    [n_rows, n_columns]: [usize; 2],
    sum: &mut [f32],
) {
    let wide = n_columns / LANES * LANES;
    for column in (0..wide).step_by(LANES) {
        let mut row = 0;
        while row + ROWS <= n_rows {
            row = add_outer_tile::<ROWS>(pairs, [row, column], n_columns, sum);
        }
        while row + 2 <= n_rows {
            row = add_outer_tile::<2>(pairs, [row, column], n_columns, sum);
        }
        if row < n_rows {
            add_outer_tile::<1>(pairs, [row, column], n_columns, sum);
        }
    }
    if wide < n_columns {
        for at in 0..pairs.len() {
            let (a, b) = pairs.rows(at);
            for (&a, sum) in a[..n_rows].iter().zip(sum.chunks_exact_mut(n_columns)) {
                for (sum, &b) in sum[wide..].iter_mut().zip(&b[wide..n_columns]) {
                    *sum = a.mul_add(b, *sum);
                }
            }
        }
    }
}

/// Adds R rows and 16 columns of the sum of outer products. Returns the next row.
#[inline(always)]
fn add_outer_tile<const R: usize>(
    pairs: impl Pairs,
    [row, column]: [usize; 2],
    stride: usize,
    sum: &mut [f32],
) -> usize {
    let sums = outer_sum::<R>(pairs, [row, column]);
    let sum = &mut sum[row * stride..][..R * stride];
    for r in 0..R {
        add(&sums[r], &mut sum[r * stride + column..][..LANES]);
    }
    row + R
}

#[cfg(test)]
mod tests {
    use super::super::tests::numbers;
    use super::*;

    struct Both<'a> {
        x: &'a [f32],
        panels: &'a Panels,
        sum: &'a mut Vec<f32>,
    }

    impl Kernel for Both<'_> {
        #[inline(always)]
        fn run(self) {
            let depth = self.panels.depth();
            for (columns, panel) in self.panels.iter() {
                for row in self.x.chunks_exact(depth) {
                    let [lane] = tile([row], panel, [[0.5; LANES]]);
                    self.sum.extend_from_slice(&lane[..columns.len()]);
                }
            }
            let mut outer = vec![0.25; depth * depth];
            let pairs = RowPairs {
                a: self.x,
                b: self.x,
                widths: [depth, depth],
            };
            add_outer_products(pairs, [depth, depth], &mut outer);
            self.sum.append(&mut outer);
        }
    }

    /// On a processor without vectors of this width, the same code runs without their instructions.
    #[test]
    fn every_vector_unit_gives_the_same_bits() {
        for (n, depth, n_columns) in [(1, 1, 1), (7, 5, 16), (40, 33, 50)] {
            let x = numbers(n * depth, "x");
            let panels = Panels::of(&numbers(depth * n_columns, "w"), depth, n_columns);
            let (mut wide, mut plain) = (Vec::new(), Vec::new());
            vectorised(Both {
                x: &x,
                panels: &panels,
                sum: &mut wide,
            });
            Both {
                x: &x,
                panels: &panels,
                sum: &mut plain,
            }
            .run();
            assert_eq!(wide, plain);
            assert_eq!(wide.len(), n * n_columns + depth * depth);
        }
    }

    #[test]
    fn panels_of_a_transpose_hold_the_transpose() {
        let (depth, n_columns) = (3, 21);
        let matrix = numbers(depth * n_columns, "w");
        let transpose: Vec<f32> = (0..n_columns * depth)
            .map(|at| matrix[at % depth * n_columns + at / depth])
            .collect();
        let (straight, turned) = (
            Panels::of(&matrix, depth, n_columns),
            Panels::of_transpose(&transpose, depth, n_columns),
        );
        assert_eq!(straight.values, turned.values);
        assert_eq!(straight.values[0][..16], matrix[..16]);
        assert_eq!(straight.values[depth][5..], [0.0; 11]);
    }
}
