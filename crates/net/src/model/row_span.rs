//! Finds the subspace that the rows of a matrix span, and writes the rows by their coordinates in it.
//!
//! An embedding head is an affine map, so embeddings of 128 numbers that it makes from 48 channels span at most 49 dimensions.
//! Whatever depends on the products of rows alone, as mean shift does, then has the same result on 49 coordinates per row. The
//! basis is found by Gram–Schmidt orthogonalization, which always takes the row with the longest remainder next.

use crate::kernels::fused::{Kernel, vectorised};
use rayon::prelude::*;

/// The length of a remainder that is rounding. Rows have length 1 and 24 bits.
const ROUNDING: f64 = 1e-6;
/// Coordinates are only worth their price if there are at most this many, as a fraction of the numbers of a row.
const MAX_FRACTION: f64 = 0.75;
/// The number of sums of a product.
const LANES: usize = 16;
/// The number of rows that a thread multiplies at a time.
const BLOCK: usize = 256;

/// Rows by their coordinates in the subspace that they span.
#[derive(Debug)]
pub(super) struct RowSpan {
    /// Vectors of length 1, orthogonal to each other: `[rank, dim]`.
    basis: Vec<Vec<f64>>,
    /// `[row, rank]`.
    coordinates: Vec<f32>,
}

impl RowSpan {
    /// The subspace of these rows. Returns `None` if it has more than three quarters as many dimensions as a row has numbers, or
    /// all rows are zero.
    ///
    /// # Shapes
    /// - rows: `[row, dim]`, of length 1 or 0
    pub(super) fn of(rows: &[f32], dim: usize) -> Option<Self> {
        let max_rank = (MAX_FRACTION * dim as f64) as usize;
        let mut basis: Vec<Vec<f64>> = Vec::new();
        // The coordinates along each vector of the basis.
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let squared_length = |row: &[f32]| row.iter().map(|&x| f64::from(x).powi(2)).sum();
        let mut squared_remainders: Vec<f64> = rows.chunks_exact(dim).map(squared_length).collect();

        while let Some(row) = longest_above_rounding(&squared_remainders) {
            if basis.len() == max_rank {
                return None;
            }
            let vector = orthogonal_direction(&rows[row * dim..][..dim], &basis);
            let column = products_with(&vector, rows);
            for (remainder, x) in squared_remainders.iter_mut().zip(&column) {
                *remainder -= x * x;
            }
            basis.push(vector);
            columns.push(column);
        }

        let of_row = |row: usize| columns.iter().map(move |column| column[row] as f32);
        let coordinates = (0..squared_remainders.len()).flat_map(of_row).collect();
        (!basis.is_empty()).then_some(Self { basis, coordinates })
    }

    /// The number of dimensions.
    pub(super) fn rank(&self) -> usize {
        self.basis.len()
    }

    /// The rows by their coordinates: `[row, rank]`.
    pub(super) fn coordinates(&self) -> &[f32] {
        &self.coordinates
    }

    /// The row with these coordinates.
    pub(super) fn row(&self, coordinates: &[f32]) -> Vec<f32> {
        let dim = self.basis.first().map_or(0, Vec::len);
        let mut row = vec![0.0; dim];
        for (&x, vector) in coordinates.iter().zip(&self.basis) {
            for (sum, y) in row.iter_mut().zip(vector) {
                *sum += f64::from(x) * y;
            }
        }
        row.iter().map(|&x| x as f32).collect()
    }
}

/// The row with the longest remainder, or `None` if all remainders are rounding.
fn longest_above_rounding(squared_remainders: &[f64]) -> Option<usize> {
    let mut longest = None;
    let mut most = ROUNDING * ROUNDING;
    for (row, &squared) in squared_remainders.iter().enumerate() {
        if squared > most {
            (longest, most) = (Some(row), squared);
        }
    }
    longest
}

/// The direction of a row's part that is orthogonal to a basis. It is orthogonalized twice, because the first difference of nearly
/// equal numbers has few correct digits.
fn orthogonal_direction(row: &[f32], basis: &[Vec<f64>]) -> Vec<f64> {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let mut direction: Vec<f64> = row.iter().map(|&x| f64::from(x)).collect();
    for vector in basis.iter().chain(basis) {
        let along = product(&direction, vector);
        for (x, y) in direction.iter_mut().zip(vector) {
            *x -= along * y;
        }
    }
    let length = product(&direction, &direction).sqrt();
    direction.iter().map(|x| x / length).collect()
}

