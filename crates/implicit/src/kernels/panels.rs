//! Multiplies rows by a matrix that is cut into panels of 16 columns.

use super::{LANES, Lane};

/// Rows of a tile: with four lanes of 16 numbers each, a processor with 32 wide registers holds all of its sums. With one
/// lane, a processor with 16 registers of 8 numbers does.
const ROWS: usize = 6;

/// A matrix that is cut into panels of 16 columns. Each panel is stored row by row, and the last one is padded with zeros.
#[derive(Clone, Debug, Default)]
pub(crate) struct Panels {
    depth: usize,
    n_columns: usize,
    values: Vec<Lane>,
}

impl Panels {
    /// Takes the row-major matrix `[depth, n_columns]`.
    pub(crate) fn set(&mut self, matrix: &[f32], depth: usize, n_columns: usize) {
        self.reset(depth, n_columns);
        let panels = self.values.chunks_exact_mut(depth.max(1));
        for (first, panel) in (0..n_columns).step_by(LANES).zip(panels) {
            let width = LANES.min(n_columns - first);
            for (lane, row) in panel.iter_mut().zip(matrix.chunks_exact(n_columns)) {
                lane[..width].copy_from_slice(&row[first..first + width]);
            }
        }
    }

    /// Takes the transpose of the row-major matrix `[n_columns, depth]`.
    pub(crate) fn set_transpose(&mut self, matrix: &[f32], depth: usize, n_columns: usize) {
        self.reset(depth, n_columns);
        let panels = self.values.chunks_exact_mut(depth.max(1));
        for (rows, panel) in matrix.chunks(LANES * depth.max(1)).zip(panels) {
            for (column, row) in rows.chunks_exact(depth.max(1)).enumerate() {
                for (lane, &x) in panel.iter_mut().zip(row) {
                    lane[column] = x;
                }
            }
        }
    }

    fn reset(&mut self, depth: usize, n_columns: usize) {
        let n_lanes = depth * n_columns.div_ceil(LANES);
        if self.depth != depth || self.n_columns != n_columns || self.values.len() != n_lanes {
            *self = Self {
                depth,
                n_columns,
                values: vec![[0.0; LANES]; n_lanes],
            };
        }
    }

    fn panel(&self, index: usize) -> &[Lane] {
        &self.values[index * self.depth..][..self.depth]
    }
}

/// `y = x · panels + bias`. An empty bias means that there is none.
///
/// # Shapes
/// - x: `[row, depth]`
/// - bias: `[n_columns]`
/// - y: `[row, n_columns]`
#[inline(always)]
pub(crate) fn multiply<const LANES_AT_ONCE: usize>(
    x: &[f32],
    panels: &Panels,
    bias: &[f32],
    y: &mut [f32],
) {
    let n_panels = panels.n_columns.div_ceil(LANES);
    let mut first = 0;
    while first + LANES_AT_ONCE <= n_panels {
        columns::<LANES_AT_ONCE>(x, panels, bias, first, y);
        first += LANES_AT_ONCE;
    }
    while first < n_panels {
        columns::<1>(x, panels, bias, first, y);
        first += 1;
    }
}

/// The columns of C panels, for all rows.
#[inline(always)]
fn columns<const C: usize>(x: &[f32], panels: &Panels, bias: &[f32], first: usize, y: &mut [f32]) {
    let (depth, width) = (panels.depth, panels.n_columns);
    let mut start = [[0.0; LANES]; C];
    let mut of_panel: [&[Lane]; C] = [&[]; C];
    for c in 0..C {
        of_panel[c] = panels.panel(first + c);
        for (at, &x) in start[c]
            .iter_mut()
            .zip(bias.iter().skip((first + c) * LANES))
        {
            *at = x;
        }
    }
    let room = width - first * LANES;
    let mut x_tiles = x.chunks_exact(ROWS * depth);
    let mut y_tiles = y.chunks_exact_mut(ROWS * width);
    for (x, y) in (&mut x_tiles).zip(&mut y_tiles) {
        six_rows(x, of_panel, &start, &mut y[first * LANES..], [width, room]);
    }
    let rest = x_tiles.remainder().chunks_exact(depth);
    for (x, y) in rest.zip(y_tiles.into_remainder().chunks_exact_mut(width)) {
        one_row(x, of_panel, &start, &mut y[first * LANES..], [width, room]);
    }
}

