//! Measures how well the triangles of a face follow its surface: the area of the trimmed surface, the fraction of the triangles
//! that deviate from its normal, and the volume between the two.
//!
//! The area is an integral over the parameter plane: over the triangles, and over the strips between the chords of the boundary
//! and its true curves. The area of the triangles is not used instead: at 0.3 rad, the triangles of a disc lose 1.5 %.

use super::chart::Chart;
use super::quadrature::{
    Breaks, Exactness, UvTriangle, integral, integral_from, middle_of, n_breaks_inside, signed_area,
};
use super::strips::{Strips, is_free};
use super::triangulated::{ChartTriangulation, Node};
use super::unwrap::near;
use crate::geometry::Surface;
use partprobe_shape::{Point, cross, dot, norm, subtract};

/// Cosine of the angle by which a triangle may deviate from the surface's normal.
const ROUGH_COSINE: f64 = 0.88;
/// The largest number of times that a triangle is quartered if the stretch of an elementary surface varies over it.
const MAX_DEPTH: u32 = 4;
/// If the stretch in the middle of a triangle differs by more than this fraction from the corners, the triangle is integrated
/// more accurately.
const VARIES: f64 = 0.02;
/// The same on a free surface whose stretch varies much over the face.
const HARDLY_VARIES: f64 = 0.003;
/// A triangle is also integrated more accurately if the stretch of a free surface grows over it by more than this fraction, even
/// if it grows evenly.
const GROWS: f64 = 0.5;
/// If a face of a free surface has fewer triangles, or fewer vertices inside, each triangle may be integrated more accurately.
const FEW: usize = 8;
/// The stretch of a face is uneven if it varies by more than this factor. The factor grows by one for each multiple of the second
/// number of triangles.
const UNEVEN: (f64, f64) = (1.5, 50.0);
/// The fractions between two knots at which the stretch is probed along the middle of a face, and the approximate number of knot
/// spans that are probed.
const PROBES: [f64; 3] = [0.13, 0.48, 0.81];
const MOST_SPANS: usize = 6;
/// The largest difference between two rules on a piece of a free surface. The finer rule is far more accurate than this
/// difference. The first value is a fraction of the piece. The second value is a fraction of the face, divided by the square root
/// of its number of triangles.
const EXACT: [f64; 2] = [1e-4, 1e-5];
/// The first value is multiplied by up to this factor in a face with this number of triangles, because their errors cancel.
const LOOSER: (f64, f64) = (30.0, 300.0);
/// The fraction by which the rule of the middle alone may differ from the next rule, if the stretch is even.
const AT_A_GLANCE: f64 = 1e-3;

/// The differences between the triangles of a face and its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfaceFit {
    /// The area of the trimmed surface, in square millimeters.
    pub(crate) area: f64,
    /// The fraction of the area that lies between the chords of curved edges and their curves.
    pub(crate) in_slivers: f64,
    /// The fraction of the mesh that deviates from the surface's normal. For Schwarz's lantern it is the whole mesh.
    pub(crate) off_normal: f64,
    /// The volume between the triangles and the surface, in cubic millimeters. It is positive where the surface lies on that side
    /// of the triangles to which its normal points.
    pub(crate) between: f64,
}

/// A corner of a triangle in the parameter plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) uv: [f64; 2],
    /// Square millimeters per unit of the parameter plane's area.
    density: f64,
}

