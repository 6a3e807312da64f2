//! Clusters rows without knowing how many clusters there are: rows whose directions nearly agree are joined.
//!
//! It is meant for the output of a mean shift, which moves the rows of a part to one direction, its mode. Chains of joined
//! rows are one cluster. All pairs are compared: time is O(n² · dim).

use crate::clusterer::{Clusterer, ClustererFactory};
use crate::clusters::{ClusterError, Clusters};
use crate::distance::{product, unit_rows};
use partprobe_carrier::{Embeddings, Partition};

/// The entry of the list of clusterers.
pub(crate) const FACTORY: ClustererFactory = ClustererFactory {
    name: Modes::NAME,
    make: |_settings| Box::new(Modes),
};

/// Rows are joined if their cosine is at least this: their directions differ by at most 18°.
const LEAST_COSINE: f32 = 0.95;

/// The modes of a mean shift. The number of clusters is found, and the requested number is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Modes;

impl Modes {
    /// Its name in configs and tables. It finds the number of clusters itself.
    pub const NAME: &'static str = "modes";
}

impl Clusterer for Modes {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn cluster(
        &self,
        rows: &Embeddings,
        weights: &[u32],
        k: usize,
        _seed: u64,
        _key: &str,
    ) -> Result<Clusters, ClusterError> {
        Clusters::check_input(rows, weights, k)?;
        let dim = rows.dim();
        let unit = unit_rows(rows.values(), dim);
        let row = |index: usize| &unit[index * dim..(index + 1) * dim];

        let n_rows = rows.n_rows();
        let joined = (0..n_rows).flat_map(|own| {
            let earlier =
                (0..own).filter(move |&other| product(row(own), row(other)) >= LEAST_COSINE);
            earlier.map(move |other| [own as u32, other as u32])
        });
        let modes = Partition::from_joined_pairs(n_rows, joined);
        Ok(Clusters::numbered(modes.parts(), 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(angles_deg: &[f64], expected: &[u32]) {
        let rows = angles_deg.iter().map(|angle| {
            let (sine, cosine) = angle.to_radians().sin_cos();
            // The lengths of rows have no influence.
            [3.0 * cosine as f32, 3.0 * sine as f32]
        });
        let rows = Embeddings::from_rows(rows);
        let weights = vec![1; angles_deg.len()];
        let found = Modes.cluster(&rows, &weights, 7, 0, "").unwrap();
        assert_eq!(found.assignment, expected);
        assert_eq!(
            found.k_found,
            expected.iter().max().map_or(0, |&last| last as usize + 1)
        );
    }

    #[test]
    fn directions_that_nearly_agree_are_one_cluster() {
        check(&[0.0, 90.0, 10.0, 100.0, 200.0], &[0, 1, 0, 1, 2]);
        // A chain.
        check(&[0.0, 15.0, 30.0, 45.0], &[0, 0, 0, 0]);
        check(&[0.0, 20.0], &[0, 1]);
        check(&[], &[]);
    }
}
