//! Maps the parameter plane of a face to the plane in which it is triangulated.
//!
//! The map stretches the parameters. If a boundary winds around a periodic surface, it is a polar map, which has no seam. For a
//! ring between two boundaries, the radius is the exponential of the parameter: this log-polar map (the complex exponential) is
//! conformal, so the Delaunay criterion sees triangles of the right shape.

use std::f64::consts::TAU;

/// Every chart is skewed a little. Parts have many rectangles and circles, whose points lie on one circle in an unskewed chart,
/// and then the exact predicates are slow.
const SKEW: f64 = 0.043;
const STRETCH: f64 = 1.061;

/// A map between (u, v) and the plane of the triangulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Chart {
    /// `(uv − origin)·scale`.
    Stretched { origin: [f64; 2], scale: [f64; 2] },
    /// The periodic parameter `around` becomes the angle. The distance of the other parameter from `start`, times `rate`, is the
    /// radius if the face has a pole (`hub` is 0). For a ring with the inner radius `hub`, it is the logarithm of the radius, so
    /// the cells of a long ring keep their shape.
    Polar {
        around: usize,
        period: f64,
        start: f64,
        rate: f64,
        hub: f64,
    },
}

impl Chart {
    /// From parameters to the plane.
    pub(crate) fn to_plane(self, uv: [f64; 2]) -> [f64; 2] {
        let [x, y] = match self {
            Self::Stretched { origin, scale } => [
                (uv[0] - origin[0]) * scale[0],
                (uv[1] - origin[1]) * scale[1],
            ],
            Self::Polar {
                around,
                period,
                start,
                rate,
                hub,
            } => {
                let (sin, cos) = libm::sincos(uv[around] / period * TAU);
                let along = rate * (uv[1 - around] - start);
                let radius = if hub > 0.0 {
                    hub * libm::exp(along)
                } else {
                    along
                };
                [radius * cos, radius * sin]
            }
        };
        [x + SKEW * y, STRETCH * y]
    }

    /// The ratio of the cell size at a point of the plane to the cell size where the chart begins.
    pub(crate) fn magnification(self, x: [f64; 2]) -> f64 {
        match self {
            Self::Polar { hub, .. } if hub > 0.0 => libm::hypot(x[0], x[1]) / hub,
            _ => 1.0,
        }
    }

    /// Whether the map to the plane exchanges left and right.
    pub(crate) fn is_mirrored(self) -> bool {
        match self {
            Self::Stretched { .. } => false,
            // Angle and radius, in this order, are left-handed.
            Self::Polar { around, rate, .. } => (around == 0) == (rate > 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn charts() -> Vec<Chart> {
        let mut charts = vec![Chart::Stretched {
            origin: [1.0, -2.0],
            scale: [3.0, 0.5],
        }];
        for around in [0, 1] {
            for (rate, start) in [(2.0, -5.0), (-2.0, 5.0)] {
                charts.push(Chart::Polar {
                    around,
                    period: TAU,
                    start,
                    rate,
                    hub: 0.0,
                });
            }
            charts.push(Chart::Polar {
                around,
                period: TAU,
                start: -3.0,
                rate: 0.4,
                hub: 1.0,
            });
        }
        charts
    }

    proptest! {
        #[test]
        fn a_chart_knows_whether_it_is_mirrored(u in -3.0_f64..3.0, v in -3.0_f64..3.0) {
            for chart in charts() {
                let x = chart.to_plane([u, v]);
                let h = 1e-5;
                let (a, b) = (chart.to_plane([u + h, v]), chart.to_plane([u, v + h]));
                let determinant = ((a[0] - x[0]) * (b[1] - x[1]) - (a[1] - x[1]) * (b[0] - x[0])) / (h * h);
                prop_assert_eq!(determinant < 0.0, chart.is_mirrored());
            }
        }
    }
}
