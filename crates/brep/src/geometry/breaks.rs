//! Lists the knots inside a rectangle of parameters: the parameters at which a surface is not smooth.

use super::types::Surface;

/// Breaks that are closer together than this fraction of the rectangle count as one.
const MIN_BREAK_GAP: f64 = 1e-9;

impl Surface {
    /// The parameters of u and of v, strictly inside the rectangle and ascending, at which the surface's formula changes. Between
    /// them the surface has all derivatives. `bounds` holds `[low, high]` of u and of v.
    pub(crate) fn breaks_between(&self, bounds: [[f64; 2]; 2]) -> [Vec<f64>; 2] {
        let [[u0, u1], [v0, v1]] = bounds;
        match self {
            Self::Bspline(spline) => {
                let [knots_u, knots_v] = spline.breaks();
                let [period_u, period_v] = self.period();
                [
                    repeated(&knots_u, period_u, bounds[0]),
                    repeated(&knots_v, period_v, bounds[1]),
                ]
            }
            Self::Revolution { curve, .. } => [Vec::new(), curve.breaks(v0, v1)],
            Self::Extrusion { curve, .. } => [curve.breaks(u0, u1), Vec::new()],
            Self::Offset { basis, .. } => basis.breaks_between(bounds),
            Self::Composite(composite) => {
                let sides = |n: usize| -> Vec<f64> { (0..=n).map(|i| i as f64).collect() };
                let [period_u, period_v] = self.period();
                [
                    repeated(&sides(composite.n_u), period_u, bounds[0]),
                    repeated(&sides(composite.n_v), period_v, bounds[1]),
                ]
            }
            Self::Plane(_)
            | Self::Cylinder { .. }
            | Self::Cone { .. }
            | Self::Sphere { .. }
            | Self::Torus { .. }
            | Self::Facets(_) => [Vec::new(), Vec::new()],
        }
    }
}

/// The breaks of one period, repeated in every period that the interval touches.
fn repeated(of_one_turn: &[f64], period: Option<f64>, [low, high]: [f64; 2]) -> Vec<f64> {
    let margin = MIN_BREAK_GAP * (high - low);
    let turns = match (period, of_one_turn.first(), of_one_turn.last()) {
        (Some(period), Some(first), Some(last)) => {
            let turn = |x: f64| (x / period).floor().clamp(-8.0, 8.0) as i32;
            turn(low - last)..=turn(high - first) + 1
        }
        _ => 0..=0,
    };
    let shift = |turn: i32| f64::from(turn) * period.unwrap_or(0.0);
    let mut inner: Vec<f64> = turns
        .flat_map(|turn| of_one_turn.iter().map(move |x| x + shift(turn)))
        .collect();
    inner.retain(|&x| x > low + margin && x < high - margin);
    inner.sort_by(f64::total_cmp);
    inner.dedup_by(|a, b| (*a - *b).abs() <= margin);
    inner
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(period: Option<f64>, bounds: [f64; 2], expected: &[f64]) {
        assert_eq!(repeated(&[0.0, 1.0, 3.0, 4.0], period, bounds), expected);
    }

    #[test]
    fn breaks_repeat_in_every_period() {
        check(None, [-1.0, 5.0], &[0.0, 1.0, 3.0, 4.0]);
        check(None, [1.0, 3.0], &[]);
        check(Some(4.0), [-1.5, 5.5], &[-1.0, 0.0, 1.0, 3.0, 4.0, 5.0]);
        check(Some(4.0), [6.5, 8.5], &[7.0, 8.0]);
    }
}
