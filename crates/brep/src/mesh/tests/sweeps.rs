//! Tests a law of swept surfaces: for any profile and any trim, the quadrature and the triangles give the same area.
//!
//! The trims are polygons in the parameter plane, so a sum over small triangles of that plane gives the area a third time.

use super::*;
use crate::geometry::{BsplineCurve, SurfaceCurve};
use partprobe_shape::{cross, norm};

/// The kinds of profiles, in the plane of x and z. Their parameters run from 0 to 1 or over a fraction of this range.
#[derive(Clone, Debug)]
enum Profile {
    Line,
    Arc,
    Spline {
        degree: usize,
        heights: Vec<f64>,
        knots: Vec<f64>,
    },
}

/// How the profile becomes a surface.
#[derive(Clone, Copy, Debug)]
enum Sweep {
    Extrusion { lean: f64 },
    Revolution { reach: f64 },
}

impl Profile {
    /// The curve, from x = `from` to x = `from` + 4.
    fn curve(&self, from: f64) -> Curve {
        match self {
            Self::Line => Curve::Line {
                origin: [from, 0.0, 0.0],
                direction: [4.0, 0.0, 3.0],
            },
            Self::Arc => {
                let frame = Frame {
                    origin: [from + 2.0, 0.0, -1.0],
                    x: [-1.0, 0.0, 0.0],
                    y: UP.z,
                    z: [0.0, 1.0, 0.0],
                };
                Curve::Ellipse {
                    frame,
                    rx: 2.0,
                    ry: 3.0,
                }
            }
            Self::Spline {
                degree,
                heights,
                knots,
            } => {
                let n = heights.len();
                let poles = (0..n)
                    .map(|i| [from + 4.0 * i as f64 / (n - 1) as f64, 0.0, heights[i], 1.0])
                    .collect();
                let ends = |end: f64| std::iter::repeat_n(end, degree + 1);
                let inner = knots.iter().copied().take(n - degree - 1);
                let knots = ends(0.0).chain(inner).chain(ends(1.0)).collect();
                Curve::Bspline(BsplineCurve::new(*degree, knots, poles).unwrap())
            }
        }
    }

    fn has_kinks(&self) -> bool {
        matches!(self, Self::Spline { degree: 1, .. })
    }

    /// The parameter at a fraction of the profile.
    fn at(&self, fraction: f64) -> f64 {
        match self {
            Self::Arc => PI * (0.05 + 0.9 * fraction),
            _ => fraction,
        }
    }
}

/// The surface, and the map from the unit square to its parameters.
fn swept(
    profile: &Profile,
    sweep: Sweep,
    offset: Option<f64>,
) -> (Surface, impl Fn([f64; 2]) -> [f64; 2]) {
    let surface = match sweep {
        Sweep::Extrusion { lean } => Surface::Extrusion {
            curve: Box::new(profile.curve(0.0)),
            direction: [0.0, 1.0, lean],
        },
        Sweep::Revolution { reach } => Surface::Revolution {
            axis: UP,
            curve: Box::new(profile.curve(reach)),
        },
    };
    let surface = match offset {
        Some(distance) => Surface::Offset {
            basis: Box::new(surface),
            distance,
        },
        None => surface,
    };
    let parameters = move |[s, t]: [f64; 2]| match sweep {
        Sweep::Extrusion { .. } => [profile.at(s), 5.0 * t],
        Sweep::Revolution { .. } => [0.3 + 4.0 * t, profile.at(s)],
    };
    (surface, parameters)
}

/// A face between straight lines of the parameter plane.
fn trimmed(surface: Surface, corners: &[[f64; 2]]) -> Brep {
    let points: Vec<Point> = corners.iter().map(|&[u, v]| surface.point(u, v)).collect();
    let shared = Arc::new(surface.clone());
    let mut brep = shape(&points);
    let n = corners.len();
    for (i, &[u, v]) in corners.iter().enumerate() {
        let next = corners[(i + 1) % n];
        let line = Curve::Line {
            origin: [u, v, 0.0],
            direction: [next[0] - u, next[1] - v, 0.0],
        };
        let curve = SurfaceCurve {
            surface: Arc::clone(&shared),
            curve: line,
            scale: [1.0; 2],
        };
        brep.edges.push(BrepEdge {
            step_id: 0,
            start: i as u32,
            end: ((i + 1) % n) as u32,
            curve: Arc::new(Curve::OnSurface(Box::new(curve))),
            same_sense: true,
        });
    }
    let walk: Vec<i32> = (1..=n as i32).collect();
    brep.face(surface, true, &[&walk])
}

/// A star-shaped polygon of the unit square, counter-clockwise.
fn star(reaches: &[f64], turn: f64) -> Vec<[f64; 2]> {
    let point = |(i, reach): (usize, &f64)| {
        let angle = turn + TAU * i as f64 / reaches.len() as f64;
        [0.5 + reach * angle.cos(), 0.5 + reach * angle.sin()]
    };
    reaches.iter().enumerate().map(point).collect()
}

