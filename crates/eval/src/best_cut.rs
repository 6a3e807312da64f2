//! Computes the adjusted Rand index of the best cut of a tree of merges: it measures how well the parts are branches of the tree.
//!
//! It needs no number of clusters, because every cut is tried. The reference is used to choose the best cut.

use crate::agreement::index_of_pair_counts;
use crate::confusion::{Confusion, ScoreError};
use partprobe_cluster::AverageLinkTree;

/// The largest adjusted Rand index of a cut of the tree of the tokens with the reference, over all labeled points.
///
/// # Errors
/// If the lists differ in length, a point has a token that is not in the tree, or the reference ignores every point.
pub fn best_cut_ari(
    tree: &AverageLinkTree,
    token_of_point: &[u32],
    reference: &[i32],
) -> Result<f64, ScoreError> {
    ScoreError::check_tokens(token_of_point, tree.n_rows())?;
    let of_tokens = Confusion::new(token_of_point, reference)?;
    let n_parts = of_tokens.reference_ids().len();
    let mut counts = vec![vec![0u64; n_parts]; tree.n_rows()];
    for (column, &token) in of_tokens.predicted_ids().iter().enumerate() {
        for (part, count) in counts[token as usize].iter_mut().enumerate() {
            *count = of_tokens.count(part, column);
        }
    }

    let mut cut = Cut::of_single_tokens(&counts, &of_tokens);
    let mut best = cut.index();
    let mut root: Vec<usize> = (0..tree.n_rows()).collect();
    for [a, b] in tree.merges() {
        let [a, b] = [a, b].map(|row| root_of(&mut root, row as usize));
        root[b] = a;
        let from = std::mem::take(&mut counts[b]);
        cut.merge(&mut counts[a], &from);
        best = cut.index().max(best);
    }
    Ok(best)
}

/// The sums from which the index of one cut is computed.
struct Cut {
    together: f64,
    in_clusters: f64,
    in_parts: f64,
    all: f64,
}

impl Cut {
    fn of_single_tokens(counts: &[Vec<u64>], of_tokens: &Confusion) -> Self {
        let parts = 0..of_tokens.reference_ids().len();
        Self {
            together: counts.iter().flatten().map(|&n| pairs(n)).sum(),
            in_clusters: counts.iter().map(|row| pairs(row.iter().sum())).sum(),
            in_parts: parts.map(|part| pairs(of_tokens.n_of_part(part))).sum(),
            all: pairs(of_tokens.n_points()),
        }
    }

    /// Adds the counts of one cluster to those of another.
    fn merge(&mut self, into: &mut [u64], from: &[u64]) {
        let sizes = [into.iter().sum::<u64>(), from.iter().sum::<u64>()];
        self.in_clusters += sizes[0] as f64 * sizes[1] as f64;
        for (into, &from) in into.iter_mut().zip(from) {
            self.together += *into as f64 * from as f64;
            *into += from;
        }
    }

    fn index(&self) -> f64 {
        index_of_pair_counts(self.together, self.in_parts, self.in_clusters, self.all)
    }
}

fn pairs(n: u64) -> f64 {
    let n = n as f64;
    0.5 * n * (n - 1.0)
}

/// The row that names the cluster of a row. The search halves the path.
fn root_of(root: &mut [usize], mut row: usize) -> usize {
    while root[row] != row {
        root[row] = root[root[row]];
        row = root[row];
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agreement::adjusted_rand_index;
    use partprobe_carrier::Embeddings;
    use proptest::prelude::*;

    fn tree(angles_deg: &[f64]) -> AverageLinkTree {
        let rows = Embeddings::from_rows(angles_deg.iter().map(|angle| {
            let (sine, cosine) = angle.to_radians().sin_cos();
            [cosine as f32, sine as f32]
        }));
        AverageLinkTree::new(&rows, &vec![1; angles_deg.len()]).unwrap()
    }

    #[test]
    fn branches_are_found_without_their_number() {
        let angles = [0.0, 1.0, 50.0, 51.0, 120.0, 121.0];
        let tokens = [0, 1, 2, 3, 4, 5];
        for reference in [
            [0, 0, 1, 1, 2, 2],
            [7, 7, 7, 7, 3, 3],
            [0; 6],
            [0, 1, 2, 3, 4, 5],
        ] {
            assert_eq!(best_cut_ari(&tree(&angles), &tokens, &reference), Ok(1.0));
        }
        let torn = best_cut_ari(&tree(&angles), &tokens, &[0, 1, 0, 1, 0, 1]).unwrap();
        assert!(torn < 0.5, "{torn}");
        let missing = ScoreError::Token {
            token: 6,
            n_tokens: 6,
        };
        assert_eq!(best_cut_ari(&tree(&angles), &[6], &[0]), Err(missing));
    }

    proptest! {
        #[test]
        fn it_is_the_best_of_all_cuts(
            tokens in proptest::collection::vec(0.0f64..360.0, 1..14),
            points in proptest::collection::vec((0usize..14, -1i32..4), 2..40),
        ) {
            let tree = tree(&tokens);
            let token_of_point: Vec<u32> = points.iter().map(|&(token, _)| (token % tokens.len()) as u32).collect();
            let reference: Vec<i32> = points.iter().map(|&(_, part)| part).collect();
            prop_assume!(reference.iter().any(|&part| part >= 0));
            let of_cut = |k: usize| {
                let clusters = tree.cut(k);
                let predicted: Vec<u32> = token_of_point.iter().map(|&token| clusters.assignment[token as usize]).collect();
                adjusted_rand_index(&Confusion::new(&predicted, &reference).unwrap())
            };
            let expected = (1..=tokens.len()).map(of_cut).fold(f64::NEG_INFINITY, f64::max);
            let found = best_cut_ari(&tree, &token_of_point, &reference).unwrap();
            prop_assert!((found - expected).abs() < 1e-9, "{} {}", found, expected);
        }
    }
}
