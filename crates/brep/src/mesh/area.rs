//! The area of a trimmed surface, by quadrature over its triangulated chart and the slivers between the
//! boundary's chords and its true curves. The mesh's own area plays no part: at 0.3 rad a disc loses 1.5 %.

use super::chart::Chart;
use super::triangulation::{Side, Triangulated};
use super::unwrap::near;
use crate::geometry::{Curve, Projector, Surface};
use crate::model::TopoEdge;
use carrier::{cross, norm};

/// Quarterings of a triangle over which the surface's stretch varies.
const MAX_DEPTH: u32 = 4;
/// Parts into which a side's curve is divided; two where projections are dear.
const PARTS: usize = 4;

/// The area of a trimmed surface, and how much of it the triangles miss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TrimmedArea {
    /// Square millimetres.
    pub(crate) area: f64,
    /// The part that lies between the boundary's chords and its curves.
    pub(crate) in_slivers: f64,
}

/// The area of the face.
pub(crate) fn trimmed_area(
    surface: &Surface,
    projector: &Projector<'_>,
    chart: Chart,
    mesh: &Triangulated,
    edges: &[TopoEdge],
) -> TrimmedArea {
    let density = |x: [f64; 2]| {
        let uv = chart.to_uv(x);
        stretch(surface, uv) * chart.density(x)
    };
    let corners = mesh.triangles.iter().map(|triangle| triangle.map(|node| mesh.nodes[node as usize].x));
    let inner: f64 = match uniform_density(surface, chart) {
        Some(density) => corners.map(|corners| chart_area(corners) * density).sum(),
        None => corners.map(|corners| triangle_integral(corners, &density)).sum(),
    };
    let slivers: f64 = mesh
        .sides
        .iter()
        .filter(|side| edges.get(side.segment.edge as usize).is_some_and(|edge| !is_straight(surface, &edge.curve)))
        .map(|side| side.side * sliver(surface, projector, chart, mesh, side, edges, &density))
        .sum();
    let total = inner + slivers;
    // Boundaries that leave the surface make slivers of any size; the triangles alone are nearer to the truth.
    let is_sound = total > 0.01 * inner && total < 4.0 * inner;
    TrimmedArea { area: if is_sound { total } else { inner }, in_slivers: slivers.abs() / inner }
}

/// Square millimetres per unit of the parameter plane's area.
fn stretch(surface: &Surface, [u, v]: [f64; 2]) -> f64 {
    match surface {
        Surface::Plane(_) => 1.0,
        Surface::Cylinder { radius, .. } => radius.abs(),
        Surface::Cone { radius, slope, .. } => (radius + v * slope).abs() * (1.0 + slope * slope).sqrt(),
        Surface::Sphere { radius, .. } => radius * radius * libm::cos(v).abs(),
        Surface::Torus { major, minor, .. } => (minor * (major + minor * libm::cos(v))).abs(),
        _ => {
            let (_, du, dv) = surface.derivatives(u, v);
            norm(cross(du, dv))
        }
    }
}

/// The density where it is the same everywhere.
fn uniform_density(surface: &Surface, chart: Chart) -> Option<f64> {
    let is_uniform = matches!(surface, Surface::Plane(_) | Surface::Cylinder { .. });
    (is_uniform && matches!(chart, Chart::Stretched { .. }))
        .then(|| stretch(surface, [0.0; 2]) * chart.density([0.0; 2]))
}

/// Projections to these surfaces are searches.
fn is_searched(surface: &Surface) -> bool {
    matches!(surface, Surface::Bspline(_) | Surface::Revolution { .. } | Surface::Offset { .. })
}

/// Straight edges are straight in the chart of a ruled surface.
fn is_straight(surface: &Surface, curve: &Curve) -> bool {
    let is_ruled = matches!(
        surface,
        Surface::Plane(_) | Surface::Cylinder { .. } | Surface::Cone { .. } | Surface::Extrusion { .. }
    );
    is_ruled && matches!(curve, Curve::Line { .. })
}

fn chart_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
}

/// Quadrature of second order, on quarters of the triangle where the density varies.
fn triangle_integral(corners: [[f64; 2]; 3], density: &impl Fn([f64; 2]) -> f64) -> f64 {
    let mut open = vec![(corners, 0)];
    let mut integral = 0.0;
    while let Some((corners, depth)) = open.pop() {
        let values = [0, 1, 2].map(|i| density(weighted(corners, i)));
        let mean = (values[0] + values[1] + values[2]) / 3.0;
        let spread = values.iter().fold(0.0_f64, |spread, value| spread.max((value - mean).abs()));
        if spread > 0.05 * mean && depth < MAX_DEPTH {
            open.extend(quarters(corners).map(|quarter| (quarter, depth + 1)));
        } else {
            integral += mean * chart_area(corners);
        }
    }
    integral
}

/// The quadrature's point beside corner `i`.
fn weighted(corners: [[f64; 2]; 3], i: usize) -> [f64; 2] {
    [0, 1].map(|axis| (corners[0][axis] + corners[1][axis] + corners[2][axis]) / 6.0 + 0.5 * corners[i][axis])
}

fn quarters([a, b, c]: [[f64; 2]; 3]) -> [[[f64; 2]; 3]; 4] {
    let middle = |p: [f64; 2], q: [f64; 2]| [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// The signed area between a side and the curve that it stands for; positive where the curve lies on the right.
fn sliver(
    surface: &Surface,
    projector: &Projector<'_>,
    chart: Chart,
    mesh: &Triangulated,
    side: &Side,
    edges: &[TopoEdge],
    density: &impl Fn([f64; 2]) -> f64,
) -> f64 {
    let (from, to) = (mesh.nodes[side.from], mesh.nodes[side.to]);
    let Some(edge) = edges.get(side.segment.edge as usize) else { return 0.0 };
    let period = surface.period();
    let parts = if is_searched(surface) { 2 } else { PARTS };
    let place = |i: usize| {
        let f = i as f64 / parts as f64;
        let guess = [0, 1].map(|axis| from.uv[axis] + f * (to.uv[axis] - from.uv[axis]));
        let point = edge.curve.point(side.segment.from + f * (side.segment.to - side.segment.from));
        let uv = projector.project(point, Some(guess)).uv;
        chart.to_plane([0, 1].map(|axis| near(uv[axis], guess[axis], period[axis])))
    };
    let on_curve: Vec<[f64; 2]> = (1..parts).map(place).collect();
    let arm = |p: [f64; 2]| [p[0] - from.x[0], p[1] - from.x[1]];
    let mut doubled = 0.0;
    let mut last = from.x;
    for &next in on_curve.iter().chain([&to.x]) {
        let (a, b) = (arm(last), arm(next));
        doubled += a[0] * b[1] - a[1] * b[0];
        last = next;
    }
    // The chords of a parabola's segment leave the square of their number's inverse outside.
    let outside = 1.0 / (parts * parts) as f64;
    let area = 0.5 * doubled / (1.0 - outside);
    let middle = [0, 1].map(|axis| 0.25 * (from.x[axis] + to.x[axis]) + 0.5 * on_curve[parts / 2 - 1][axis]);
    let longest = libm::hypot(to.x[0] - from.x[0], to.x[1] - from.x[1]);
    // A sliver as large as the square over its side is a wrong turn of the projection, no piece of the face.
    if area.abs() <= longest * longest { area * density(middle) } else { 0.0 }
}
