//! Sums the outer products of pairs of rows. This gives the derivative of a loss by a matrix.

use super::panels::scaled_sum;
use super::{LANES, Lane};

/// Rows of a tile: with four lanes of 16 numbers, 16 sums keep both multipliers of a wide processor busy.
const ROWS: usize = 4;

/// `sum += xᵀ y`, added up over the rows in their order.
///
/// # Shapes
/// - x: `[row, n_rows]`
/// - y: `[row, n_columns]`, `n_columns` a multiple of 16, or 1
/// - sum: `[n_rows, n_columns]`
#[inline(always)]
pub(crate) fn add_outer_products<const LANES_AT_ONCE: usize>(
    x: &[f32],
    y: &[f32],
    [n_rows, n_columns]: [usize; 2],
    sum: &mut [f32],
) {
    let mut column = 0;
    while column + LANES_AT_ONCE * LANES <= n_columns {
        columns::<LANES_AT_ONCE>(x, y, [n_rows, n_columns], column, sum);
        column += LANES_AT_ONCE * LANES;
    }
    while column + LANES <= n_columns {
        columns::<1>(x, y, [n_rows, n_columns], column, sum);
        column += LANES;
    }
    if column < n_columns {
        for (x, y) in x.chunks_exact(n_rows).zip(y.chunks_exact(n_columns)) {
            for (&x, sum) in x.iter().zip(sum.chunks_exact_mut(n_columns)) {
                for (sum, &y) in sum[column..].iter_mut().zip(&y[column..]) {
                    *sum = x.mul_add(y, *sum);
                }
            }
        }
    }
}

#[inline(always)]
fn columns<const C: usize>(
    x: &[f32],
    y: &[f32],
    [n_rows, n_columns]: [usize; 2],
    column: usize,
    sum: &mut [f32],
) {
    let mut row = 0;
    while row + ROWS <= n_rows {
        four_rows::<C>(x, y, [n_rows, n_columns], [row, column], sum);
        row += ROWS;
    }
    while row < n_rows {
        one_row::<C>(x, y, [n_rows, n_columns], [row, column], sum);
        row += 1;
    }
}

/// Defines the sum of outer products for some rows and C lanes of columns. The sums of each row are a separate variable.
macro_rules! tile_of {
    ($name:ident, $n:literal, $($sums:ident = $row:literal),+) => {
        #[inline(always)]
        fn $name<const C: usize>(
            x: &[f32],
            y: &[f32],
            [n_rows, n_columns]: [usize; 2],
            [row, column]: [usize; 2],
            sum: &mut [f32],
        ) {
            $(let mut $sums = [[0.0; LANES]; C];)+
            for (x, y) in x.chunks_exact(n_rows).zip(y.chunks_exact(n_columns)) {
                let x = &x[row..][..$n];
                let (lanes, _) = y[column..].as_chunks::<LANES>();
                let lanes = &lanes[..C];
                let mut b: [Lane; C] = [[0.0; LANES]; C];
                for c in 0..C {
                    b[c] = lanes[c];
                }
                $($sums = scaled_sum(x[$row], &b, $sums);)+
            }
            $(add(&$sums, &mut sum[(row + $row) * n_columns + column..]);)+
        }
    };
}

tile_of!(four_rows, 4, a = 0, b_ = 1, c_ = 2, d = 3);
tile_of!(one_row, 1, a = 0);

#[inline(always)]
fn add<const C: usize>(sums: &[Lane; C], target: &mut [f32]) {
    let (target, _) = target.as_chunks_mut::<LANES>();
    for (target, sums) in target.iter_mut().zip(sums) {
        for lane in 0..LANES {
            target[lane] += sums[lane];
        }
    }
}

/// Adds each row to the sums.
///
/// # Shapes
/// - rows: `[row, column]`
/// - sums: `[column]`
#[inline(always)]
pub(crate) fn add_column_sums(rows: &[f32], sums: &mut [f32]) {
    for row in rows.chunks_exact(sums.len().max(1)) {
        for (sum, x) in sums.iter_mut().zip(row) {
            *sum += x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{Kernel, vectorized};
    use crate::testing::numbers;

    struct Outer<'a>(&'a [f32], &'a [f32], [usize; 2], &'a mut [f32]);

    impl Kernel for Outer<'_> {
        #[inline(always)]
        fn run<const N: usize>(self) {
            add_outer_products::<N>(self.0, self.1, self.2, self.3);
        }
    }

    #[track_caller]
    fn check(n: usize, [n_rows, n_columns]: [usize; 2]) {
        let (x, y) = (numbers(n * n_rows, "x"), numbers(n * n_columns, "y"));
        let mut sum = vec![1.0; n_rows * n_columns];
        vectorized(Outer(&x, &y, [n_rows, n_columns], &mut sum));
        for (i, &found) in sum.iter().enumerate() {
            let (row, column) = (i / n_columns, i % n_columns);
            let terms = (0..n)
                .map(|k| f64::from(x[k * n_rows + row]) * f64::from(y[k * n_columns + column]));
            let expected = 1.0 + terms.sum::<f64>();
            assert!(
                (f64::from(found) - expected).abs() < 1e-3,
                "{i}: {found} {expected}"
            );
        }
    }

    #[test]
    fn outer_products_are_right_for_all_remainders() {
        for (n, dims) in [
            (1, [1, 1]),
            (96, [3, 128]),
            (5, [128, 1]),
            (7, [6, 80]),
            (96, [64, 64]),
        ] {
            check(n, dims);
        }
    }
}
