//! Counts for each closed surface how many others enclose it.
//!
//! A surface is inside another one if points that it encloses are. Such a point is found on a column parallel to z: where the
//! column passes through both surfaces, the heights of their triangles show which is inside which, for any orientation of the
//! triangles. A column goes through the middle of a triangle and never through its border. Points on a shared border follow one
//! rule, so surfaces that touch are distinguished like any others.

use partprobe_shape::{Point, cross, dot, subtract};
use std::cell::OnceCell;

/// Number of columns that vote.
const COLUMNS: usize = 9;
/// A surface may stick out of the surface that encloses it by this fraction of the extent of the latter, because the chords of
/// both cut something off.
const STICKS_OUT: f64 = 0.05;
/// Number of triangles per band.
const PER_BAND: usize = 64;
/// Largest number of bands.
const MOST_BANDS: usize = 1024;

/// A surface of triangles.
pub(crate) struct Enclosure {
    triangles: Vec<[Point; 3]>,
    bounds: [[f64; 2]; 3],
    /// The enclosed volume, for any orientation of the triangles. It is `None` for an open surface.
    volume: Option<f64>,
    bands: OnceCell<Bands>,
    columns: OnceCell<Vec<Point>>,
}

/// The triangles, listed for each interval (band) of the first axis that they reach into.
struct Bands {
    per_unit: f64,
    triangles: Vec<Vec<u32>>,
}

impl Enclosure {
    /// Makes a surface of triangles. `volume` is the volume inside if the surface is closed.
    pub(crate) fn new(triangles: Vec<[Point; 3]>, volume: Option<f64>) -> Self {
        let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for corner in triangles.iter().flatten() {
            for (ends, &x) in bounds.iter_mut().zip(corner) {
                *ends = [ends[0].min(x), ends[1].max(x)];
            }
        }
        let volume = volume.map(f64::abs);
        Self {
            triangles,
            bounds,
            volume,
            bands: OnceCell::new(),
            columns: OnceCell::new(),
        }
    }

    /// The volume inside, or the volume of the bounding box. Surfaces are compared by it.
    fn size(&self, is_by_volume: bool) -> f64 {
        let of_bounds = || self.bounds.iter().map(|[low, high]| high - low).product();
        self.volume
            .filter(|_| is_by_volume)
            .unwrap_or_else(of_bounds)
    }

    /// Whether this surface fits into the bounds of another surface.
    fn may_lie_in(&self, other: &Self) -> bool {
        let slack = STICKS_OUT
            * other
                .bounds
                .iter()
                .map(|[low, high]| high - low)
                .fold(0.0, f64::max);
        let is_within = |(inner, outer): (&[f64; 2], &[f64; 2])| {
            inner[0] >= outer[0] - slack && inner[1] <= outer[1] + slack
        };
        self.bounds.iter().zip(&other.bounds).all(is_within)
    }

    /// Points inside this surface, at most one per column.
    fn inner_points(&self) -> &[Point] {
        self.columns.get_or_init(|| {
            let seen_from_above =
                |[a, b, c]: &[Point; 3]| cross(subtract(*b, *a), subtract(*c, *a))[2].abs();
            let mut largest: Vec<(f64, usize)> = self
                .triangles
                .iter()
                .map(seen_from_above)
                .zip(0..)
                .filter(|(area, _)| *area > 0.0)
                .collect();
            largest.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let middle = |&(_, triangle): &(f64, usize)| {
                let [a, b, c] = self.triangles[triangle];
                [0, 1].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0)
            };
            let columns = largest.iter().take(COLUMNS).map(middle);
            columns
                .filter_map(|at| inner_point(at, self.heights(at)))
                .collect()
        })
    }

    /// The heights at which a column passes through the surface, ascending.
    fn heights(&self, at: [f64; 2]) -> Vec<f64> {
        let bands = self
            .bands
            .get_or_init(|| Bands::new(&self.triangles, self.bounds[0]));
        let near = bands
            .at(at[0] - self.bounds[0][0])
            .iter()
            .map(|&triangle| &self.triangles[triangle as usize]);
        let mut heights: Vec<f64> = near.filter_map(|triangle| height(triangle, at)).collect();
        heights.sort_by(f64::total_cmp);
        heights
    }

    /// Whether a point is inside. Returns `None` if its column finds a leak.
    fn encloses(&self, [x, y, z]: Point) -> Option<bool> {
        let heights = self.heights([x, y]);
        let n_below = heights.iter().filter(|&&height| height < z).count();
        heights.len().is_multiple_of(2).then_some(n_below % 2 == 1)
    }

    /// Whether this surface lies in another one. Returns `None` if the columns do not decide.
    fn lies_in(&self, other: &Self) -> Option<bool> {
        let votes: Vec<bool> = self
            .inner_points()
            .iter()
            .filter_map(|&point| other.encloses(point))
            .collect();
        let n_inside = votes.iter().filter(|&&is_inside| is_inside).count();
        (2 * n_inside != votes.len()).then_some(2 * n_inside > votes.len())
    }
}

