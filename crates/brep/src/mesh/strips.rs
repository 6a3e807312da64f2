//! Finds the strips of the parameter plane between the sides of a boundary and the true curves. The triangles of a face do not
//! cover such a strip, or cover it although it is outside the face. In the second case the strip counts as negative.
//!
//! On planes, cylinders, cones, spheres and tori, parameters are uniform, and the curve's directions at both ends of a side
//! determine its course between them. On other surfaces, parameters may be slow at one point and fast at another. Even a straight
//! edge may be strongly bent in the parameter plane, and the strip along its chord may be as large as the face. On these surfaces
//! the middle of the curve is projected onto the surface, then the middles of both halves, and so on, until a cubic follows each
//! piece.

use super::quadrature::{Breaks, UvTriangle, signed_area};
use super::triangulated::{ChartTriangulation, Node, Side};
use super::unwrap::near;
use crate::geometry::{Curve, Frame, Projection, Projector, Surface};
use crate::model::BrepEdge;
use partprobe_shape::{Point, cross, distance, dot, norm, subtract};

/// The directions of a piece of curve are taken at this fraction of it inside its ends, because the curve may have corners at the
/// ends.
const INSIDE: f64 = 1e-7;
/// The largest number of times that a side is halved. Near a point where the parameters degenerate, each halving leaves a quarter
/// of the area uncertain.
const MAX_DEPTH: u32 = 12;
/// The largest number of points of one side that are projected.
const MAX_LOOKED_UP: usize = 256;
/// A side over several knots is halved at least this many times.
const KNOT_DEPTH: u32 = 2;
/// A chord that changes a parameter by no more than this fraction of its extent is a parameter line.
const ALONG: f64 = 1e-6;
/// A point of a curve that is farther from the surface than this fraction of the side is not used for the strip.
const MAX_OFF_SURFACE: f64 = 0.1;
/// A projection succeeds if the point is nearer to the surface than this fraction of the side.
const FOUND: f64 = 1e-3;
/// Two searches end at the same point if their distances differ by no more than this fraction.
const SAME: f64 = 1e-6;
/// If the first search for the middle of a piece fails, it starts again at these fractions between the ends of the piece.
const STARTS: [f64; 4] = [0.8, 0.2, 0.97, 0.03];
/// All strips of a face together may be wrong by this fraction of the face's area. This is a cautious estimate.
const TOLERANCE: f64 = 1e-5;
/// The correction that Simpson's rule adds for the middle is itself accurate to at least a fifth of its value.
const CORRECTED: f64 = 5.0;

/// The strips of a face.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Strips {
    /// Triangles of the parameter plane. They are counter-clockwise where the mesh lacks them.
    pub(super) triangles: Vec<UvTriangle>,
    /// The pieces between the far sides of these triangles and the curves.
    pub(super) bows: Vec<Bow>,
    /// The signed area of the strips at curved edges, in square millimeters. The area of `triangles` is approximate.
    pub(super) beside_curves: f64,
}

/// A small piece between a chord and its curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bow {
    /// Signed area in square millimeters.
    pub(super) area: f64,
    /// A point of the piece.
    pub(super) point: Point,
    /// The surface's normal at this point, of any length.
    pub(super) normal: Point,
}

impl Strips {
    /// The signed area of the bows.
    pub(super) fn area_of_bows(&self) -> f64 {
        self.bows.iter().map(|bow| bow.area).sum()
    }
}

/// Whether parameters may run unevenly over a surface.
pub(super) fn is_free(surface: &Surface) -> bool {
    match surface {
        Surface::Plane(_)
        | Surface::Cylinder { .. }
        | Surface::Cone { .. }
        | Surface::Sphere { .. }
        | Surface::Torus { .. }
        | Surface::Facets(_) => false,
        Surface::Bspline(_)
        | Surface::Revolution { .. }
        | Surface::Extrusion { .. }
        | Surface::Offset { .. }
        | Surface::Composite(_) => true,
    }
}

/// The strips of all sides. `breaks` are the surface's knots, and `area` is the approximate area of the face. Both are used for
/// free surfaces only.
pub(super) fn strips(
    projector: &Projector<'_>,
    mesh: &ChartTriangulation,
    edges: &[BrepEdge],
    breaks: &Breaks,
    area: f64,
) -> Strips {
    let surface = projector.surface();
    let tolerance = TOLERANCE * area / (mesh.sides.len().max(1) as f64).sqrt();
    let is_free = is_free(surface);
    let mut strips = Strips::default();
    for side in &mesh.sides {
        let Some(edge) = edges.get(side.segment.edge as usize) else {
            continue;
        };
        if is_free {
            follow(
                projector,
                mesh,
                side,
                &edge.curve,
                breaks,
                tolerance,
                &mut strips,
            );
        } else {
            let area = side.side * even_bow(surface, mesh, side, &edge.curve);
            if area != 0.0 {
                strips.beside_curves += area;
                strips.bows.push(bow_at(&mesh.nodes[side.from], area));
            }
        }
    }
    strips
}

