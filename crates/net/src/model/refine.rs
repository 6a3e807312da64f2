//! Moves embeddings that are near each other together, as the last layer of a network.
//!
//! The embeddings of the tokens of one shape go in, and as many unit rows come out. The layer has no parameters: it is not
//! trained, and it uses neither labels nor the number of parts. It is not used in training.

use super::joined_rows::JoinedRows;
use super::row_span::RowSpan;
use crate::config::{ConfigError, ensure};
use partprobe_carrier::Embeddings;
use serde::{Deserialize, Serialize};

/// The layer after the embedding head.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum RefineConfig {
    /// Mean shift on the unit sphere: in each step every row moves to the mean of all rows, weighted by exp(κ (cosine − 1)) and
    /// by the number of points of a row. Rows that have met, up to a distance of 10⁻⁵, move as one from then on.
    MeanShift {
        /// κ, which determines how fast the influence of a row decreases with its angle. It is from 0.1 to 1000.
        kappa: f64,
        /// The number of steps, from 1 to 100.
        steps: usize,
    },
}

/// Rows that cannot be refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RefineError {
    /// There is not one multiplicity per row.
    #[error("{n_weights} multiplicities for {n_rows} rows")]
    Weights {
        /// How many multiplicities there are.
        n_weights: usize,
        /// How many rows there are.
        n_rows: usize,
    },
    /// A number is not finite.
    #[error("the embeddings hold a number that is not finite")]
    NotFinite,
}

impl Default for RefineConfig {
    /// The mean shift of the shipped configs.
    fn default() -> Self {
        Self::MeanShift {
            kappa: 20.0,
            steps: 8,
        }
    }
}