/// Defines the product of some rows and the columns of C panels. The sums of each row are a separate variable. With an array of
/// all sums, the compiler would write each change to memory.
macro_rules! tile_of {
    ($name:ident, $n_rows:literal, $($sums:ident = $row:literal),+) => {
        #[inline(always)]
        fn $name<const C: usize>(
            x: &[f32],
            panels: [&[Lane]; C],
            start: &[Lane; C],
            y: &mut [f32],
            [width, room]: [usize; 2],
        ) {
            let depth = x.len() / $n_rows;
            $(let mut $sums = *start;)+
            for k in 0..depth {
                let mut b = [[0.0; LANES]; C];
                for c in 0..C {
                    b[c] = panels[c][k];
                }
                $($sums = scaled_sum(x[$row * depth + k], &b, $sums);)+
            }
            $(store(&$sums, &mut y[$row * width..][..room]);)+
        }
    };
}

tile_of!(six_rows, 6, a = 0, b_ = 1, c_ = 2, d = 3, e = 4, f = 5);
tile_of!(one_row, 1, a = 0);

/// `sums + a · b`.
#[inline(always)]
pub(super) fn scaled_sum<const C: usize>(a: f32, b: &[Lane; C], mut sums: [Lane; C]) -> [Lane; C] {
    for c in 0..C {
        for lane in 0..LANES {
            sums[c][lane] = a.mul_add(b[c][lane], sums[c][lane]);
        }
    }
    sums
}

/// Writes as many numbers as fit into `target`. Whole lanes are written without a function call.
#[inline(always)]
fn store<const C: usize>(sums: &[Lane; C], target: &mut [f32]) {
    for (c, lane) in sums.iter().enumerate() {
        let Some(target) = target.get_mut(c * LANES..) else {
            return;
        };
        match target.first_chunk_mut::<LANES>() {
            Some(target) => *target = *lane,
            None => {
                for (target, x) in target.iter_mut().zip(lane) {
                    *target = *x;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{Kernel, vectorized};
    use crate::testing::numbers;

    struct Product<'a>(&'a [f32], &'a Panels, &'a [f32], &'a mut [f32]);

    impl Kernel for Product<'_> {
        #[inline(always)]
        fn run<const N: usize>(self) {
            multiply::<N>(self.0, self.1, self.2, self.3);
        }
    }

    #[track_caller]
    fn check(n: usize, depth: usize, width: usize) {
        let (x, w, bias) = (
            numbers(n * depth, "x"),
            numbers(depth * width, "w"),
            numbers(width, "b"),
        );
        let at = |row: usize, column: usize| {
            let terms = (0..depth)
                .map(|k| f64::from(x[row * depth + k]) * f64::from(w[k * width + column]));
            terms.sum::<f64>() + f64::from(bias[column])
        };
        let transposed: Vec<f32> = (0..width * depth)
            .map(|i| w[i % depth * width + i / depth])
            .collect();
        for is_transposed in [false, true] {
            let mut panels = Panels::default();
            match is_transposed {
                false => panels.set(&w, depth, width),
                true => panels.set_transpose(&transposed, depth, width),
            }
            let mut y = vec![0.0; n * width];
            vectorized(Product(&x, &panels, &bias, &mut y));
            for (i, &found) in y.iter().enumerate() {
                let expected = at(i / width, i % width);
                assert!(
                    (f64::from(found) - expected).abs() < 1e-4,
                    "{i}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn products_are_right_for_all_remainders() {
        for (n, depth, width) in [
            (1, 1, 1),
            (6, 3, 64),
            (13, 64, 3),
            (7, 5, 80),
            (14, 9, 67),
            (96, 128, 128),
        ] {
            check(n, depth, width);
        }
    }
}
