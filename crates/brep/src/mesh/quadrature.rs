//! Integrates a density over triangles of the parameter plane with a known accuracy.
//!
//! A parametrization may be slow at one point and fast at another, and is not smooth at knots. So triangles are cut along the
//! knots, and each piece is divided until two rules agree on it. The finest rule has seven points and is exact for degree five
//! (J. Radon, *Zur mechanischen Kubatur*, 1948).

/// A triangle of the parameter plane. Counter-clockwise triangles count as positive.
pub(super) type UvTriangle = [[f64; 2]; 3];

/// The largest number of times that one piece is quartered.
const MAX_DEPTH: u32 = 9;
/// The largest number of pieces into which knots cut one triangle. If the grid of knots is finer, the pieces are only quartered.
const MAX_PIECES: usize = 40_000;
/// A piece that would be thinner than this fraction of its triangle is not cut off.
const THINNEST: f64 = 1e-9;

/// Weights of the middle and of the six other points of Radon's rule. The rule is exact for polynomials of degree five.
const MIDDLE: f64 = 9.0 / 40.0;
const NEAR_CORNERS: f64 = 0.125_939_180_544_827_17;
const NEAR_SIDES: f64 = 0.132_394_152_788_506_16;
/// The two equal barycentric coordinates of those points.
const AT_CORNERS: f64 = 0.101_286_507_323_456_33;
const AT_SIDES: f64 = 0.470_142_064_105_115_1;
/// The weight of the middle in the rule that uses only the middle and the points near the corners. The rule is exact for degree
/// two.
const COARSE_MIDDLE: f64 = 0.484_123_422_436_514_8;

/// The accuracy at which an integral over a piece is accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Exactness {
    /// Two rules may differ by this fraction of the piece's integral.
    pub(super) relative: f64,
    /// Two rules may also differ by this amount.
    pub(super) absolute: f64,
    /// If the rule of the middle alone differs from the next rule by at most this fraction, the next rule is accepted. A value of
    /// 0 turns this test off.
    pub(super) at_a_glance: f64,
}

impl Exactness {
    fn allows(self, difference: f64, integral: f64) -> bool {
        difference.abs() <= self.absolute.max(self.relative * integral.abs())
    }
}

/// The knots of a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Breaks {
    /// The knots of u and of v.
    pub(super) knots: [Vec<f64>; 2],
    /// Whether the tangents may jump at the knots.
    pub(super) has_kinks: bool,
}

/// The integral of a density over a triangle.
pub(super) fn integral(
    triangle: UvTriangle,
    breaks: &Breaks,
    exactness: Exactness,
    density: &impl Fn([f64; 2]) -> f64,
) -> f64 {
    integral_from(triangle, None, breaks, exactness, density)
}

/// The same integral. `in_middle` is the density in the middle, if it is already known.
pub(super) fn integral_from(
    triangle: UvTriangle,
    in_middle: Option<f64>,
    breaks: &Breaks,
    exactness: Exactness,
    density: &impl Fn([f64; 2]) -> f64,
) -> f64 {
    if n_breaks_inside(triangle, &breaks.knots)
        .iter()
        .all(|&n| n == 0)
    {
        return smooth_integral(triangle, in_middle, exactness, density);
    }
    // If the surface is smooth at the knots, the triangle may need no cuts.
    if !breaks.has_kinks
        && exactness.at_a_glance > 0.0
        && let Some(integral) = at_once(triangle, in_middle, exactness, density)
    {
        return integral;
    }
    pieces(triangle, &breaks.knots)
        .into_iter()
        .map(|piece| smooth_integral(piece, None, exactness, density))
        .sum()
}

/// The numbers of knots of u and of v that a triangle reaches over.
pub(super) fn n_breaks_inside(triangle: UvTriangle, breaks: &[Vec<f64>; 2]) -> [usize; 2] {
    [0, 1].map(|axis| inner_breaks(triangle, axis, &breaks[axis]).len())
}