/// The area over a star around the middle of the unit square, as a sum over small triangles: `n` of them along each side.
fn sum_of_densities(
    surface: &Surface,
    parameters: impl Fn([f64; 2]) -> [f64; 2],
    corners: &[[f64; 2]],
    n: usize,
) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let sector = |(a, b): (&[f64; 2], &[f64; 2])| {
        let point = |i: f64, j: f64| {
            let (s, t) = (i / n as f64, j / n as f64);
            parameters([0, 1].map(|axis| 0.5 + s * (a[axis] - 0.5) + t * (b[axis] - 0.5)))
        };
        let [o, p, q] = [point(0.0, 0.0), point(1.0, 0.0), point(0.0, 1.0)];
        let area = 0.5 * ((p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0])).abs();
        let density = |[u, v]: [f64; 2]| {
            let (_, du, dv) = surface.derivatives(u, v);
            norm(cross(du, dv))
        };
        let thirds = [1.0 / 3.0, 2.0 / 3.0];
        let points = (0..n).flat_map(|i| (0..n - i).map(move |j| (i as f64, j as f64)));
        let sum = |(i, j): (f64, f64)| {
            let beyond = if i + j + 1.5 < n as f64 {
                density(point(i + thirds[1], j + thirds[1]))
            } else {
                0.0
            };
            density(point(i + thirds[0], j + thirds[0])) + beyond
        };
        area * points.map(sum).sum::<f64>()
    };
    corners.iter().zip(next).map(sector).sum()
}

fn profile() -> impl Strategy<Value = Profile> {
    let heights = prop::collection::vec(-1.0_f64..1.0, 7);
    let steps = prop::collection::vec(0.2_f64..1.0, 7);
    prop_oneof![
        Just(Profile::Line),
        Just(Profile::Arc),
        (1_usize..5, heights, steps).prop_map(|(degree, heights, steps)| {
            let total: f64 = steps.iter().take(heights.len() - degree).sum();
            let mut knot = 0.0;
            let knots = steps.iter().map(|step| {
                knot += step / total;
                knot
            });
            Profile::Spline {
                degree,
                heights,
                knots: knots.collect(),
            }
        }),
    ]
}

fn sweep() -> impl Strategy<Value = Sweep> {
    prop_oneof![
        (-1.0_f64..1.0).prop_map(|lean| Sweep::Extrusion { lean }),
        (0.5_f64..6.0).prop_map(|reach| Sweep::Revolution { reach }),
    ]
}

/// The area by the sum, by quadrature and by fine triangles.
fn three_areas(
    profile: &Profile,
    sweep: Sweep,
    offset: Option<f64>,
    reaches: &[f64],
    turn: f64,
) -> Result<[f64; 3], String> {
    let (surface, parameters) = swept(profile, sweep, offset);
    let star = star(reaches, turn);
    // The density jumps where a profile has a kink, so the sum converges slowly there.
    let n = if profile.has_kinks() { 320 } else { 80 };
    let expected = sum_of_densities(&surface, &parameters, &star, n);
    let mut corners: Vec<[f64; 2]> = star.into_iter().map(&parameters).collect();
    if matches!(sweep, Sweep::Revolution { .. }) {
        // The parameters of this surface are exchanged, so the sense of the walk is reversed.
        corners.reverse();
    }
    let fine = MeshSettings {
        chord_mm: 1e-3,
        angle_rad: 0.03,
        attributes: AttributeChoice::default(),
        solid_volumes: false,
        volume_loss: 0.0,
        max_triangles: 1_000_000,
    };
    let BrepMesh {
        mesh, areas, lost, ..
    } = mesh_brep(&trimmed(surface, &corners), &fine);
    let areas = [expected, areas[0], mesh.triangle_areas().iter().sum()];
    if lost.is_empty() {
        Ok(areas)
    } else {
        Err(format!("{lost:?} {areas:?}"))
    }
}

fn agree([expected, area, of_triangles]: [f64; 3]) -> bool {
    (area - expected).abs() <= 2e-3 * expected && (of_triangles - expected).abs() <= 5e-3 * expected
}

/// Trims of a torus whose corners lie on both sides of its seam, several periods away from the natural range of the parameters.
#[test]
fn a_trim_may_lead_over_the_seam_of_a_torus() {
    for reaches in [
        &[0.1, 0.1, 0.1][..],
        &[0.1, 0.416, 0.1],
        &[0.4, 0.2, 0.45, 0.3],
        &[0.48; 7],
    ] {
        for turn in [0.0, 1.0, 4.0] {
            let areas = three_areas(
                &Profile::Arc,
                Sweep::Revolution { reach: 0.5 },
                None,
                reaches,
                turn,
            )
            .unwrap();
            assert!(agree(areas), "{reaches:?} {turn}: {areas:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn quadrature_and_triangles_agree_on_any_sweep(
        profile in profile(),
        sweep in sweep(),
        offset in prop::option::of(0.02_f64..0.1),
        reaches in prop::collection::vec(0.1_f64..0.48, 3..8),
        turn in 0.0_f64..TAU,
    ) {
        // An offset is not continuous where its basis has a kink.
        let offset = offset.filter(|_| !profile.has_kinks());
        let areas = three_areas(&profile, sweep, offset, &reaches, turn);
        prop_assert!(areas.clone().is_ok_and(agree), "{areas:?}");
    }
}