/// The product of a vector with each row.
fn products_with(vector: &[f64], rows: &[f32]) -> Vec<f64> {
    let dim = vector.len();
    let mut products = vec![0.0; rows.len() / dim];
    products
        .par_chunks_mut(BLOCK)
        .zip(rows.par_chunks(BLOCK * dim))
        .for_each(|(products, rows)| {
            vectorised(Products {
                vector,
                rows,
                products,
            });
        });
    products
}

/// # Shapes
/// - vector: `[dim]`
/// - rows: `[row, dim]`
/// - products: `[row]`
struct Products<'a> {
    vector: &'a [f64],
    rows: &'a [f32],
    products: &'a mut [f64],
}

impl Kernel for Products<'_> {
    #[inline(always)]
    fn run(self) {
        let (vector_lanes, vector_rest) = self.vector.as_chunks::<LANES>();
        let rows = self.rows.chunks_exact(self.vector.len());
        for (product, row) in self.products.iter_mut().zip(rows) {
            let (row_lanes, row_rest) = row.as_chunks::<LANES>();
            let mut sums = [0.0f64; LANES];
            for (x, y) in row_lanes.iter().zip(vector_lanes) {
                for lane in 0..LANES {
                    sums[lane] = f64::from(x[lane]).mul_add(y[lane], sums[lane]);
                }
            }
            let mut sum = 0.0;
            for (&x, y) in row_rest.iter().zip(vector_rest) {
                sum = f64::from(x).mul_add(*y, sum);
            }
            for lane in sums {
                sum += lane;
            }
            *product = sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::{keyed_rng, unit_interval};

    fn random(n: usize, key: &str) -> Vec<f64> {
        let mut rng = keyed_rng(7, &[key]);
        (0..n).map(|_| unit_interval(&mut rng) - 0.5).collect()
    }

    /// Rows of length 1 that are combinations of `rank` random vectors.
    fn rows_of_rank(n: usize, dim: usize, rank: usize) -> Vec<f32> {
        let (vectors, factors) = (random(rank * dim, "vectors"), random(n * rank, "factors"));
        let combination = |factors: &[f64]| {
            (0..dim)
                .map(|at| {
                    let terms = factors.iter().enumerate();
                    terms
                        .map(|(idx, x)| x * vectors[idx * dim + at])
                        .sum::<f64>() as f32
                })
                .collect::<Vec<f32>>()
        };
        let rows = factors.chunks_exact(rank).flat_map(combination);
        crate::model::unit_rows(rows.collect(), dim)
    }

    #[track_caller]
    fn check(rows: &[f32], dim: usize, expected_rank: Option<usize>) {
        let span = RowSpan::of(rows, dim);
        assert_eq!(span.as_ref().map(RowSpan::rank), expected_rank);
        let Some(span) = span else {
            return;
        };
        let coordinates = span.coordinates().chunks_exact(span.rank());
        assert_eq!(coordinates.len(), rows.len() / dim);
        for (coordinates, row) in coordinates.zip(rows.chunks_exact(dim)) {
            for (x, y) in span.row(coordinates).iter().zip(row) {
                assert!((x - y).abs() < 2e-6, "{x} {y}");
            }
        }
        for (idx, a) in span.basis.iter().enumerate() {
            for (other, b) in span.basis.iter().enumerate() {
                let product: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
                let expected = f64::from(idx == other);
                assert!((product - expected).abs() < 1e-12, "{idx} {other}");
            }
        }
    }

    #[test]
    fn rows_are_their_coordinates_times_the_basis() {
        check(&rows_of_rank(300, 128, 49), 128, Some(49));
        check(&rows_of_rank(20, 128, 49), 128, Some(20));
        check(&rows_of_rank(700, 37, 1), 37, Some(1));
        check(&rows_of_rank(50, 8, 6), 8, Some(6));
    }

    #[test]
    fn rows_that_span_nearly_everything_or_nothing_keep_their_numbers() {
        check(&rows_of_rank(50, 8, 7), 8, None);
        check(&rows_of_rank(50, 1, 1), 1, None);
        check(&[0.0; 30], 10, None);
        check(&[], 10, None);
    }

    #[test]
    fn a_row_of_zeros_has_coordinates_of_zero() {
        let mut rows = rows_of_rank(9, 16, 3);
        rows[16..32].fill(0.0);
        check(&rows, 16, Some(3));
    }
}