/// The knots of one parameter that cut a triangle.
fn inner_breaks(triangle: UvTriangle, axis: usize, breaks: &[f64]) -> &[f64] {
    if breaks.is_empty() {
        return breaks;
    }
    let [a, b, c] = triangle.map(|corner| corner[axis]);
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let margin = THINNEST * (high - low);
    let first = breaks.partition_point(|&x| x <= low + margin);
    let end = breaks.partition_point(|&x| x < high - margin);
    &breaks[first..end.max(first)]
}

/// Cuts a triangle along the knots.
fn pieces(triangle: UvTriangle, breaks: &[Vec<f64>; 2]) -> Vec<UvTriangle> {
    let mut open = vec![triangle];
    let mut done = Vec::new();
    while let Some(piece) = open.pop() {
        let is_full = done.len() + open.len() > MAX_PIECES;
        let cut = [0, 1].into_iter().find_map(|axis| {
            let inside = inner_breaks(piece, axis, &breaks[axis]);
            Some((axis, *inside.get(inside.len() / 2)?))
        });
        match cut.filter(|_| !is_full) {
            Some((axis, at)) => open.extend(halves(piece, axis, at)),
            None => done.push(piece),
        }
    }
    done
}

/// Cuts a triangle where one parameter has the value `at`. Returns one triangle on one side and two on the other.
fn halves(triangle: UvTriangle, axis: usize, at: f64) -> impl Iterator<Item = UvTriangle> {
    let is_low = triangle.map(|corner| corner[axis] < at);
    let n_low = is_low.iter().filter(|is_low| **is_low).count();
    // The corner that is alone on its side of the cut comes first.
    let alone = is_low
        .iter()
        .position(|&is_low| is_low == (n_low == 1))
        .unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|i| triangle[(alone + i) % 3]);
    let on_the_way = |to: [f64; 2]| {
        let fraction = ((at - a[axis]) / (to[axis] - a[axis])).clamp(0.0, 1.0);
        let mut point = [0, 1].map(|i| a[i] + fraction * (to[i] - a[i]));
        point[axis] = at;
        point
    };
    let (ab, ac) = (on_the_way(b), on_the_way(c));
    [[a, ab, ac], [ab, b, c], [ab, c, ac]]
        .into_iter()
        .filter(|&piece| signed_area(piece) != 0.0)
}

/// The integral of a smooth density over a triangle.
fn smooth_integral(
    triangle: UvTriangle,
    in_middle: Option<f64>,
    exactness: Exactness,
    density: &impl Fn([f64; 2]) -> f64,
) -> f64 {
    if let Some(integral) = at_once(triangle, in_middle, exactness, density) {
        return integral;
    }
    let mut open: Vec<(UvTriangle, u32)> = quarters(triangle).map(|quarter| (quarter, 1)).to_vec();
    let mut total = 0.0;
    while let Some((piece, depth)) = open.pop() {
        let exactness = if depth < MAX_DEPTH {
            exactness
        } else {
            Exactness {
                relative: f64::INFINITY,
                ..exactness
            }
        };
        match at_once(piece, None, exactness, density) {
            Some(integral) => total += integral,
            None => open.extend(quarters(piece).map(|quarter| (quarter, depth + 1))),
        }
    }
    total
}

/// The integral, from one application of the rules. Returns `None` if they do not agree. Their points lie inside the triangle,
/// because a surface may have a kink on a side.
fn at_once(
    triangle: UvTriangle,
    in_middle: Option<f64>,
    exactness: Exactness,
    density: &impl Fn([f64; 2]) -> f64,
) -> Option<f64> {
    let area = signed_area(triangle);
    let mean_at = |share: f64| points(triangle, share).map(density).iter().sum::<f64>() / 3.0;
    let middle = in_middle.unwrap_or_else(|| density(middle_of(triangle)));
    let near_corners = mean_at(AT_CORNERS);
    let coarse = area * (COARSE_MIDDLE * middle + (1.0 - COARSE_MIDDLE) * near_corners);
    if (coarse - area * middle).abs() <= exactness.at_a_glance * coarse.abs() {
        return Some(coarse);
    }

    let fine = area
        * (MIDDLE * middle
            + 3.0 * NEAR_CORNERS * near_corners
            + 3.0 * NEAR_SIDES * mean_at(AT_SIDES));
    // If the result is not finite, dividing the triangle does not help.
    (exactness.allows(fine - coarse, fine) || !fine.is_finite()).then_some(fine)
}

