//! Scores embeddings by the nearest ground-truth centroid (GTc): it measures how well the mean embeddings of the parts separate
//! the points, without any clustering.

use crate::confusion::{Confusion, ScoreError};
use crate::scores::shape_scores;
use partprobe_carrier::Embeddings;

/// The scores of the nearest ground-truth centroid.
///
/// The paper prints one number and does not specify which of the two it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gtc {
    /// Fraction of the points whose nearest centroid is that of their own part.
    pub accuracy: f64,
    /// Mean IoU between the points of each part and the points whose nearest centroid is that of the part.
    pub miou: f64,
}

/// Assigns each point to the part whose mean direction has the largest cosine with the embedding of the point.
///
/// The embedding of a point is that of its token. If several cosines are equal, the lowest label is chosen. Points with negative
/// labels are ignored.
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
    let all_tokens = |_: u32| true;
    let directions = part_directions(embeddings, &of_parts, all_tokens);
    let nearest: Vec<u32> = embeddings
        .rows()
        .map(|row| nearest_direction(row, &directions))
        .collect();
    let predicted: Vec<u32> = token_of_point
        .iter()
        .map(|&token| nearest[token as usize])
        .collect();
    scores_of(&predicted, reference, of_parts.reference_ids())
}

/// The same with two halves of the tokens: the points of each half are assigned to the centers of the other half.
///
/// The tokens of each part are assigned alternately to the two halves, in their order. The part of a token is that of most of its
/// points. So no point influences the center that it is compared with. A point whose part has no center in the other half,
/// because the part has only one token, is not scored. Returns `None` if no point is left.
///
/// # Errors
/// As for [`gtc`].
pub fn split_gtc(
    embeddings: &Embeddings,
    token_of_point: &[u32],
    reference: &[i32],
) -> Result<Option<Gtc>, ScoreError> {
    ScoreError::check_tokens(token_of_point, embeddings.n_rows())?;
    let of_parts = Confusion::new(token_of_point, reference)?;
    let is_second = second_half(&of_parts, embeddings.n_rows());
    let centers = [true, false].map(|side| {
        part_directions(embeddings, &of_parts, |token| {
            is_second[token as usize] == side
        })
    });

    // The first half is scored with the centers of the second half, and vice versa.
    let nearest: Vec<u32> = (0..)
        .zip(embeddings.rows())
        .map(|(token, row)| nearest_direction(row, &centers[usize::from(is_second[token])]))
        .collect();
    let parts = of_parts.reference_ids();
    let has_center = |token: u32, label: i32| {
        let part = parts.binary_search(&label);
        part.is_ok_and(|part| centers[usize::from(is_second[token as usize])][part].is_some())
    };
    let mut scored = Vec::with_capacity(reference.len());
    let mut predicted = Vec::with_capacity(reference.len());
    for (&token, &label) in token_of_point.iter().zip(reference) {
        if label >= 0 && has_center(token, label) {
            scored.push(label);
            predicted.push(nearest[token as usize]);
        }
    }
    if scored.is_empty() {
        return Ok(None);
    }
    scores_of(&predicted, &scored, parts).map(Some)
}

/// Whether each token is of the second half.
fn second_half(of_parts: &Confusion, n_tokens: usize) -> Vec<bool> {
    let n_parts = of_parts.reference_ids().len();
    let mut is_second = vec![false; n_tokens];
    let mut n_dealt = vec![0usize; n_parts];
    for (column, &token) in of_parts.predicted_ids().iter().enumerate() {
        // In a tie, the lowest part is chosen.
        let most = (0..n_parts)
            .rev()
            .max_by_key(|&part| of_parts.count(part, column));
        if let Some(part) = most {
            is_second[token as usize] = n_dealt[part] % 2 == 1;
            n_dealt[part] += 1;
        }
    }
    is_second
}

/// The scores of points that were assigned to parts. A part is given by its index in `parts`.
fn scores_of(predicted: &[u32], reference: &[i32], parts: &[i32]) -> Result<Gtc, ScoreError> {
    let confusion = Confusion::new(predicted, reference)?;
    let own_cluster = |label: &i32| {
        let part = parts.partition_point(|part| part < label) as u32;
        confusion.predicted_ids().binary_search(&part).ok()
    };
    let own_cluster: Vec<Option<usize>> =
        confusion.reference_ids().iter().map(own_cluster).collect();
    let scores = shape_scores(&confusion, &own_cluster);
    Ok(Gtc {
        accuracy: scores.accuracy,
        miou: scores.miou,
    })
}

/// The direction of each part, from the tokens that satisfy `is_counted`, or `None` for a part without a point in them.
fn part_directions(
    embeddings: &Embeddings,
    of_parts: &Confusion,
    is_counted: impl Fn(u32) -> bool,
) -> Vec<Option<Vec<f64>>> {
    (0..of_parts.reference_ids().len())
        .map(|part| part_direction(embeddings, of_parts, part, &is_counted))
        .collect()
}

/// The direction of the mean embedding of a part. `of_parts` counts the points of the parts by token.
fn part_direction(
    embeddings: &Embeddings,
    of_parts: &Confusion,
    part: usize,
    is_counted: impl Fn(u32) -> bool,
) -> Option<Vec<f64>> {
    let mut sum = vec![0.0; embeddings.dim()];
    let mut has_points = false;
    for (column, &token) in of_parts.predicted_ids().iter().enumerate() {
        let count = of_parts.count(part, column);
        if count > 0 && is_counted(token) {
            has_points = true;
            for (sum, &x) in sum.iter_mut().zip(embeddings.row(token as usize)) {
                *sum += count as f64 * f64::from(x);
            }
        }
    }

    let norm = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
    if norm > 0.0 {
        sum.iter_mut().for_each(|x| *x /= norm);
    }
    has_points.then_some(sum)
}

/// The index of the direction with the largest scalar product. If several are equal, it is the first one.
fn nearest_direction(row: &[f32], directions: &[Option<Vec<f64>>]) -> u32 {
    let mut nearest = 0;
    let mut largest = f64::NEG_INFINITY;
    for (index, direction) in (0..).zip(directions) {
        let Some(direction) = direction else {
            continue;
        };
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

    #[test]
    fn the_centers_of_a_half_are_those_of_the_other() {
        // Part 0 has tokens at 0° and 40°, part 1 at 90° and 100°, part 2 a single one at 45°.
        let row = |degrees: f32| [degrees.to_radians().cos(), degrees.to_radians().sin()];
        let embeddings = Embeddings::from_rows([0.0, 40.0, 90.0, 100.0, 45.0].map(row));
        let (tokens, reference) = ([0, 1, 2, 3, 4, 4], [0, 0, 1, 1, 2, 2]);
        // The token at 40° goes to the center of part 2 in its half, which no token of the other half has.
        let found = split_gtc(&embeddings, &tokens, &reference)
            .unwrap()
            .unwrap();
        assert!((found.accuracy - 0.75).abs() < 1e-12, "{found:?}");
        assert!((found.miou - (0.5 + 1.0) / 2.0).abs() < 1e-12, "{found:?}");
        // By its own token alone, part 0 would win all.
        assert_eq!(split_gtc(&embeddings, &tokens[4..], &[0, 0]), Ok(None));
        assert_eq!(
            split_gtc(&embeddings, &[0], &[-1]),
            Err(ScoreError::NothingLabeled)
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