/// Measures a face. `breaks` are its surface's knots, and `about` is its approximate area. Both are used for free surfaces only.
pub(super) fn surface_fit(
    surface: &Surface,
    chart: Chart,
    mesh: &ChartTriangulation,
    strips: &Strips,
    (breaks, about): (&Breaks, f64),
) -> SurfaceFit {
    let side = if chart.is_mirrored() { -1.0 } else { 1.0 };
    let (exactness, plain) = match is_free(surface) {
        true => {
            let stretch = stretch_of(surface, mesh, breaks);
            (exactness(mesh, stretch, about), plain(stretch))
        }
        false => (
            Exactness {
                relative: 0.0,
                absolute: 0.0,
                at_a_glance: 0.0,
            },
            None,
        ),
    };
    let TrianglesFit {
        area,
        off_normal,
        between,
        facets,
    } = match surface {
        Surface::Plane(_) => plane_fit(mesh),
        _ => triangles_fit(surface, chart, mesh, (breaks, exactness, plain)),
    };
    let in_strip = |&triangle: &UvTriangle| {
        integral(triangle, breaks, exactness, &|uv| density_at(surface, uv))
    };
    let inner = side * area;
    let total =
        inner + side * (strips.area_of_bows() + strips.triangles.iter().map(in_strip).sum::<f64>());
    // If boundaries leave the surface, the strips may have any size. Then the integral without the strips is used if it is nearer
    // to the area of the mesh.
    let is_plain = total > 0.01 * inner && total < 4.0 * inner;
    let area = if is_plain || (total - facets).abs() < (inner - facets).abs() {
        total
    } else {
        inner
    };
    SurfaceFit {
        area,
        in_slivers: strips.beside_curves.abs() / inner,
        off_normal,
        between,
    }
}

/// The measures of the triangles without the strips. The sign of the area is that of the chart's orientation.
struct TrianglesFit {
    area: f64,
    off_normal: f64,
    between: f64,
    /// The area of the triangles themselves.
    facets: f64,
}

/// The measures of a plane face. The parameters of a plane are in millimeters.
fn plane_fit(mesh: &ChartTriangulation) -> TrianglesFit {
    let area: f64 = mesh
        .triangles
        .iter()
        .map(|corners| signed_area(corners.map(|node| mesh.nodes[node as usize].uv)))
        .sum();
    TrianglesFit {
        area,
        off_normal: 0.0,
        between: 0.0,
        facets: area.abs(),
    }
}

/// The area of the triangles in space.
pub(super) fn area_of_facets(mesh: &ChartTriangulation) -> f64 {
    let facets = mesh.triangles.iter().map(|corners| {
        let [a, b, c] = corners.map(|node| mesh.nodes[node as usize].point);
        0.5 * norm(cross(subtract(b, a), subtract(c, a)))
    });
    facets.sum()
}

/// The accuracy that the area of a piece must have. `area` is the approximate area of the face.
fn exactness(mesh: &ChartTriangulation, stretch: Stretch, area: f64) -> Exactness {
    let (most, n_most) = LOOSER;
    let n = mesh.triangles.len();
    Exactness {
        relative: EXACT[0] * (most * n as f64 / n_most).clamp(1.0, most),
        absolute: EXACT[1] * area / (n.max(1) as f64).sqrt(),
        at_a_glance: if stretch.is_divided && stretch.is_even {
            AT_A_GLANCE
        } else {
            0.0
        },
    }
}

/// Whether the stretch is even. It is probed at the nodes and along the middle of the face.
fn is_evenly_stretched(surface: &Surface, mesh: &ChartTriangulation, breaks: &Breaks) -> bool {
    let densities = mesh
        .nodes
        .iter()
        .map(|node| norm(cross(node.tangents[0], node.tangents[1])));
    let (mut low, mut high) = densities.fold((f64::INFINITY, 0.0_f64), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    let (factor, n_more) = UNEVEN;
    let most = factor + mesh.triangles.len() as f64 / n_more;
    let bounds = [0, 1].map(|axis| {
        let ends = mesh.nodes.iter().map(|node| node.uv[axis]);
        ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        })
    });
    for axis in [0, 1] {
        let [from, to] = bounds[axis];
        let inner = breaks.knots[axis]
            .iter()
            .copied()
            .filter(|&x| x > from && x < to);
        let ends: Vec<f64> = std::iter::once(from).chain(inner).chain([to]).collect();
        let stride = (ends.len() - 1).div_ceil(MOST_SPANS);
        for span in ends.windows(2).step_by(stride) {
            if high > most * low {
                return false;
            }
            for fraction in PROBES {
                let mut uv = bounds.map(|[low, high]| low + 0.48 * (high - low));
                uv[axis] = span[0] + fraction * (span[1] - span[0]);
                let density = density_at(surface, uv);
                (low, high) = (low.min(density), high.max(density));
            }
        }
    }
    high <= most * low
}