/// The three points that have two barycentric coordinates of this value.
fn points(corners: UvTriangle, share: f64) -> [[f64; 2]; 3] {
    let [a, b, c] = corners;
    let own = 1.0 - 3.0 * share;
    corners
        .map(|corner| [0, 1].map(|axis| share * (a[axis] + b[axis] + c[axis]) + own * corner[axis]))
}

/// The middle of a triangle.
pub(super) fn middle_of([a, b, c]: UvTriangle) -> [f64; 2] {
    [0, 1].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0)
}

/// The four triangles formed by the corners and the middles of the sides.
fn quarters([a, b, c]: UvTriangle) -> [UvTriangle; 4] {
    let middle = |p: [f64; 2], q: [f64; 2]| [0, 1].map(|axis| 0.5 * (p[axis] + q[axis]));
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// The area of a triangle in the parameter plane. It is positive if the corners run counter-clockwise.
pub(super) fn signed_area([a, b, c]: UvTriangle) -> f64 {
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const EXACT: Exactness = Exactness {
        relative: 1e-7,
        absolute: 1e-12,
        at_a_glance: 0.0,
    };
    const UNIT: UvTriangle = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

    #[track_caller]
    fn check(breaks: [&[f64]; 2], density: impl Fn([f64; 2]) -> f64, expected: f64) {
        let breaks = Breaks {
            knots: breaks.map(<[f64]>::to_vec),
            has_kinks: true,
        };
        let found = integral(UNIT, &breaks, EXACT, &density);
        assert!(
            (found - expected).abs() <= 1e-7 * expected,
            "{found}, expected {expected}"
        );
    }

    #[test]
    fn powers_and_jumps_have_closed_forms() {
        // Over the triangle below the diagonal, ∫ uᵐvⁿ = m!·n!/(m + n + 2)!.
        check([&[], &[]], |_| 1.0, 0.5);
        check([&[], &[]], |[u, v]| u * u * v * v * v, 12.0 / 5040.0);
        check([&[], &[]], |[u, _]| u.powi(9), 1.0 / 110.0);
        check(
            [&[], &[]],
            |[u, v]| (10.0 * u).sin() + 2.0 + v,
            1.0 + 1.0 / 6.0 + 0.1 - 0.01 * 10_f64.sin(),
        );
        check(
            [&[0.1], &[]],
            |[u, _]| if u < 0.1 { 50.0 } else { 1.0 },
            50.0 * 0.095 + 0.405,
        );
        check(
            [&[0.25, 0.5], &[0.5]],
            |[u, v]| (4.0 * u).floor().min(2.0) + (2.0 * v).floor(),
            0.28125 + 0.25 * 0.5 + 0.125,
        );
    }

    #[test]
    fn a_kink_along_a_side_is_not_seen() {
        check(
            [&[], &[]],
            |[u, v]| if u == 0.0 { 100.0 } else { 1.0 + u + v * v },
            0.5 + 1.0 / 6.0 + 1.0 / 12.0,
        );
    }

    proptest! {
        #[test]
        fn pieces_cover_their_triangle_once(
            triangle in prop::array::uniform3(prop::array::uniform2(-1.0_f64..2.0)),
            mut breaks in prop::array::uniform2(prop::collection::vec(-1.0_f64..2.0, 0..5)),
        ) {
            breaks.iter_mut().for_each(|breaks| breaks.sort_by(f64::total_cmp));
            let pieces = pieces(triangle, &breaks);
            let whole = signed_area(triangle);
            let total: f64 = pieces.iter().map(|&piece| signed_area(piece)).sum();
            prop_assert!((total - whole).abs() < 1e-9);
            prop_assert!(pieces.iter().all(|&piece| signed_area(piece) * whole >= -1e-12));
            prop_assert!(pieces.iter().all(|&piece| n_breaks_inside(piece, &breaks) == [0, 0]));
        }
    }
}
