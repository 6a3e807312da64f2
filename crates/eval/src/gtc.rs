//! Scores embeddings by the nearest ground-truth centroid (GTc): how well the mean embeddings of the parts separate
//! the points, without any clustering.

use crate::confusion::{Confusion, ScoreError};
use crate::scores::shape_scores;
use partprobe_carrier::Embeddings;

/// The scores of the nearest ground-truth centroid.
///
/// The paper prints one number and does not say which of the two it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gtc {
    /// Fraction of the points whose nearest centroid is that of their own part.
    pub accuracy: f64,
    /// Mean IoU between the points of each part and the points whose nearest centroid is that of the part.
    pub miou: f64,
}

/// Assigns each point to the part whose mean direction has the largest cosine with the embedding of the point.
///
/// The embedding of a point is that of its token. Among equal cosines the lowest label wins. Points with negative labels
/// are ignored.
///
/// # Errors
/// If the lists differ in length, a token has no embedding, or the reference ignores every point.
pub fn gtc(
    embeddings: &Embeddings,
    token_of_point: &[u32],
    reference: &[i32],
) -> Result<Gtc, ScoreError> {
    ScoreError::check_tokens(token_of_point, embeddings.n_rows())?;
    let of_parts = Confusion::new(token_of_point, reference)?;
    let n_parts = of_parts.reference_ids().len();
    let directions: Vec<Vec<f64>> = (0..n_parts)
        .map(|part| part_direction(embeddings, &of_parts, part))
        .collect();

    let nearest: Vec<u32> = embeddings
        .rows()
        .map(|row| nearest_direction(row, &directions))
        .collect();
    let predicted: Vec<u32> = token_of_point
        .iter()
        .map(|&token| nearest[token as usize])
        .collect();

    let confusion = Confusion::new(&predicted, reference)?;
    let own_cluster: Vec<Option<usize>> = (0..n_parts as u32)
        .map(|part| confusion.predicted_ids().binary_search(&part).ok())
        .collect();
    let scores = shape_scores(&confusion, &own_cluster);
    Ok(Gtc {
        accuracy: scores.accuracy,
        miou: scores.miou,
    })
}

/// The direction of the mean embedding of a part; `of_parts` counts the points of the parts by token.
fn part_direction(embeddings: &Embeddings, of_parts: &Confusion, part: usize) -> Vec<f64> {
    let mut sum = vec![0.0; embeddings.dim()];
    for (column, &token) in of_parts.predicted_ids().iter().enumerate() {
        let count = of_parts.count(part, column);
        if count > 0 {
            for (sum, &x) in sum.iter_mut().zip(embeddings.row(token as usize)) {
                *sum += count as f64 * f64::from(x);
            }
        }
    }

    let norm = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
    if norm > 0.0 {
        sum.iter_mut().for_each(|x| *x /= norm);
    }
    sum
}

/// The index of the direction with the largest scalar product; the first of equals.
fn nearest_direction(row: &[f32], directions: &[Vec<f64>]) -> u32 {
    let mut nearest = 0;
    let mut largest = f64::NEG_INFINITY;
    for (index, direction) in (0..).zip(directions) {
        let product: f64 = row
            .iter()
            .zip(direction)
            .map(|(&x, d)| f64::from(x) * d)
            .sum();
        if largest < product {
            nearest = index;
            largest = product;
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rows(dim: usize, values: &[f32]) -> Embeddings {
        Embeddings::new(dim, values.to_vec()).unwrap()
    }

    #[test]
    fn a_far_point_is_nearest_to_the_other_part() {
        // Tokens at 0°, 90° and 80°; the third belongs to the first part, whose mean stays near 0°.
        let embeddings = rows(2, &[1.0, 0.0, 0.0, 1.0, 0.1736, 0.9848]);
        let found = gtc(&embeddings, &[0, 0, 0, 0, 1, 2], &[4, 4, 4, 4, 7, 4]).unwrap();
        assert!((found.accuracy - 5.0 / 6.0).abs() < 1e-12);
        assert!((found.miou - (4.0 / 5.0 + 1.0 / 2.0) / 2.0).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_scored_is_refused() {
        let embeddings = rows(1, &[1.0]);
        assert_eq!(
            gtc(&embeddings, &[1], &[0]),
            Err(ScoreError::Token {
                token: 1,
                n_tokens: 1
            })
        );
        assert_eq!(
            gtc(&embeddings, &[0], &[-1]),
            Err(ScoreError::NothingLabeled)
        );
        assert_eq!(
            gtc(&embeddings, &[0], &[]),
            Err(ScoreError::Length {
                n_predicted: 1,
                n_reference: 0
            })
        );
    }

    proptest! {
        #[test]
        fn one_hot_embeddings_are_perfect(reference in proptest::collection::vec(-1i32..5, 1..40)) {
            prop_assume!(reference.iter().any(|&part| part >= 0));
            let one_hot = |&part: &i32| (0..5).map(move |axis| if axis == part { 1.0f32 } else { 0.0 });
            let embeddings = rows(5, &reference.iter().flat_map(one_hot).collect::<Vec<_>>());
            let tokens: Vec<u32> = (0..reference.len() as u32).collect();
            prop_assert_eq!(gtc(&embeddings, &tokens, &reference), Ok(Gtc { accuracy: 1.0, miou: 1.0 }));
        }
    }
}
