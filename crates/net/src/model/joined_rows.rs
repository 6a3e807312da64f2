//! Joins the rows of a mean shift that have met, so that later steps move fewer rows.
//!
//! Rows with multiplicities go in. Rows that are nearly equal become one row that has the sum of their multiplicities: it pulls
//! the others as they did together, and moves as each of them would have moved. In the end, every row gets the place of the row
//! that it was joined to.

use crate::kernels::fused::mean_shift_step;
use partprobe_carrier::{keyed_rng, unit_interval};

/// Rows of length 1 that differ by at most this distance are joined. The rounding of a step is a tenth of it.
const JOINED: f64 = 1e-5;

/// The moving rows of a mean shift, and the rows that each of them stands for.
pub(super) struct JoinedRows {
    dim: usize,
    /// `[joined row, dim]`.
    values: Vec<f32>,
    /// `[joined row]`.
    multiplicity: Vec<u32>,
    /// For each row of the beginning, its joined row.
    joined_row: Vec<u32>,
}

impl JoinedRows {
    /// Rows of which none is joined.
    ///
    /// # Shapes
    /// - values: `[row, dim]`, of length 1
    /// - multiplicity: `[row]`
    pub(super) fn new(values: Vec<f32>, dim: usize, multiplicity: &[u32]) -> Self {
        Self {
            dim,
            values,
            multiplicity: multiplicity.to_vec(),
            joined_row: (0..multiplicity.len() as u32).collect(),
        }
    }

    /// Moves all rows by one step of mean shift, and joins those that have met.
    pub(super) fn step(&mut self, kappa: f32) {
        self.values = mean_shift_step(&self.values, self.dim, &self.multiplicity, kappa);
        self.join();
    }

    /// The rows of the beginning at their present places, each passed through `finished`, which gives as many numbers for every
    /// row.
    ///
    /// # Shapes
    /// - output: `[row, numbers of a finished row]`
    pub(super) fn into_values(self, finished: impl Fn(&[f32]) -> Vec<f32>) -> Vec<f32> {
        let rows: Vec<Vec<f32>> = self.values.chunks_exact(self.dim).map(finished).collect();
        let of_row = |&row: &u32| &rows[row as usize];
        self.joined_row.iter().flat_map(of_row).copied().collect()
    }

    /// Each row joins the first row, in the order of their projections, that is near enough. Rows that are near each other have
    /// near projections, so only few pairs are compared.
    fn join(&mut self) {
        let projections = self.projections();
        let mut order: Vec<u32> = (0..self.multiplicity.len() as u32).collect();
        order.sort_by(|&a, &b| {
            let [of_a, of_b] = [a, b].map(|row| projections[row as usize]);
            of_a.total_cmp(&of_b).then(a.cmp(&b))
        });

        let mut first_of: Vec<u32> = (0..order.len() as u32).collect();
        let mut first_rows: Vec<u32> = Vec::new();
        let mut n_passed = 0;
        for &row in &order {
            let least = projections[row as usize] - JOINED;
            while n_passed < first_rows.len() && projections[first_rows[n_passed] as usize] < least
            {
                n_passed += 1;
            }
            let near = first_rows[n_passed..]
                .iter()
                .find(|&&first| self.squared_distance(first, row) <= JOINED * JOINED);
            match near {
                Some(&first) => first_of[row as usize] = first,
                None => first_rows.push(row),
            }
        }
        // The rows keep their order, on which the sums of a step depend.
        first_rows.sort_unstable();
        self.keep(&first_rows, &first_of);
    }

    /// Keeps these rows. `first_of` has one of them for each row.
    fn keep(&mut self, kept: &[u32], first_of: &[u32]) {
        if kept.len() == first_of.len() {
            return;
        }
        let mut place = vec![0; first_of.len()];
        for (idx, &row) in kept.iter().enumerate() {
            place[row as usize] = idx as u32;
        }
        let place_of = |row: u32| place[first_of[row as usize] as usize];
        let mut multiplicity = vec![0; kept.len()];
        for (row, &m) in self.multiplicity.iter().enumerate() {
            multiplicity[place_of(row as u32) as usize] += m;
        }
        let row = |&row: &u32| row_of(&self.values, self.dim, row);
        self.values = kept.iter().flat_map(row).copied().collect();
        self.multiplicity = multiplicity;
        for joined in &mut self.joined_row {
            *joined = place_of(*joined);
        }
    }

    /// The coordinate of each row along a fixed direction of length 1.
    fn projections(&self) -> Vec<f64> {
        let mut rng = keyed_rng(0, &["mean shift"]);
        let direction: Vec<f64> = (0..self.dim)
            .map(|_| unit_interval(&mut rng) - 0.5)
            .collect();
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        let along = |row: &[f32]| {
            let products = row.iter().zip(&direction).map(|(&x, d)| f64::from(x) * d);
            products.sum::<f64>() / length
        };
        self.values.chunks_exact(self.dim).map(along).collect()
    }

    fn squared_distance(&self, a: u32, b: u32) -> f64 {
        let [a, b] = [a, b].map(|row| row_of(&self.values, self.dim, row));
        let differences = a.iter().zip(b).map(|(&x, &y)| f64::from(x) - f64::from(y));
        differences.map(|x| x * x).sum()
    }
}

fn row_of(values: &[f32], dim: usize, row: u32) -> &[f32] {
    &values[row as usize * dim..][..dim]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of two numbers at these angles, in degrees, after rows that are equal have joined.
    fn joined(degrees: &[f64]) -> JoinedRows {
        let at = |degrees: &f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            [cos as f32, sin as f32]
        };
        let values = degrees.iter().flat_map(at).collect();
        let mut rows = JoinedRows::new(values, 2, &vec![3; degrees.len()]);
        rows.join();
        rows
    }

    #[test]
    fn rows_that_have_met_become_one() {
        for (degrees, multiplicity, joined_row) in [
            (&[10.0, 20.0, 30.0][..], &[3, 3, 3][..], &[0, 1, 2][..]),
            (&[10.0, 20.0, 10.0], &[6, 3], &[0, 1, 0]),
            (&[50.0, 50.0, 50.0], &[9], &[0, 0, 0]),
            // A ten-thousandth of a degree is less than the distance, and a hundredth is more.
            (&[50.0, 50.0001, 50.01], &[6, 3], &[0, 0, 1]),
        ] {
            let rows = joined(degrees);
            assert_eq!(rows.multiplicity, multiplicity, "{degrees:?}");
            assert_eq!(rows.joined_row, joined_row, "{degrees:?}");
            assert_eq!(rows.into_values(<[f32]>::to_vec).len(), 2 * degrees.len());
        }
    }

    #[test]
    fn rows_that_join_later_are_found_again() {
        let mut rows = joined(&[10.0, 40.0, 10.0, 40.0, 80.0]);
        assert_eq!(rows.multiplicity, [6, 6, 3]);
        rows.values = [rows.values[2..4].to_vec(), rows.values[2..].to_vec()].concat();
        rows.join();
        assert_eq!(rows.multiplicity, [12, 3]);
        assert_eq!(rows.joined_row, [0, 0, 0, 0, 1]);
    }
}
