//! Computes how often two tokens of one part are more alike than two tokens of different parts.
//!
//! For each part it is the area under the ROC curve of the cosine: the probability that a random pair inside the part has a
//! larger cosine than a random pair of a token of the part and one of another part. It needs neither K nor a clustering. The
//! mean over parts counts a small part as much as a large one.

use crate::confusion::Confusion;
use crate::metric::{Metric, ScoredShape};
use partprobe_carrier::Embeddings;

/// Pair AUC, of rows whose embeddings are scored.
pub const PAIR_AUC: Metric = Metric {
    name: "pair_auc",
    heading: "pair AUC",
    value: |shape| {
        shape.gtc?;
        pair_auc(shape)
    },
};

/// The largest number of tokens that are compared. They are evenly spaced in their order, and all their pairs are compared.
const MAX_TOKENS: usize = 256;

fn pair_auc(shape: &ScoredShape<'_>) -> Option<f64> {
    let parts = part_of_token(shape)?;
    let labeled: Vec<usize> = (0..parts.len())
        .filter(|&token| parts[token].is_some())
        .collect();
    let n_compared = labeled.len().min(MAX_TOKENS);
    let compared: Vec<usize> = (0..n_compared)
        .map(|number| labeled[number * labeled.len() / n_compared])
        .collect();

    let parts: Vec<Option<usize>> = compared.iter().map(|&token| parts[token]).collect();
    let n_parts = parts.iter().copied().flatten().max()? + 1;
    let cosines = PairCosines::new(shape.embeddings, &compared);
    let of_parts: Vec<f64> = (0..n_parts)
        .filter_map(|part| auc_of_part(&cosines, &parts, part))
        .collect();
    if of_parts.is_empty() {
        return None;
    }
    Some(of_parts.iter().sum::<f64>() / of_parts.len() as f64)
}

/// The part of most points of each token, or the lowest part in a tie. It is `None` for a token without a labeled point.
fn part_of_token(shape: &ScoredShape<'_>) -> Option<Vec<Option<usize>>> {
    let of_tokens = Confusion::new(shape.token_of_point, shape.reference).ok()?;
    let mut parts = vec![None; shape.embeddings.n_rows()];
    for (idx, &token) in of_tokens.predicted_ids().iter().enumerate() {
        let count = |part: &usize| of_tokens.count(*part, idx);
        let n_parts = of_tokens.reference_ids().len();
        parts[token as usize] = (0..n_parts).rev().max_by_key(count);
    }
    Some(parts)
}

/// The AUC of one part. `parts` has the part of each compared token. Returns `None` if the part has no pair of tokens, or if there is
/// no token outside of it.
fn auc_of_part(cosines: &PairCosines, parts: &[Option<usize>], part: usize) -> Option<f64> {
    let (inside, outside): (Vec<usize>, Vec<usize>) =
        (0..parts.len()).partition(|&number| parts[number] == Some(part));
    // The cosine of each pair, and whether both tokens are of the part.
    let mut pairs: Vec<(f64, bool)> = Vec::new();
    for (number, &one) in inside.iter().enumerate() {
        let own = inside[number + 1..].iter().map(|&other| (other, true));
        let others = outside.iter().map(|&other| (other, false));
        let of_pairs = own.chain(others);
        pairs.extend(of_pairs.map(|(other, is_own)| (cosines.of(one, other), is_own)));
    }
    area_under_curve(pairs)
}

/// The cosine of each two compared tokens.
struct PairCosines {
    n: usize,
    /// `[token, token]`, symmetric.
    of_pair: Vec<f64>,
}

impl PairCosines {
    /// A row of zeros has the cosine 0 with every row.
    fn new(embeddings: &Embeddings, compared: &[usize]) -> Self {
        let n = compared.len();
        let rows: Vec<&[f32]> = compared
            .iter()
            .map(|&token| embeddings.row(token))
            .collect();
        let squares: Vec<f64> = rows.iter().map(|row| dot(row, row)).collect();
        let mut of_pair = vec![0.0; n * n];
        for one in 0..n {
            for other in one + 1..n {
                let lengths = (squares[one] * squares[other]).sqrt();
                if lengths > 0.0 {
                    let cosine = dot(rows[one], rows[other]) / lengths;
                    of_pair[one * n + other] = cosine;
                    of_pair[other * n + one] = cosine;
                }
            }
        }
        Self { n, of_pair }
    }

    fn of(&self, one: usize, other: usize) -> f64 {
        self.of_pair[one * self.n + other]
    }
}

fn dot(a: &[f32], b: &[f32]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(&x, &y)| f64::from(x) * f64::from(y))
        .sum()
}

/// The probability that a positive value is above a negative one; equal values count half (Mann and Whitney 1947).
fn area_under_curve(mut values: Vec<(f64, bool)>) -> Option<f64> {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let n_positive = values
        .iter()
        .filter(|(_, is_positive)| *is_positive)
        .count();
    let n_negative = values.len() - n_positive;
    if n_positive == 0 || n_negative == 0 {
        return None;
    }
    let mut n_below = 0.0;
    let mut n_won = 0.0;
    for equal in values.chunk_by(|a, b| a.0 == b.0) {
        let positive = equal.iter().filter(|(_, is_positive)| *is_positive).count() as f64;
        let negative = equal.len() as f64 - positive;
        n_won += positive * (n_below + 0.5 * negative);
        n_below += negative;
    }
    Some(n_won / (n_positive as f64 * n_negative as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gtc::gtc;
    use crate::scores::score_clusters;

    #[track_caller]
    fn check(angles_deg: &[f64], reference: &[i32], expected: Option<f64>) {
        let rows = angles_deg.iter().map(|angle| {
            let (sine, cosine) = angle.to_radians().sin_cos();
            [cosine as f32, sine as f32]
        });
        let embeddings = Embeddings::from_rows(rows);
        let token_of_point: Vec<u32> = (0..angles_deg.len() as u32).collect();
        let matched = score_clusters(&token_of_point, reference).unwrap();
        let shape = ScoredShape {
            gtc: Some(gtc(&embeddings, &token_of_point, reference).unwrap()),
            ..ScoredShape::of_clusters(
                &token_of_point,
                reference,
                &token_of_point,
                &embeddings,
                matched,
            )
        };
        let found = (PAIR_AUC.value)(&shape);
        assert_eq!(
            found.map(|x| (x * 1e9).round()),
            expected.map(|x| (x * 1e9).round())
        );
    }

    #[test]
    fn pairs_of_one_part_are_compared_with_pairs_of_two() {
        check(&[0.0, 1.0, 90.0, 91.0], &[0, 0, 1, 1], Some(1.0));
        // The tokens of part 0 are farther apart than all pairs with part 1.
        check(&[0.0, 90.0, 45.0, 45.0], &[0, 0, 1, 1], Some(0.5));
        // A part of one token has no pair; the other one is compared with it.
        check(&[0.0, 1.0, 90.0], &[0, 0, 1], Some(1.0));
        check(&[0.0, 1.0, 2.0], &[0, 0, 0], None);
        check(&[0.0, 90.0], &[0, 1], None);
        check(&[0.0, 0.0, 0.0, 0.0], &[0, 0, 1, 1], Some(0.5));
        check(&[0.0, 1.0, 50.0, 90.0, 91.0], &[0, 0, -1, 1, 1], Some(1.0));
    }
}
