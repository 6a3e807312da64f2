//! Finds the parameter at which a residual along a curve is shortest. All projections onto curves use this search.

use partprobe_shape::{Point, dot};

/// Largest number of local minima of the samples from which a search starts.
const MINIMA: usize = 3;
/// Number of steps after which a bracketed search stops. In this number of steps, bisection alone reaches the rounding error.
const STEPS: usize = 60;

/// Minimizes `|r(t)|²` over the range of `samples` (in ascending order). `residual` returns `r` and `dr/dt`.
///
/// The samples must be so dense that each relevant minimum has its own nearest sample.
pub(crate) fn nearest_parameter(samples: &[f64], residual: impl Fn(f64) -> (Point, Point)) -> f64 {
    let values: Vec<f64> = samples.iter().map(|&t| squared(residual(t).0)).collect();
    let is_minimum = |&i: &usize| {
        (i == 0 || values[i] <= values[i - 1])
            && values.get(i + 1).is_none_or(|&next| values[i] <= next)
    };
    let mut minima: Vec<usize> = (0..samples.len()).filter(is_minimum).collect();
    minima.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut best = (f64::INFINITY, samples.first().copied().unwrap_or(0.0));
    for &i in minima.iter().take(MINIMA) {
        if values[i] < best.0 {
            best = (values[i], samples[i]);
        }
        // Each side of a sample is searched separately, because the curve may have a corner at the sample and thus two slopes.
        for ends in samples[i.saturating_sub(1)..(i + 2).min(samples.len())].windows(2) {
            let found = descend(ends[0], ends[1], 0.5 * (ends[0] + ends[1]), &residual);
            if found.0 < best.0 {
                best = found;
            }
        }
    }
    best.1
}

/// Gauss–Newton method between `low` and `high`, with bisection if a step would leave this interval. Returns the squared residual
/// and its parameter.
fn descend(
    mut low: f64,
    mut high: f64,
    start: f64,
    residual: &impl Fn(f64) -> (Point, Point),
) -> (f64, f64) {
    let span = high - low;
    let mut t = start;
    let mut best = (f64::INFINITY, start);
    for _ in 0..STEPS {
        let (r, slope) = residual(t);
        if squared(r) < best.0 {
            best = (squared(r), t);
        }
        let descent = dot(r, slope);
        if descent > 0.0 {
            high = t;
        } else {
            low = t;
        }
        let newton = t - descent / squared(slope);
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next - t).abs() <= 1e-15 * (span + t.abs()) || high - low <= 1e-15 * span {
            break;
        }
        t = next;
    }
    best
}

/// Gauss–Newton method from a seed, without bounds. Returns the squared residual and its parameter.
pub(crate) fn follow_seed(seed: f64, residual: impl Fn(f64) -> (Point, Point)) -> (f64, f64) {
    let mut t = seed;
    let mut best = (f64::INFINITY, seed);
    for _ in 0..12 {
        let (r, slope) = residual(t);
        if squared(r) >= best.0 {
            break;
        }
        best = (squared(r), t);
        let next = t - dot(r, slope) / squared(slope);
        if !next.is_finite() || (next - t).abs() <= 1e-15 * (1.0 + t.abs()) {
            break;
        }
        t = next;
    }
    best
}

pub(crate) fn squared(a: Point) -> f64 {
    dot(a, a)
}
