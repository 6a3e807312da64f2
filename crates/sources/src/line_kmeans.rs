//! Finds the best k-means clusters of numbers on a line.
//!
//! Numbers from 0 to 1 with weights go in, and the cluster of each number comes out. Clusters are intervals and are numbered from
//! the lowest one. The numbers are sorted into bins, and the clusters of the bins are optimal (dynamic programming, as in Wang
//! and Song 2011), so the result does not depend on a starting point. Empty clusters are left out.

/// Number of bins between 0 and 1.
const N_BINS: usize = 256;

/// The cluster of each value, for at most `k` clusters.
pub(crate) fn line_kmeans(values: &[f64], weights: &[f64], k: usize) -> Vec<u32> {
    let bin_of = |value: f64| ((value * N_BINS as f64) as usize).min(N_BINS - 1);
    let mut bins = vec![0.0; N_BINS];
    for (&value, &weight) in values.iter().zip(weights) {
        bins[bin_of(value)] += weight;
    }
    let starts = best_starts(&Sums::of(&bins), k.clamp(1, N_BINS));

    // A cluster of empty bins has no number.
    let mut cluster_of_bin = vec![0; N_BINS];
    let mut n_clusters = 0u32;
    for (idx, &start) in starts.iter().enumerate() {
        let end = starts.get(idx + 1).copied().unwrap_or(N_BINS);
        let is_used = bins[start..end].iter().any(|&weight| weight > 0.0);
        cluster_of_bin[start..end].fill(n_clusters);
        n_clusters += u32::from(is_used);
    }
    values
        .iter()
        .map(|&value| cluster_of_bin[bin_of(value)])
        .collect()
}

/// Sums of weights, first and second moments up to each bin.
struct Sums(Vec<[f64; 3]>);

impl Sums {
    fn of(bins: &[f64]) -> Self {
        let mut sums = vec![[0.0; 3]];
        for (bin, &weight) in bins.iter().enumerate() {
            let x = bin as f64;
            let [w, m, s] = sums[bin];
            sums.push([w + weight, m + weight * x, s + weight * x * x]);
        }
        Self(sums)
    }

    /// The weighted sum of squares around the mean of a range of bins.
    fn cost(&self, from: usize, to: usize) -> f64 {
        let [weight, moment, square] = [0, 1, 2].map(|n| self.0[to][n] - self.0[from][n]);
        if weight > 0.0 {
            (square - moment * moment / weight).max(0.0)
        } else {
            0.0
        }
    }
}

/// The first bins of the `k` ranges with the least cost.
fn best_starts(sums: &Sums, k: usize) -> Vec<usize> {
    let mut costs: Vec<f64> = (0..=N_BINS).map(|to| sums.cost(0, to)).collect();
    let mut last_start = vec![vec![0; N_BINS + 1]];
    for _ in 1..k {
        let mut next = vec![0.0; N_BINS + 1];
        let mut starts = vec![0; N_BINS + 1];
        for to in 1..=N_BINS {
            let (start, cost) = (0..to)
                .map(|start| (start, costs[start] + sums.cost(start, to)))
                .fold((0, f64::INFINITY), |best, other| {
                    if other.1 < best.1 { other } else { best }
                });
            next[to] = cost;
            starts[to] = start;
        }
        costs = next;
        last_start.push(starts);
    }

    let mut starts = Vec::new();
    let mut end = N_BINS;
    for of_end in last_start.iter().rev() {
        end = of_end[end];
        starts.push(end);
    }
    starts.reverse();
    starts.dedup();
    starts
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(values: &[f64], k: usize, expected: &[u32]) {
        assert_eq!(line_kmeans(values, &vec![1.0; values.len()], k), expected);
    }

    #[test]
    fn numbers_close_to_each_other_are_one_cluster() {
        check(&[], 3, &[]);
        check(&[0.5], 3, &[0]);
        check(&[0.9, 0.1, 0.12, 1.0], 2, &[1, 0, 0, 1]);
        check(&[0.9, 0.1, 0.5, 1.0], 3, &[2, 0, 1, 2]);
        check(&[0.5, 0.5, 0.5], 2, &[0, 0, 0]);
        // A cut between two heavy values is better than a cut before a light outlier.
        assert_eq!(
            line_kmeans(&[0.0, 0.3, 1.0], &[100.0, 100.0, 0.01], 2),
            [0, 1, 1]
        );
    }

    proptest! {
        #[test]
        fn clusters_are_intervals_and_all_are_used(
            values in proptest::collection::vec(0.0f64..=1.0, 1..60),
            k in 1usize..20,
        ) {
            let clusters = line_kmeans(&values, &vec![1.0; values.len()], k);
            let mut pairs: Vec<(f64, u32)> = values.iter().copied().zip(clusters).collect();
            pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
            prop_assert_eq!(pairs[0].1, 0);
            prop_assert!(pairs.windows(2).all(|pair| pair[1].1 == pair[0].1 || pair[1].1 == pair[0].1 + 1));
            prop_assert!((pairs[pairs.len() - 1].1 as usize) < k);
        }
    }
}
