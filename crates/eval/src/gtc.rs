//! GTc: how well the parts' own mean embeddings separate them, without any clustering.

use crate::scores::shape_scores;
use crate::{Confusion, ScoreError};
use partprobe_carrier::Embeddings;

/// Scores of the nearest-center rule with ground-truth centers.
///
/// The paper prints one number and does not say which of the two it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gtc {
    /// Share of the points whose nearest center is their own part's.
    pub accuracy: f64,
    /// Mean IoU of the parts with the points that their centers win.
    pub miou: f64,
}

/// Sends each point to the part whose mean direction has the largest cosine with the point's embedding.
///
/// A point's embedding is that of its token. Among equal cosines the lowest label wins; negative labels are ignored.
///
/// # Errors
/// If the lists differ in length, a token has no embedding, or the reference ignores every point.
pub fn gtc(
    embeddings: &Embeddings,
    token_of_point: &[u32],
    reference: &[i32],
) -> Result<Gtc, ScoreError> {
    let n_tokens = embeddings.n_rows();
    if let Some(&token) = token_of_point
        .iter()
        .find(|&&token| token as usize >= n_tokens)
    {
        return Err(ScoreError::Token { token, n_tokens });
    }
    let of_parts = Confusion::new(token_of_point, reference)?;
    let centers = part_directions(embeddings, &of_parts);
    let nearest: Vec<u32> = embeddings
        .rows()
        .map(|row| nearest_direction(row, &centers))
        .collect();
    let predicted: Vec<u32> = token_of_point
        .iter()
        .map(|&token| nearest[token as usize])
        .collect();
    let confusion = Confusion::new(&predicted, reference)?;
    let own_place = |part: usize| confusion.predicted_ids().binary_search(&(part as u32)).ok();
    let scores = shape_scores(
        &confusion,
        &(0..centers.len()).map(own_place).collect::<Vec<_>>(),
    );
    Ok(Gtc {
        accuracy: scores.accuracy,
        miou: scores.miou,
    })
}

/// The direction of each part's mean embedding; `of_parts` counts its points by token.
fn part_directions(embeddings: &Embeddings, of_parts: &Confusion) -> Vec<Vec<f64>> {
    let direction = |part: usize| {
        let mut sum = vec![0.0; embeddings.dim()];
        for (place, &token) in of_parts.predicted_ids().iter().enumerate() {
            let count = of_parts.count(part, place);
            if count > 0 {
                let row = embeddings.row(token as usize);
                sum.iter_mut()
                    .zip(row)
                    .for_each(|(sum, &x)| *sum += count as f64 * f64::from(x));
            }
        }
        let norm = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm > 0.0 {
            sum.iter_mut().for_each(|x| *x /= norm);
        }
        sum
    };
    (0..of_parts.reference_ids().len()).map(direction).collect()
}

/// The place of the direction with the largest product, the first of equals.
fn nearest_direction(row: &[f32], directions: &[Vec<f64>]) -> u32 {
    let product = |direction: &Vec<f64>| {
        row.iter()
            .zip(direction)
            .map(|(&x, d)| f64::from(x) * d)
            .sum::<f64>()
    };
    let products: Vec<f64> = directions.iter().map(product).collect();
    (1..products.len()).fold(0, |best, place| {
        if products[best] < products[place] {
            place
        } else {
            best
        }
    }) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rows(dim: usize, values: &[f32]) -> Embeddings {
        Embeddings::new(dim, values.to_vec()).unwrap()
    }

    #[test]
    fn a_far_point_is_won_by_the_other_part() {
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
