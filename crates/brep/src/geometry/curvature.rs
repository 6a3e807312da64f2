//! Computes the principal curvatures of a surface and their directions, from the first and second fundamental forms.

use super::linear::{along, scaled, unit};
use super::types::Surface;
use partprobe_shape::{Point, cross, dot, norm};

/// The principal curvatures of a surface at a point, seen from one side of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curvature {
    /// The larger and the smaller curvature, in 1/mm. They are positive where the surface bends away from its normal, for example
    /// on a ball with an outward normal.
    pub principal: [f64; 2],
    /// The direction of each curvature: unit vectors at a right angle. If the two curvatures are equal, any pair is possible.
    pub directions: [Point; 2],
}

impl Curvature {
    /// The same point seen from the other side.
    #[must_use]
    pub fn flipped(self) -> Self {
        let ([k1, k2], [d1, d2]) = (self.principal, self.directions);
        Self {
            principal: [-k2, -k1],
            directions: [d2, d1],
        }
    }
}

impl Surface {
    /// The principal curvatures relative to the normal `∂u × ∂v`. Returns `None` if this normal is undefined, as at a cone's
    /// apex.
    #[must_use]
    pub fn curvature(&self, u: f64, v: f64) -> Option<Curvature> {
        match self {
            Self::Plane(frame) => Some(Curvature {
                principal: [0.0; 2],
                directions: [frame.x, frame.y],
            }),
            Self::Sphere { radius, .. } => {
                let normal = self.unit_normal(u, v)?;
                let (_, _, dv) = self.derivatives(u, v);
                let along_meridian = unit(dv)?;
                let directions = [cross(along_meridian, normal), along_meridian];
                Some(Curvature {
                    principal: [1.0 / radius; 2],
                    directions,
                })
            }
            // An offset has the same principal directions and the same centers of curvature as its basis.
            Self::Offset { basis, distance } => {
                let Curvature {
                    principal,
                    directions,
                } = basis.curvature(u, v)?;
                let [k1, k2] = principal.map(|k| k / (1.0 + distance * k));
                (k1.is_finite() && k2.is_finite()).then_some(Curvature {
                    principal: [k1, k2],
                    directions,
                })
            }
            _ => self.curvature_of_forms(u, v),
        }
    }

    /// The principal curvatures from the first and the second fundamental form.
    fn curvature_of_forms(&self, u: f64, v: f64) -> Option<Curvature> {
        let normal = self.unit_normal(u, v)?;
        let (_, du, dv) = self.derivatives(u, v);
        let [uu, uv, vv] = self
            .second_derivatives(u, v)
            .map(|second| -dot(second, normal));
        // The second form in an orthonormal basis of the tangent plane whose first axis is ∂u.
        let first = unit(du)?;
        let second = cross(normal, first);
        let (a, b, c) = (norm(du), dot(dv, first), dot(dv, second));
        let h11 = uu / (a * a);
        let h12 = (uv - uu * b / a) / (a * c);
        let h22 = (vv - 2.0 * uv * b / a + uu * b * b / (a * a)) / (c * c);
        let (mean, half_gap) = (0.5 * (h11 + h22), libm::hypot(0.5 * (h11 - h22), h12));
        let (sin, cos) = libm::sincos(0.5 * libm::atan2(2.0 * h12, h11 - h22));
        let along_larger = along(scaled(first, cos), second, sin);
        let curvature = Curvature {
            principal: [mean + half_gap, mean - half_gap],
            directions: [along_larger, cross(normal, along_larger)],
        };
        curvature
            .principal
            .iter()
            .all(|k| k.is_finite())
            .then_some(curvature)
    }
}

#[cfg(test)]
mod tests {
    use super::super::types::{Curve, Frame};
    use super::*;
    use partprobe_shape::{distance, subtract};
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    fn frame() -> Frame {
        Frame::new(
            [1.0, 2.0, 3.0],
            Some([1.0, 2.0, -1.0]),
            Some([0.0, 1.0, 1.0]),
        )
    }

    #[track_caller]
    fn check(surface: &Surface, at: [f64; 2], expected: [f64; 2]) {
        let found = surface.curvature(at[0], at[1]).unwrap();
        for (k, expected) in found.principal.iter().zip(expected) {
            assert!(
                (k - expected).abs() <= 1e-9 * (1.0 + expected.abs()),
                "{k}, expected {expected}: {surface:?}"
            );
        }
        let normal = surface.unit_normal(at[0], at[1]).unwrap();
        let [a, b] = found.directions;
        for (x, y, product) in [
            (a, a, 1.0),
            (b, b, 1.0),
            (a, b, 0.0),
            (a, normal, 0.0),
            (b, normal, 0.0),
        ] {
            assert!((dot(x, y) - product).abs() < 1e-9);
        }
    }