fn bow_at(node: &Node, area: f64) -> Bow {
    Bow {
        area,
        point: node.point,
        normal: cross(node.tangents[0], node.tangents[1]),
    }
}

/// The signed area between a side and its curve on a surface with uniform parameters. It is positive where the curve lies on the
/// right of the side, because the parameter plane is mirrored.
fn even_bow(surface: &Surface, mesh: &ChartTriangulation, side: &Side, curve: &Curve) -> f64 {
    match (surface, curve) {
        (
            Surface::Plane(_) | Surface::Cylinder { .. } | Surface::Cone { .. },
            Curve::Line { .. },
        ) => 0.0,
        (Surface::Plane(plane), Curve::Ellipse { frame, rx, ry })
            if dot(frame.z, plane.z).abs() > 0.999 =>
        {
            ellipse_segment(plane, frame, rx * ry, side.segment.to - side.segment.from)
        }
        _ => {
            let (from, to) = ends_of(surface, mesh, side);
            let cubic = Cubic::between(curve, &from, &to);
            let area = match offset_of_middle(surface, curve, &from, &to, cubic.middle(from.uv)) {
                Some(offset) => cubic.segment() - 2.0 / 3.0 * cross_2d(cubic.chord, offset),
                None => cubic.segment(),
            };
            let area = area * 0.5 * (from.density() + to.density());
            let length = distance(from.point, to.point);
            // If a bow is larger than the square over its side, the cubic is wrong, and the bow is not a piece of the face.
            if area.abs() <= length * length {
                area
            } else {
                0.0
            }
        }
    }
}

/// The signed area between an arc of an ellipse and its chord.
fn ellipse_segment(plane: &Frame, frame: &Frame, product_of_radii: f64, turn: f64) -> f64 {
    let hand = dot(frame.z, plane.z).signum();
    0.5 * hand * product_of_radii * (turn - libm::sin(turn))
}

/// A point of a boundary's curve.
#[derive(Clone, Copy, Debug)]
struct CurvePoint {
    /// The curve's parameter.
    t: f64,
    uv: [f64; 2],
    point: Point,
    /// ∂u and ∂v. One of them is zero at a pole.
    tangents: [Point; 2],
}

impl CurvePoint {
    fn density(&self) -> f64 {
        norm(cross(self.tangents[0], self.tangents[1]))
    }
}

/// Both ends of a side, in the same period of the parameter plane.
fn ends_of(surface: &Surface, mesh: &ChartTriangulation, side: &Side) -> (CurvePoint, CurvePoint) {
    let curve_point = |node: &Node, t: f64| CurvePoint {
        t,
        uv: node.uv,
        point: node.point,
        tangents: node.tangents,
    };
    let from = curve_point(&mesh.nodes[side.from], side.segment.from);
    let mut to = curve_point(&mesh.nodes[side.to], side.segment.to);
    let period = surface.period();
    to.uv = [0, 1].map(|axis| near(to.uv[axis], from.uv[axis], period[axis]));
    (from, to)
}

/// The cubic of the parameter plane that has the curve's directions at both ends, for a parameter from 0 to 1.
#[derive(Clone, Copy, Debug)]
struct Cubic {
    chord: [f64; 2],
    leaving: [f64; 2],
    arriving: [f64; 2],
    /// Whether both directions are those of the curve. At a pole the direction is unknown.
    is_known: bool,
}

impl Cubic {
    fn between(curve: &Curve, from: &CurvePoint, to: &CurvePoint) -> Self {
        let chord = [0, 1].map(|axis| to.uv[axis] - from.uv[axis]);
        let length = to.t - from.t;
        let direction = |fraction: f64| {
            curve
                .derivative(from.t + fraction * length)
                .1
                .map(|x| x * length)
        };
        let leaving = in_parameters(from.tangents, direction(INSIDE));
        let arriving = in_parameters(to.tangents, direction(1.0 - INSIDE));
        // If only one direction is known, the curve is a parabola, which needs only one.
        let opposite = |known: [f64; 2]| [2.0 * chord[0] - known[0], 2.0 * chord[1] - known[1]];
        let ([leaving, arriving], is_known) = match (leaving, arriving) {
            (Some(leaving), Some(arriving)) => ([leaving, arriving], true),
            (Some(leaving), None) => ([leaving, opposite(leaving)], false),
            (None, Some(arriving)) => ([opposite(arriving), arriving], false),
            (None, None) => ([chord; 2], false),
        };
        Self {
            chord,
            leaving,
            arriving,
            is_known,
        }
    }