/// Measures the triangles of a curved surface.
fn triangles_fit(
    surface: &Surface,
    chart: Chart,
    mesh: &ChartTriangulation,
    (breaks, exactness, plain): (&Breaks, Exactness, Option<Plain>),
) -> TrianglesFit {
    let side = if chart.is_mirrored() { -1.0 } else { 1.0 };
    let (mut area, mut rough, mut whole, mut between) = (0.0, 0.0, 0.0, 0.0);
    let is_free = is_free(surface);
    for triangle in &mesh.triangles {
        let nodes = triangle.map(|node| &mesh.nodes[node as usize]);
        let (corners, beyond) = unwrapped(chart, nodes);
        let middle = center(corners);
        let (foot, du, dv) = surface.derivatives(middle[0], middle[1]);
        let normal = cross(du, dv);
        let density = norm(normal);
        for (i, corners) in [Some(corners), beyond].into_iter().flatten().enumerate() {
            let middle = if i == 0 {
                density
            } else {
                density_at(surface, center(corners))
            };
            let points = corners.map(|corner| corner.uv);
            area += if !is_free {
                even_integral(surface, corners, middle)
            } else if is_plain(corners, middle, breaks, plain) {
                rule(corners, middle)
            } else {
                integral_from(points, Some(middle), breaks, exactness, &|uv| {
                    density_at(surface, uv)
                })
            };
        }
        let points = nodes.map(|node| node.point);
        let facet = cross(
            subtract(points[1], points[0]),
            subtract(points[2], points[0]),
        );
        let size = norm(facet);
        whole += size;
        between += volume_below(foot, points, facet);
        let has_normal = density > 1e-9 * norm(du) * norm(dv);
        if has_normal && side * dot(facet, normal) < ROUGH_COSINE * size * density {
            rough += size;
        }
    }
    let off_normal = if whole > 0.0 { rough / whole } else { 0.0 };
    TrianglesFit {
        area,
        off_normal,
        between: side * between,
        facets: 0.5 * whole,
    }
}

/// Properties of a free surface over a whole face.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// Whether there are enough vertices inside.
    is_divided: bool,
    /// Whether the stretch hardly varies.
    is_even: bool,
    /// Whether the surface has kinks, or so few triangles that each of them is integrated accurately.
    is_delicate: bool,
}

fn stretch_of(surface: &Surface, mesh: &ChartTriangulation, breaks: &Breaks) -> Stretch {
    let is_divided = is_divided(mesh);
    let is_delicate = breaks.has_kinks || mesh.triangles.len() < FEW;
    // The value is not used for other faces, and computing it takes as long as a few triangles.
    let matters = is_divided || !is_delicate;
    Stretch {
        is_divided,
        is_even: matters && is_evenly_stretched(surface, mesh, breaks),
        is_delicate,
    }
}

/// The limits within which the triangles of a free surface count as plain. Returns `None` if each triangle is integrated
/// accurately.
fn plain(stretch: Stretch) -> Option<Plain> {
    match stretch {
        Stretch {
            is_delicate: true, ..
        }
        | Stretch {
            is_divided: false,
            is_even: false,
            ..
        } => None,
        Stretch {
            is_divided: true,
            is_even: true,
            ..
        } => Some(Plain {
            varies: VARIES,
            n_knots: 1,
        }),
        Stretch { .. } => Some(Plain {
            varies: HARDLY_VARIES,
            n_knots: 0,
        }),
    }
}

/// Whether there are enough vertices inside. Triangles that reach from boundary to boundary may be as large as the face.
fn is_divided(mesh: &ChartTriangulation) -> bool {
    mesh.nodes.len() >= mesh.n_bounding + FEW
}

/// The limits within which a triangle of a free surface counts as plain.
#[derive(Clone, Copy, Debug)]
struct Plain {
    /// The fraction by which the stretch in its middle may differ from that at its corners.
    varies: f64,
    /// The number of knots of each parameter that it may reach over.
    n_knots: usize,
}

/// Whether the stretch of a free surface hardly varies over a triangle, judging by its corners, its middle and the knots.
fn is_plain(corners: [Corner; 3], middle: f64, breaks: &Breaks, plain: Option<Plain>) -> bool {
    let Some(Plain { varies, n_knots }) = plain else {
        return false;
    };
    let [a, b, c] = corners.map(|corner| corner.density);
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let mean = mean_density(corners);
    (middle - mean).abs() <= varies * middle.max(mean)
        && high - low <= GROWS * high
        && n_breaks_inside(corners.map(|corner| corner.uv), &breaks.knots)
            .iter()
            .all(|&n| n <= n_knots)
}