    #[test]
    fn primitives_have_closed_forms() {
        check(&Surface::Plane(frame()), [2.0, 3.0], [0.0, 0.0]);
        check(
            &Surface::Cylinder {
                frame: frame(),
                radius: 4.0,
            },
            [2.0, 3.0],
            [0.25, 0.0],
        );
        check(
            &Surface::Sphere {
                frame: frame(),
                radius: 4.0,
            },
            [2.0, 0.3],
            [0.25, 0.25],
        );
        check(
            &Surface::Sphere {
                frame: frame(),
                radius: 4.0,
            },
            [2.0, FRAC_PI_2],
            [0.25, 0.25],
        );
        // On a cone, the distance to the axis along the normal is the radius divided by the cosine of the half angle.
        let (radius, slope) = (3.0, 0.75);
        let cone = Surface::Cone {
            frame: frame(),
            radius,
            slope,
        };
        check(
            &cone,
            [1.0, 2.0],
            [1.0 / ((radius + 2.0 * slope) * 1.25), 0.0],
        );
        assert_eq!(cone.curvature(0.0, -4.0), None);
        // Outside, inside and on top of a torus.
        let torus = Surface::Torus {
            frame: frame(),
            major: 5.0,
            minor: 2.0,
        };
        check(&torus, [1.0, 0.0], [0.5, 1.0 / 7.0]);
        check(&torus, [1.0, 2.0 * FRAC_PI_2], [0.5, -1.0 / 3.0]);
        check(&torus, [1.0, FRAC_PI_2], [0.5, 0.0]);
        let wall = Curve::Ellipse {
            frame: frame(),
            rx: 2.0,
            ry: 2.0,
        };
        check(
            &Surface::Extrusion {
                curve: Box::new(wall),
                direction: frame().z,
            },
            [1.0, 0.3],
            [0.5, 0.0],
        );
        let cylinder = Surface::Cylinder {
            frame: frame(),
            radius: 4.0,
        };
        check(
            &Surface::Offset {
                basis: Box::new(cylinder),
                distance: -1.5,
            },
            [1.0, 0.3],
            [0.4, 0.0],
        );
    }

    #[test]
    fn a_hole_bends_the_other_way() {
        let wall = Surface::Cylinder {
            frame: frame(),
            radius: 4.0,
        };
        let from_outside = wall.curvature(1.0, 2.0).unwrap();
        let from_inside = from_outside.flipped();
        assert_eq!(from_inside.principal, [-0.0, -0.25]);
        assert_eq!(from_inside.directions[1], from_outside.directions[0]);
    }

    proptest! {
        /// On a saddle of third order, normal sections by differences give the same curvatures.
        #[test]
        fn curvatures_of_normal_sections_follow_their_directions(u in 0.2_f64..0.8, v in 0.2_f64..0.8) {
            let poles = (0..4).flat_map(|i| (0..4).map(move |j| (f64::from(i), f64::from(j)))).map(|(x, y)| {
                [x + 0.1 * y, y, 0.3 * x * x - 0.5 * x * y + 0.05 * y * y * y, 1.0]
            });
            let knots = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
            let spline = super::super::types::BsplineSurface::new([3, 3], [knots.clone(), knots], [4, 4], poles.collect());
            let surface = Surface::Bspline(Box::new(spline.unwrap()));
            let Curvature { principal, directions } = surface.curvature(u, v).unwrap();
            let normal = surface.unit_normal(u, v).unwrap();
            let (point, h) = (surface.point(u, v), 1e-3);
            for (k, direction) in principal.iter().zip(directions) {
                // After a step of length h in either direction, the nearest point of the surface lies k·h²/2 below the tangent
                // plane.
                let drop = |step: f64| {
                    let near = surface.project(along(point, direction, step), Some([u, v])).point;
                    let across = subtract(near, point);
                    -2.0 * dot(across, normal) / dot(across, across)
                };
                prop_assert!((0.5 * (drop(h) + drop(-h)) - k).abs() < 1e-4 * (1.0 + k.abs()));
                prop_assert!(distance(point, surface.project(point, Some([u, v])).point) < 1e-9);
            }
        }
    }
}
