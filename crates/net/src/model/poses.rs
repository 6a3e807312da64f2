//! Embeds a shape in several poses and joins the embeddings of each token.
//!
//! A sample goes in, its tokens and one unit row per token come out. The poses are fixed rotations that map the axes onto each
//! other. In another pose, the cells of the grid and the order of the curves differ, so each pose gives additional information.
//! Nothing here is random or trained.

use super::{EmbedError, Model, unit_rows};
use crate::config::TokenConfig;
use crate::data::pose::Pose;
use crate::data::tokens::{TokenizeError, Tokens, tokenize, tokenize_posed};
use partprobe_carrier::{Embeddings, PointSample};

/// The reason why a sample has no embeddings.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EmbedSampleError {
    /// The points cannot be grouped into tokens.
    #[error(transparent)]
    Tokens(#[from] TokenizeError),
    /// The network cannot embed the tokens.
    #[error(transparent)]
    Embed(#[from] EmbedError),
}

impl Model {
    /// The tokens of a sample, and one unit row per token: its concatenated embeddings in `tokens.test_poses` poses. Each pose
    /// has its own tokens. The embedding of a token in another pose is the mean over the token's points.
    ///
    /// # Shapes
    /// - embeddings: `[token, test_poses × embedding_dim]`
    ///
    /// # Errors
    /// If the points cannot be grouped into tokens, no thread can be started, or the weights make numbers that are not finite.
    pub fn embed_sample(
        &self,
        sample: &PointSample,
        config: &TokenConfig,
    ) -> Result<(Tokens, Embeddings), EmbedSampleError> {
        let tokens = tokenize(sample, config.test_tokens, config.voxels)?;
        let first = self.embed(&tokens)?;
        if config.test_poses == 1 {
            return Ok((tokens, first));
        }

        let mut by_pose = vec![first.values().to_vec()];
        for pose in Pose::spread(config.test_poses).into_iter().skip(1) {
            let posed = tokenize_posed(sample, config.test_tokens, config.voxels, &pose)?;
            let embeddings = self.embed(&posed)?;
            by_pose.push(means_over_points(&tokens, &posed, &embeddings));
        }
        let joined = side_by_side(&by_pose, tokens.n(), first.dim());
        let dim = config.test_poses * first.dim();
        let embeddings = Embeddings::new(dim, unit_rows(joined, dim));
        Ok((tokens, embeddings.map_err(|_| EmbedError::NotFinite)?))
    }
}

/// For each of `tokens`, the unit mean of the embeddings of its points in another pose.
fn means_over_points(tokens: &Tokens, posed: &Tokens, embeddings: &Embeddings) -> Vec<f32> {
    let dim = embeddings.dim();
    let mut sums = vec![0.0; tokens.n() * dim];
    let pairs = tokens.token_of_point.iter().zip(&posed.token_of_point);
    for (&token, &other) in pairs {
        let sum = &mut sums[token as usize * dim..][..dim];
        for (sum, x) in sum.iter_mut().zip(embeddings.row(other as usize)) {
            *sum += x;
        }
    }
    unit_rows(sums, dim)
}

/// The rows of all matrices, concatenated by index.
fn side_by_side(matrices: &[Vec<f32>], n_rows: usize, dim: usize) -> Vec<f32> {
    let rows = (0..n_rows).flat_map(|row| {
        let each = matrices.iter();
        each.flat_map(move |matrix| &matrix[row * dim..(row + 1) * dim])
    });
    rows.copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Backend;
    use crate::testing::{labeled_box, net};

    fn embedded(test_poses: usize) -> (Tokens, Embeddings) {
        let model = Model::init(&net(), 1, Backend::Flex).unwrap();
        let config = TokenConfig {
            test_tokens: 60,
            test_poses,
            ..TokenConfig::default()
        };
        let sample = labeled_box(2.0, 900).sample;
        model.embed_sample(&sample, &config).unwrap()
    }

    #[test]
    fn one_pose_is_the_plain_embedding() {
        let model = Model::init(&net(), 1, Backend::Flex).unwrap();
        let (tokens, embeddings) = embedded(1);
        assert_eq!(model.embed(&tokens).unwrap(), embeddings);
    }

    #[test]
    fn rows_of_poses_are_concatenated_and_share_the_unit_length() {
        let (tokens, one) = embedded(1);
        let (same, three) = embedded(3);
        assert_eq!(tokens, same);
        assert_eq!([three.n_rows(), three.dim()], [tokens.n(), 3 * one.dim()]);

        for (plain, joined) in one.rows().zip(three.rows()) {
            let length = |row: &[f32]| row.iter().map(|x| x * x).sum::<f32>().sqrt();
            assert!((length(joined) - 1.0).abs() < 1e-5);
            // Each pose has an equal fraction of the squared length.
            for own in joined.chunks(one.dim()) {
                assert!((length(own) - 3f32.sqrt().recip()).abs() < 1e-4);
            }
            let first = joined[..one.dim()].iter().map(|x| x * 3f32.sqrt());
            assert!(first.zip(plain).all(|(a, b)| (a - b).abs() < 1e-4));
        }
    }
}