impl Bands {
    fn new(triangles: &[[Point; 3]], [low, high]: [f64; 2]) -> Self {
        let n_bands = (triangles.len() / PER_BAND).clamp(1, MOST_BANDS);
        let per_unit = if high > low {
            n_bands as f64 / (high - low)
        } else {
            0.0
        };
        let mut bands = Self {
            per_unit,
            triangles: vec![Vec::new(); n_bands],
        };
        for (index, corners) in (0..).zip(triangles) {
            let [a, b, c] = corners.map(|corner| corner[0] - low);
            let (from, to) = (bands.band(a.min(b).min(c)), bands.band(a.max(b).max(c)));
            bands.triangles[from..=to]
                .iter_mut()
                .for_each(|band| band.push(index));
        }
        bands
    }

    fn band(&self, x: f64) -> usize {
        // The conversion to an integer saturates, so any point has a band.
        ((x * self.per_unit) as usize).min(self.triangles.len() - 1)
    }

    fn at(&self, x: f64) -> &[u32] {
        &self.triangles[self.band(x)]
    }
}

/// The number of surfaces that enclose each surface. If the triangles do not decide, for example if surfaces coincide, a surface
/// lies in those that come before it.
pub(crate) fn depths(surfaces: &[Enclosure]) -> Vec<usize> {
    let lies_in = |inner: usize, outer: usize| {
        let (here, there) = (&surfaces[inner], &surfaces[outer]);
        let is_by_volume = here.volume.is_some() && there.volume.is_some();
        let (size, around) = (here.size(is_by_volume), there.size(is_by_volume));
        let is_smaller = size < around || (size == around && outer < inner);
        is_smaller && here.may_lie_in(there) && here.lies_in(there).unwrap_or(outer < inner)
    };
    let depth = |inner: usize| {
        (0..surfaces.len())
            .filter(|&outer| outer != inner && lies_in(inner, outer))
            .count()
    };
    (0..surfaces.len()).map(depth).collect()
}

/// The middle of the lowest interval of a column that is inside. Returns `None` if the column finds a leak.
fn inner_point([x, y]: [f64; 2], heights: Vec<f64>) -> Option<Point> {
    let &[low, high, ..] = heights.as_slice() else {
        return None;
    };
    (heights.len().is_multiple_of(2) && low < high).then_some([x, y, 0.5 * (low + high)])
}

/// The height at which a column passes through a triangle. Returns `None` if it misses the triangle.
fn height([a, b, c]: &[Point; 3], at: [f64; 2]) -> Option<f64> {
    let is_crossed = [(a, b), (b, c), (c, a)]
        .into_iter()
        .filter(|(from, to)| is_left_of(from, to, at))
        .count()
        % 2
        == 1;
    if !is_crossed {
        return None;
    }
    let normal = cross(subtract(*b, *a), subtract(*c, *a));
    let arm = [at[0] - a[0], at[1] - a[1], 0.0];
    let height = a[2] - dot(arm, normal) / normal[2];
    // If a triangle is parallel to the column, any of its heights will do.
    let (low, high) = (a[2].min(b[2]).min(c[2]), a[2].max(b[2]).max(c[2]));
    Some(if height.is_finite() {
        height.clamp(low, high)
    } else {
        0.5 * (low + high)
    })
}