impl RefineConfig {
    /// The name of the layer in tables.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::MeanShift { .. } => "mean-shift",
        }
    }

    /// Refuses values that are out of range.
    ///
    /// # Errors
    /// If a value is out of its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        let Self::MeanShift { kappa, steps } = self;
        ensure(
            (0.1..=1000.0).contains(kappa),
            "net.refine.kappa",
            "must be from 0.1 to 1000",
        )?;
        ensure(
            (1..=100).contains(steps),
            "net.refine.steps",
            "must be from 1 to 100",
        )
    }

    /// The refined rows, each of length 1.
    ///
    /// `multiplicity` is the number of points of each row.
    ///
    /// # Shapes
    /// - rows and output: `[token, dim]`
    /// - multiplicity: `[token]`
    ///
    /// # Errors
    /// If there is not one multiplicity per row, or a number is not finite.
    pub fn refined(
        &self,
        rows: &Embeddings,
        multiplicity: &[u32],
    ) -> Result<Embeddings, RefineError> {
        if multiplicity.len() != rows.n_rows() {
            return Err(RefineError::Weights {
                n_weights: multiplicity.len(),
                n_rows: rows.n_rows(),
            });
        }
        if rows.values().iter().any(|x| !x.is_finite()) {
            return Err(RefineError::NotFinite);
        }

        let Self::MeanShift { kappa, steps } = self;
        let dim = rows.dim();
        let unit_rows = super::unit_rows(rows.values().to_vec(), dim);
        let moved = |rows: Vec<f32>, dim: usize| {
            let mut moving = JoinedRows::new(rows, dim, multiplicity);
            for _ in 0..*steps {
                moving.step(*kappa as f32);
            }
            moving
        };
        let values = match RowSpan::of(&unit_rows, dim) {
            Some(span) => {
                let moved = moved(span.coordinates().to_vec(), span.rank());
                moved.into_values(|row| span.row(row))
            }
            None => moved(unit_rows, dim).into_values(<[f32]>::to_vec),
        };
        Embeddings::new(dim, values).map_err(|_| RefineError::NotFinite)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::{keyed_rng, unit_interval};
    use proptest::prelude::*;

    const LAYER: RefineConfig = RefineConfig::MeanShift {
        kappa: 20.0,
        steps: 8,
    };

    fn random_rows(n: usize, dim: usize, seed: u64) -> Embeddings {
        let mut rng = keyed_rng(seed, &["rows"]);
        let values = (0..n * dim)
            .map(|_| unit_interval(&mut rng) as f32 - 0.5)
            .collect();
        Embeddings::new(dim, crate::model::unit_rows(values, dim)).unwrap()
    }

    /// The result by definition, in double precision and with all pairs.
    fn dense(rows: &Embeddings, multiplicity: &[u32]) -> Vec<Vec<f64>> {
        let mut rows: Vec<Vec<f64>> = rows
            .rows()
            .map(|row| row.iter().map(|&x| f64::from(x)).collect())
            .collect();
        for _ in 0..8 {
            let shifted = rows.iter().map(|row| {
                let mut sum = vec![0.0; row.len()];
                for (other, &m) in rows.iter().zip(multiplicity) {
                    let cosine: f64 = row.iter().zip(other).map(|(a, b)| a * b).sum();
                    let weight = f64::from(m) * (20.0 * (cosine - 1.0)).exp();
                    sum.iter_mut()
                        .zip(other)
                        .for_each(|(s, x)| *s += weight * x);
                }
                let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
                sum.iter().map(|x| x / length).collect()
            });
            rows = shifted.collect();
        }
        rows
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn blocks_agree_with_the_definition(n in 1usize..230, dim in 1usize..40, seed: u64) {
            let rows = random_rows(n, dim, seed);
            let multiplicity: Vec<u32> = (0..n as u32).map(|i| 1 + i * 7 % 23).collect();
            let found = LAYER.refined(&rows, &multiplicity).unwrap();
            for (found, exact) in found.rows().zip(dense(&rows, &multiplicity)) {
                for (&x, y) in found.iter().zip(exact) {
                    prop_assert!((f64::from(x) - y).abs() < 2e-4, "{x} {y}");
                }
            }
        }

        #[test]
        fn rows_of_few_dimensions_give_what_the_definition_gives(n in 2usize..200, rank in 1usize..30, seed: u64) {
            let dim = 48;
            let (axes, factors) = (random_rows(rank, dim, seed), random_rows(n, rank, seed ^ 1));
            let combination = |factors: &[f32]| {
                let sum = |at: usize| axes.rows().zip(factors).map(|(axis, x)| axis[at] * x).sum::<f32>();
                (0..dim).map(sum).collect::<Vec<f32>>()
            };
            let values = factors.rows().flat_map(combination).collect();
            let rows = Embeddings::new(dim, crate::model::unit_rows(values, dim)).unwrap();
            let multiplicity: Vec<u32> = (0..n as u32).map(|i| 1 + i * 7 % 23).collect();
            let found = LAYER.refined(&rows, &multiplicity).unwrap();
            for (found, exact) in found.rows().zip(dense(&rows, &multiplicity)) {
                for (&x, y) in found.iter().zip(exact) {
                    prop_assert!((f64::from(x) - y).abs() < 2e-4, "{x} {y}");
                }
            }
        }

        #[test]
        fn rows_that_meet_give_what_the_definition_gives(n in 60usize..200, k in 1usize..6, spread in 0.01f32..0.6, seed: u64) {
            let (dim, centers) = (24, random_rows(k, 24, seed));
            let noise = random_rows(n, dim, seed ^ 1);
            let values = (0..n).flat_map(|row| {
                let center = centers.row(row % k).iter();
                center.zip(noise.row(row)).map(|(c, x)| c + spread * x).collect::<Vec<_>>()
            });
            let rows = Embeddings::new(dim, crate::model::unit_rows(values.collect(), dim)).unwrap();
            let multiplicity: Vec<u32> = (0..n as u32).map(|i| 1 + i * 7 % 23).collect();
            let found = LAYER.refined(&rows, &multiplicity).unwrap();
            for (found, exact) in found.rows().zip(dense(&rows, &multiplicity)) {
                for (&x, y) in found.iter().zip(exact) {
                    prop_assert!((f64::from(x) - y).abs() < 2e-4, "{x} {y}");
                }
            }
        }

        #[test]
        fn the_order_of_the_rows_does_not_matter(n in 2usize..120, seed: u64) {
            let rows = random_rows(n, 5, seed);
            let backward: Vec<f32> = rows.rows().rev().flatten().copied().collect();
            let backward = Embeddings::new(5, backward).unwrap();
            let forward = LAYER.refined(&rows, &vec![2; n]).unwrap();
            let backward = LAYER.refined(&backward, &vec![2; n]).unwrap();
            for (a, b) in forward.rows().zip(backward.rows().rev()) {
                prop_assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-4));
            }
        }
    }

    #[test]
    fn two_bundles_stay_separate_and_an_outlier_joins_one() {
        // 30 rows around one axis, 30 around the other, and one row between them that is nearer to the first.
        let at = |degrees: f32| [degrees.to_radians().cos(), degrees.to_radians().sin()];
        let mut rows: Vec<[f32; 2]> = (0..30).map(|i| at(i as f32 - 15.0)).collect();
        rows.extend((0..30).map(|i| at(90.0 + i as f32 - 15.0)));
        rows.push(at(40.0));
        let refined = LAYER
            .refined(&Embeddings::from_rows(rows), &[1; 61])
            .unwrap();
        let cosine = |a: usize, b: usize| -> f32 {
            refined
                .row(a)
                .iter()
                .zip(refined.row(b))
                .map(|(a, b)| a * b)
                .sum()
        };
        assert!((0..30).all(|row| cosine(0, row) > 0.999));
        assert!((30..60).all(|row| cosine(30, row) > 0.999));
        assert!(cosine(0, 30) < 0.2);
        assert!(cosine(0, 60) > 0.99);
    }

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let rows = random_rows(500, 128, 3);
        let multiplicity = vec![3; 500];
        let with = |n_threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(n_threads)
                .build()
                .unwrap();
            pool.install(|| LAYER.refined(&rows, &multiplicity).unwrap())
        };
        assert_eq!(with(1), with(4));
    }

    #[test]
    fn what_cannot_be_refined_is_refused() {
        let rows = Embeddings::from_rows([[1.0, 0.0], [0.0, 1.0]]);
        assert_eq!(
            LAYER.refined(&rows, &[1]),
            Err(RefineError::Weights {
                n_weights: 1,
                n_rows: 2
            })
        );
        let broken = Embeddings::from_rows([[f32::NAN, 0.0]]);
        assert_eq!(LAYER.refined(&broken, &[1]), Err(RefineError::NotFinite));
        let keys = |kappa: f64, steps: usize| {
            let layer = RefineConfig::MeanShift { kappa, steps };
            layer.check().err().map(|error| error.key)
        };
        assert_eq!(keys(20.0, 8), None);
        assert_eq!(keys(f64::NAN, 8), Some("net.refine.kappa"));
        assert_eq!(keys(20.0, 0), Some("net.refine.steps"));
    }
}