    fn middle(&self, from: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| {
            from[axis] + 0.5 * self.chord[axis] + (self.leaving[axis] - self.arriving[axis]) / 8.0
        })
    }

    /// The area between the cubic and its chord: ½∮(x dy − y dx) over it.
    fn segment(&self) -> f64 {
        let Self {
            chord,
            leaving,
            arriving,
            ..
        } = *self;
        0.5 * ((cross_2d(chord, arriving) - cross_2d(chord, leaving)) / 5.0
            - cross_2d(leaving, arriving) / 30.0)
    }

    /// How far the cubic is bent like an S. For an arc, the two directions deviate from the chord by opposite areas, so the
    /// result is zero.
    fn sway(&self) -> f64 {
        (cross_2d(self.chord, self.leaving) + cross_2d(self.chord, self.arriving)).abs() / 12.0
    }
}

/// The offset of the curve's middle from the cubic's middle, in the parameter plane. Simpson's rule adds two thirds of its
/// product with the chord. Returns `None` for a line or a conic, which bend evenly, and where the parameters degenerate.
fn offset_of_middle(
    surface: &Surface,
    curve: &Curve,
    from: &CurvePoint,
    to: &CurvePoint,
    [u, v]: [f64; 2],
) -> Option<[f64; 2]> {
    if matches!(
        curve,
        Curve::Line { .. }
            | Curve::Ellipse { .. }
            | Curve::Parabola { .. }
            | Curve::Hyperbola { .. }
    ) {
        return None;
    }
    let (foot, du, dv) = surface.derivatives(u, v);
    let middle = curve.point(0.5 * (from.t + to.t));
    in_parameters([du, dv], subtract(middle, foot))
}

/// A direction in space as a direction in the parameter plane. Returns `None` if the parameters degenerate.
fn in_parameters([du, dv]: [Point; 2], direction: Point) -> Option<[f64; 2]> {
    let (a, b, c) = (dot(du, du), dot(du, dv), dot(dv, dv));
    let determinant = a * c - b * b;
    if determinant <= 1e-10 * a * c || determinant.is_nan() {
        return None;
    }
    let (g, h) = (dot(du, direction), dot(dv, direction));
    Some([(c * g - b * h) / determinant, (a * h - b * g) / determinant])
}