/// Whether a side crosses the ray from a point along the first axis. The result is the same for both directions of the side, bit
/// by bit.
fn is_left_of(a: &Point, b: &Point, at: [f64; 2]) -> bool {
    let (low, high) = if a[1] <= b[1] { (a, b) } else { (b, a) };
    low[1] <= at[1] && at[1] < high[1] && {
        let fraction = (at[1] - low[1]) / (high[1] - low[1]);
        at[0] < low[0] + fraction * (high[0] - low[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A box between two corners, reversed if the second lies below the first.
    fn cuboid(low: Point, high: Point) -> Enclosure {
        let corner = |i: usize| {
            [0, 1, 2].map(|axis| {
                if i >> axis & 1 == 1 {
                    high[axis]
                } else {
                    low[axis]
                }
            })
        };
        let sides = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let triangles = sides
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let volume = (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]);
        Enclosure::new(
            triangles.map(|corners| corners.map(corner)).collect(),
            Some(volume),
        )
    }

    fn cube(low: f64, high: f64) -> Enclosure {
        cuboid([low; 3], [high; 3])
    }

    /// Six corners on the axes, so that it touches the cube around it.
    fn octahedron(reach: f64) -> Enclosure {
        let mut triangles = Vec::new();
        for x in [-reach, reach] {
            for y in [-reach, reach] {
                for z in [-reach, reach] {
                    triangles.push([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]);
                }
            }
        }
        Enclosure::new(triangles, Some(4.0 / 3.0 * reach * reach * reach))
    }

    #[track_caller]
    fn check(surfaces: Vec<Enclosure>, expected: &[usize]) {
        assert_eq!(depths(&surfaces), expected);
        let reversed: Vec<Enclosure> = surfaces
            .iter()
            .map(|surface| {
                let reversed = surface
                    .triangles
                    .iter()
                    .map(|&[a, b, c]| [a, c, b])
                    .collect();
                Enclosure::new(reversed, surface.volume.map(|volume| -volume))
            })
            .collect();
        assert_eq!(depths(&reversed), expected);
    }

    #[test]
    fn surfaces_are_nested_by_what_they_enclose() {
        check(vec![cube(0.0, 10.0)], &[0]);
        check(vec![cube(0.0, 10.0), cube(2.0, 8.0)], &[0, 1]);
        check(vec![cube(2.0, 8.0), cube(0.0, 10.0)], &[1, 0]);
        check(vec![cube(0.0, 10.0), cube(20.0, 30.0)], &[0, 0]);
        // An island in a void, a void in the island, and a second void next to them.
        let nest = vec![
            cube(4.0, 5.0),
            cube(0.0, 10.0),
            cube(3.0, 6.0),
            cube(1.0, 7.0),
            cube(8.0, 9.0),
        ];
        check(nest, &[3, 0, 2, 1, 1]);
        check(Vec::new(), &[]);
    }

    #[test]
    fn surfaces_that_touch_are_distinguished() {
        // On the outside of a side, on its inside, from wall to wall, at corners and at six points.
        check(
            vec![cube(0.0, 10.0), cuboid([10.0, 4.0, 4.0], [10.2, 5.0, 5.0])],
            &[0, 0],
        );
        check(
            vec![cube(0.0, 10.0), cuboid([9.8, 4.0, 4.0], [10.0, 5.0, 5.0])],
            &[0, 1],
        );
        check(
            vec![cube(0.0, 10.0), cuboid([0.0, 0.0, 4.0], [10.0, 10.0, 5.0])],
            &[0, 1],
        );
        check(
            vec![cube(0.0, 10.0), cube(0.0, 3.0), cube(3.0, 10.0)],
            &[0, 1, 1],
        );
        check(vec![octahedron(5.0), cube(-5.0, 5.0)], &[1, 0]);
        check(vec![cube(-5.0, 5.0), octahedron(5.0)], &[0, 1]);
        // Two surfaces that coincide are nested in the order in which they are written.
        check(vec![cube(0.0, 10.0), cube(0.0, 10.0)], &[0, 1]);
    }

    #[test]
    fn an_open_surface_encloses_as_far_as_its_columns_tell() {
        let mut open = cube(0.0, 10.0);
        open.triangles.truncate(11);
        let open = Enclosure::new(open.triangles, None);
        check(vec![open, cube(2.0, 8.0)], &[0, 1]);
        check(
            vec![Enclosure::new(Vec::new(), None), cube(2.0, 8.0)],
            &[0, 0],
        );
    }

    proptest! {
        #[test]
        fn nesting_of_boxes_follows_from_their_corners(
            boxes in prop::collection::vec((prop::array::uniform3(0_u8..12), prop::array::uniform3(1_u8..12)), 1..7),
        ) {
            let corners: Vec<[Point; 2]> = boxes
                .iter()
                .map(|(low, sides)| [low.map(f64::from), [0, 1, 2].map(|axis| f64::from(low[axis] + sides[axis]))])
                .collect();
            let lies_in = |inner: &[Point; 2], outer: &[Point; 2]| {
                (0..3).all(|axis| outer[0][axis] <= inner[0][axis] && inner[1][axis] <= outer[1][axis])
            };
            // Boxes that intersect have no order.
            let overlap = |a: &[Point; 2], b: &[Point; 2]| (0..3).all(|axis| a[0][axis] < b[1][axis] && b[0][axis] < a[1][axis]);
            let is_nested = |a: &[Point; 2], b: &[Point; 2]| !overlap(a, b) || lies_in(a, b) || lies_in(b, a);
            prop_assume!(corners.iter().enumerate().all(|(i, a)| corners[..i].iter().all(|b| a != b && is_nested(a, b))));
            let expected: Vec<usize> = corners
                .iter()
                .map(|inner| corners.iter().filter(|&outer| outer != inner && lies_in(inner, outer)).count())
                .collect();
            let surfaces: Vec<Enclosure> = corners.iter().map(|&[low, high]| cuboid(low, high)).collect();
            prop_assert_eq!(depths(&surfaces), expected);
        }
    }
}
