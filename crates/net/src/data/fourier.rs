//! Computes random Fourier features of tokens. They are a baseline without a network, with as many numbers as an embedding.
//!
//! The features are those of Rahimi and Recht 2007, "Random features for large-scale kernel machines": the scalar product of two
//! rows is about exp(−σ² d² / 2), where d is the distance between the tokens, computed from half of their positions and from
//! their normals.

use super::jitter::standard_normal;
use super::tokens::Tokens;
use partprobe_carrier::{Embeddings, keyed_rng};

/// σ, the standard deviation of the frequencies: normals 30° apart have a product of about 0.3.
const SIGMA: f64 = 3.0;
/// Each frequency gives a cosine and a sine.
const N_FREQUENCIES: usize = 64;

impl Tokens {
    /// 128 random Fourier features of half the position and the normal of each token, as unit rows.
    ///
    /// The frequencies depend only on the seed, so they are the same for all shapes.
    #[must_use]
    pub fn fourier_rows(&self, seed: u64) -> Embeddings {
        let geometry = self.geometry_rows();
        let mut rng = keyed_rng(seed, &["random-fourier"]);
        let frequencies: Vec<Vec<f64>> = (0..N_FREQUENCIES)
            .map(|_| {
                (0..geometry.dim())
                    .map(|_| SIGMA * standard_normal(&mut rng))
                    .collect()
            })
            .collect();
        let scale = 1.0 / (N_FREQUENCIES as f64).sqrt();
        let rows = geometry.rows().map(|row| {
            let mut features = [0.0; 2 * N_FREQUENCIES];
            for (idx, frequency) in frequencies.iter().enumerate() {
                let angle: f64 = row
                    .iter()
                    .zip(frequency)
                    .map(|(&x, w)| f64::from(x) * w)
                    .sum();
                features[2 * idx] = (scale * angle.cos()) as f32;
                features[2 * idx + 1] = (scale * angle.sin()) as f32;
            }
            features
        });
        Embeddings::from_rows(rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Voxels;
    use crate::data::tokens::tokenize;
    use crate::testing::labeled_box;

    #[test]
    fn products_are_about_those_of_the_kernel() {
        let tokens = tokenize(&labeled_box(2.0, 900).sample, 60, Voxels::NormalKeyed).unwrap();
        let (geometry, features) = (tokens.geometry_rows(), tokens.fourier_rows(1));
        let product = |a: &[f32], b: &[f32]| -> f64 {
            a.iter().zip(b).map(|(&x, &y)| f64::from(x * y)).sum()
        };
        let mut error = 0.0;
        let mut n_pairs = 0.0;
        for (g, f) in geometry.rows().zip(features.rows()) {
            assert!((product(f, f) - 1.0).abs() < 1e-5);
            for (h, e) in geometry.rows().zip(features.rows()) {
                let squared: f64 = g
                    .iter()
                    .zip(h)
                    .map(|(&x, &y)| f64::from(x - y).powi(2))
                    .sum();
                error += (product(f, e) - (-0.5 * SIGMA * SIGMA * squared).exp()).powi(2);
                n_pairs += 1.0;
            }
        }
        // The standard deviation of a product is at most about 1 / √64.
        let deviation = f64::sqrt(error / n_pairs);
        assert!(deviation < 0.125, "{deviation}");
        assert_eq!(features, tokens.fourier_rows(1));
        assert_ne!(features, tokens.fourier_rows(2));
    }
}