/// The volume between a triangle and the paraboloid that passes through its corners and through `foot`, which lies above its
/// middle. It is three quarters of the height of `foot` times the triangle's area. `facet` is twice that area, as a vector.
fn volume_below(foot: Point, [a, b, c]: [Point; 3], facet: Point) -> f64 {
    let to_middle = [0, 1, 2].map(|axis| foot[axis] - (a[axis] + b[axis] + c[axis]) / 3.0);
    0.375 * dot(to_middle, facet)
}

/// The corners in the same period of the parameter plane. At a pole, a triangle is a trapezoid in the parameter plane, so a
/// second triangle completes it.
pub(super) fn unwrapped(chart: Chart, nodes: [&Node; 3]) -> ([Corner; 3], Option<[Corner; 3]>) {
    let corner = |node: &Node| {
        let [du, dv] = node.tangents;
        Corner {
            uv: node.uv,
            density: norm(cross(du, dv)),
        }
    };
    let corners = nodes.map(corner);
    let Chart::Polar {
        around,
        period,
        hub,
        ..
    } = chart
    else {
        return (corners, None);
    };
    let pole = nodes
        .iter()
        .position(|node| hub == 0.0 && node.x == [0.0, 0.0]);
    let first = pole.unwrap_or(0);
    let [a, mut b, mut c] = [0, 1, 2].map(|i| corners[(first + i) % 3]);
    let anchor = if pole.is_some() {
        b.uv[around]
    } else {
        a.uv[around]
    };
    b.uv[around] = near(b.uv[around], anchor, Some(period));
    c.uv[around] = near(c.uv[around], anchor, Some(period));
    if pole.is_none() {
        return ([a, b, c], None);
    }
    let at_pole = |meridian: Corner| {
        let mut corner = a;
        corner.uv[around] = meridian.uv[around];
        corner
    };
    ([at_pole(c), b, c], Some([at_pole(c), at_pole(b), b]))
}

/// The integral of an elementary surface's density over a triangle. The rule is exact for degree two. It is applied to the
/// quarters if the density varies much.
fn even_integral(surface: &Surface, corners: [Corner; 3], middle: f64) -> f64 {
    if is_even(corners, middle) {
        return rule(corners, middle);
    }
    let mut open = vec![(corners, middle, 0)];
    let mut total = 0.0;
    while let Some((corners, middle, depth)) = open.pop() {
        if depth >= MAX_DEPTH || is_even(corners, middle) {
            total += rule(corners, middle);
            continue;
        }
        let with_middle =
            |corners: [Corner; 3]| (corners, density_at(surface, center(corners)), depth + 1);
        open.extend(quarters(surface, corners).map(with_middle));
    }
    total
}

fn is_even(corners: [Corner; 3], middle: f64) -> bool {
    let mean = mean_density(corners);
    (middle - mean).abs() <= VARIES * middle.max(mean)
}

fn rule(corners: [Corner; 3], middle: f64) -> f64 {
    signed_area(corners.map(|corner| corner.uv)) * (0.75 * middle + 0.25 * mean_density(corners))
}

fn mean_density([a, b, c]: [Corner; 3]) -> f64 {
    (a.density + b.density + c.density) / 3.0
}

fn quarters(surface: &Surface, [a, b, c]: [Corner; 3]) -> [[Corner; 3]; 4] {
    let between = |p: Corner, q: Corner| {
        let uv = [0, 1].map(|axis| 0.5 * (p.uv[axis] + q.uv[axis]));
        Corner {
            uv,
            density: density_at(surface, uv),
        }
    };
    let (ab, bc, ca) = (between(a, b), between(b, c), between(c, a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

fn density_at(surface: &Surface, [u, v]: [f64; 2]) -> f64 {
    let (_, du, dv): (Point, Point, Point) = surface.derivatives(u, v);
    norm(cross(du, dv))
}

fn center(corners: [Corner; 3]) -> [f64; 2] {
    middle_of(corners.map(|corner| corner.uv))
}