fn cross_2d(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The result for the strip at one piece of a curve.
enum StripGuess {
    /// A cubic follows the curve well enough. The value is the signed area between the cubic and the chord.
    Followed(f64),
    /// The middle must be projected. The value is a guess of its parameters.
    Unknown([f64; 2]),
}

/// Follows the curve of a side over a free surface.
fn follow(
    projector: &Projector<'_>,
    mesh: &ChartTriangulation,
    side: &Side,
    curve: &Curve,
    breaks: &Breaks,
    tolerance: f64,
    strips: &mut Strips,
) {
    let surface = projector.surface();
    if is_ruling(surface, curve) {
        return;
    }
    let (from, to) = ends_of(surface, mesh, side);
    let is_curved = !matches!(curve, Curve::Line { .. });
    let mut n_looked_up = 0;
    let mut open = vec![(from, to, 0)];
    while let Some((from, to, depth)) = open.pop() {
        let seed = match judged(surface, curve, [&from, &to], breaks, tolerance, depth) {
            StripGuess::Followed(0.0) => continue,
            StripGuess::Followed(area) => {
                let area = side.side * area;
                strips.beside_curves += if is_curved { area } else { 0.0 };
                let at = if from.density() > to.density() {
                    from
                } else {
                    to
                };
                strips.bows.push(Bow {
                    area,
                    point: at.point,
                    normal: cross(at.tangents[0], at.tangents[1]),
                });
                continue;
            }
            StripGuess::Unknown(seed) => seed,
        };
        let Some(middle) = looked_up(projector, curve, [&from, &to], seed) else {
            continue;
        };
        n_looked_up += 1;
        let triangle = [from.uv, middle.uv, to.uv];
        if is_curved {
            strips.beside_curves += side.side * signed_area(triangle) * middle.density();
        }
        strips.triangles.push(if side.side > 0.0 {
            triangle
        } else {
            [to.uv, middle.uv, from.uv]
        });
        if depth < MAX_DEPTH && n_looked_up < MAX_LOOKED_UP {
            open.extend([(middle, to, depth + 1), (from, middle, depth + 1)]);
        }
    }
}

/// Whether the curve is a line along which an extrusion is extruded. Such a line is straight in the parameter plane.
fn is_ruling(surface: &Surface, curve: &Curve) -> bool {
    let (
        Surface::Extrusion {
            direction: along, ..
        },
        Curve::Line { direction, .. },
    ) = (surface, curve)
    else {
        return false;
    };
    norm(cross(*along, *direction)) <= 1e-12 * norm(*along) * norm(*direction)
}

/// Decides whether a cubic follows the curve between two points.
fn judged(
    surface: &Surface,
    curve: &Curve,
    [from, to]: [&CurvePoint; 2],
    breaks: &Breaks,
    tolerance: f64,
    depth: u32,
) -> StripGuess {
    let cubic = Cubic::between(curve, from, to);
    let middle = cubic.middle(from.uv);
    let half_way = [0, 1].map(|axis| from.uv[axis] + 0.5 * cubic.chord[axis]);
    // Where the parameters nearly degenerate, the cubic may be far from the curve.
    let strays = (0..2).any(|axis| (middle[axis] - half_way[axis]).abs() > cubic.chord[axis].abs());
    let guess = if strays { half_way } else { middle };
    let (foot, du, dv) = surface.derivatives(middle[0], middle[1]);
    let point = curve.point(0.5 * (from.t + to.t));
    let Some(offset) = in_parameters([du, dv], subtract(point, foot)) else {
        return StripGuess::Unknown(guess);
    };
    let densities = [from.density(), norm(cross(du, dv)), to.density()];
    let [before, here, after] = densities;
    let highest = before.max(here).max(after);
    // The offset has the shape of a quartic between the ends if the directions are known, or else of a parabola.
    let share = if cubic.is_known {
        8.0 / 15.0
    } else {
        2.0 / 3.0
    };
    let correction = share * cross_2d(cubic.chord, offset);
    let bow = cubic.segment() - correction;
    let unevenness = bow.abs() * (here - 0.5 * (before + after)).abs();
    let in_doubt = (correction.abs() * highest)
        .max(unevenness)
        .max(if depth == 0 {
            cubic.sway() * highest
        } else {
            0.0
        });
    if in_doubt > CORRECTED * tolerance {
        return StripGuess::Unknown(guess);
    }
    if depth < KNOT_DEPTH && runs_over_knots(surface, from.uv, cubic.chord, breaks) {
        return StripGuess::Unknown(guess);
    }
    StripGuess::Followed(bow * (0.1 * before + 0.8 * here + 0.1 * after))
}

/// Whether a chord that is not a parameter line crosses more than one knot of a parameter.
fn runs_over_knots(surface: &Surface, from: [f64; 2], chord: [f64; 2], breaks: &Breaks) -> bool {
    let extent = surface.extent();
    let runs = |axis: usize| chord[axis].abs() > ALONG * extent[axis];
    let count = |axis: usize| {
        let (low, high) = (
            from[axis].min(from[axis] + chord[axis]),
            from[axis].max(from[axis] + chord[axis]),
        );
        let n_below = breaks.knots[axis].partition_point(|&x| x < high);
        n_below.saturating_sub(breaks.knots[axis].partition_point(|&x| x <= low))
    };
    runs(0) && runs(1) && (count(0) > 1 || count(1) > 1)
}

/// The middle of a piece of curve on the surface. Returns `None` if the curve does not lie on the surface there.
///
/// A search stops where a tangent vanishes. Then it starts again from other points between the ends.
fn looked_up(
    projector: &Projector<'_>,
    curve: &Curve,
    [from, to]: [&CurvePoint; 2],
    seed: [f64; 2],
) -> Option<CurvePoint> {
    let t = 0.5 * (from.t + to.t);
    let point = curve.point(t);
    let length = distance(from.point, to.point);
    let on_the_way =
        |fraction: f64| [0, 1].map(|axis| from.uv[axis] + fraction * (to.uv[axis] - from.uv[axis]));
    let mut best: Option<Projection> = None;
    for seed in std::iter::once(seed).chain(STARTS.map(on_the_way)) {
        let found = projector.project(point, Some(seed));
        // If two searches end at the same distance, the curve does not lie on its surface.
        let is_same =
            best.is_some_and(|best| (found.distance - best.distance).abs() <= SAME * best.distance);
        if best.is_none_or(|best| found.distance < best.distance) {
            best = Some(found);
        }
        if is_same || found.distance <= FOUND * length {
            break;
        }
    }
    let found = best.filter(|best| best.distance <= MAX_OFF_SURFACE * length)?;
    let period = projector.surface().period();
    let uv = [0, 1].map(|axis| near(found.uv[axis], seed[axis], period[axis]));
    Some(CurvePoint {
        t,
        uv,
        point,
        tangents: found.tangents,
    })
}
