//! Estimates the interval of a mean over shapes: the percentile bootstrap over groups of related shapes (Efron 1979).

use partprobe_carrier::keyed_rng;
use partprobe_eval::Bootstrap;
use rand::Rng as _;
use std::collections::BTreeMap;

/// How often the groups are drawn.
const DRAWS: usize = 1000;

/// The mean of values, and the interval that holds 95 % of the means of drawn groups.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeanInterval {
    pub(crate) mean: f64,
    /// None over fewer groups than [`Bootstrap::LEAST_GROUPS`].
    pub(crate) interval: Option<[f64; 2]>,
}

/// The mean and the interval of values, each with its group; none without values.
pub(crate) fn mean_interval<'a>(
    values: impl IntoIterator<Item = (&'a str, f64)>,
) -> Option<MeanInterval> {
    let mut groups: BTreeMap<&str, (f64, usize)> = BTreeMap::new();
    for (group, value) in values {
        let sum = groups.entry(group).or_default();
        sum.0 += value;
        sum.1 += 1;
    }
    let groups: Vec<(f64, usize)> = groups.into_values().collect();
    let n: usize = groups.iter().map(|group| group.1).sum();
    if n == 0 {
        return None;
    }
    let mean = groups.iter().map(|group| group.0).sum::<f64>() / n as f64;
    let interval = (groups.len() >= Bootstrap::LEAST_GROUPS).then(|| interval_of(&groups));
    Some(MeanInterval { mean, interval })
}

/// One stream for all means: each draw takes the same groups for every supervision.
fn interval_of(groups: &[(f64, usize)]) -> [f64; 2] {
    let mut rng = keyed_rng(0, &["report"]);
    let mut drawn_mean = || {
        let (mut sum, mut n) = (0.0, 0);
        for _ in 0..groups.len() {
            // The high half of the product is uniform on 0..groups.len().
            let drawn = (u128::from(rng.next_u64()) * groups.len() as u128) >> 64;
            let group = groups[drawn as usize];
            sum += group.0;
            n += group.1;
        }
        sum / n.max(1) as f64
    };
    let mut means: Vec<f64> = (0..DRAWS).map(|_| drawn_mean()).collect();
    means.sort_by(f64::total_cmp);
    [0.025, 0.975].map(|fraction| means[(fraction * (DRAWS - 1) as f64).round() as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_holds_its_mean_and_needs_groups() {
        let names: Vec<String> = (0..40).map(|idx| format!("g{}", idx / 2)).collect();
        let values = || {
            names
                .iter()
                .enumerate()
                .map(|(idx, name)| (name.as_str(), (idx % 5) as f64))
        };
        let found = mean_interval(values()).unwrap();
        let [low, high] = found.interval.unwrap();
        assert!(low < 2.0 && 2.0 < high && found.mean == 2.0, "{found:?}");
        let few = mean_interval(values().take(18)).unwrap();
        assert_eq!(few.interval, None);
        assert_eq!(mean_interval([]), None);
        let same = mean_interval(names.iter().map(|name| (name.as_str(), 0.5))).unwrap();
        assert_eq!(same.interval, Some([0.5, 0.5]));
    }
}
