//! Triangulates any clean polygon with holes by ear clipping: bridges join the holes to the outer boundary, then ears are cut
//! off, the one with the shortest cut first.
//!
//! Bridges and ears are those of D. Eberly, *Triangulation by Ear Clipping*, Geometric Tools 2002; that every polygon has ears is
//! G. H. Meisters' two-ears theorem (1975). An ear must contain no other corner. This test need not be exact: after a wrong ear,
//! the rest cannot be cut into counter-clockwise triangles, and the result is `None`.

use super::clipper::Clipper;
use super::crossings::are_clean;
use super::network::{ChartPoint, Network, orientation};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Polygons with more pairs of a corner and a dent (a reflex corner) are left to another triangulation, whose cost grows more
/// slowly.
const MOST_PAIRS: usize = 60_000;

/// Triangulates a counter-clockwise polygon with clockwise holes. Returns `None` if the walks are not clean, if a hole does not
/// lie inside, or if there are more than [`MOST_PAIRS`] pairs of a corner and a dent.
pub(super) fn with_holes(points: &[ChartPoint], walks: &[Vec<u32>]) -> Option<Network> {
    if n_pairs(points, walks) > MOST_PAIRS || !are_clean(points, walks) || !are_holes(points, walks)
    {
        return None;
    }
    let mut clipper = Clipper::new(points);
    let firsts: Vec<u32> = walks
        .iter()
        .map(|walk| clipper.add_walk(walk.iter().copied()))
        .collect();
    add_bridges(&mut clipper, points, walks, &firsts)?;
    cut_ears(&mut clipper)?;
    clipper.finish()
}

/// The number of corners times the number of dents.
fn n_pairs(points: &[ChartPoint], walks: &[Vec<u32>]) -> usize {
    let is_dent = |walk: &[u32], i: usize| {
        let n = walk.len();
        let [a, b, c] = [walk[(i + n - 1) % n], walk[i], walk[(i + 1) % n]]
            .map(|vertex| points[vertex as usize]);
        (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]) <= 0.0
    };
    let n_dents: usize = walks
        .iter()
        .map(|walk| (0..walk.len()).filter(|&i| is_dent(walk, i)).count())
        .sum();
    n_dents * walks.iter().map(Vec::len).sum::<usize>()
}

/// Whether every walk but the first lies inside the first and outside all others. The walks do not meet.
fn are_holes(points: &[ChartPoint], walks: &[Vec<u32>]) -> bool {
    let encloses = |walk: &[u32], p: ChartPoint| {
        let next = walk.iter().cycle().skip(1);
        let sides = walk
            .iter()
            .zip(next)
            .map(|(&from, &to)| [from, to].map(|vertex| points[vertex as usize]));
        sides.filter(|&[a, b]| is_left_of(p, a, b)).count() % 2 == 1
    };
    walks.iter().enumerate().skip(1).all(|(i, hole)| {
        let point = points[hole[0] as usize];
        let holders = walks.iter().enumerate().filter(|&(j, _)| j != i);
        holders
            .into_iter()
            .all(|(j, walk)| encloses(walk, point) == (j == 0))
    })
}

/// Whether a ray from `p` along the first axis crosses the side from `a` to `b`.
fn is_left_of(p: ChartPoint, a: ChartPoint, b: ChartPoint) -> bool {
    if a[1] > p[1] {
        b[1] <= p[1] && orientation(a, b, p) < 0.0
    } else {
        b[1] > p[1] && orientation(a, b, p) > 0.0
    }
}

/// Joins every hole by a bridge to the walk on its left.
fn add_bridges(
    clipper: &mut Clipper<'_>,
    points: &[ChartPoint],
    walks: &[Vec<u32>],
    firsts: &[u32],
) -> Option<()> {
    let is_left = |a: ChartPoint, b: ChartPoint| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]));
    let mut ends: Vec<(ChartPoint, u32)> = Vec::with_capacity(walks.len() - 1);
    for (walk, &first) in walks.iter().zip(firsts).skip(1) {
        let corner = (0..walk.len())
            .min_by(|&i, &j| is_left(points[walk[i] as usize], points[walk[j] as usize]))?;
        ends.push((points[walk[corner] as usize], first + corner as u32));
    }
    ends.sort_unstable_by(|a, b| is_left(a.0, b.0).then(a.1.cmp(&b.1)));
    for (point, corner) in ends {
        let target = visible_corner(clipper, firsts[0], point)?;
        clipper.add_bridge(target, corner);
    }
    Some(())
}

/// A corner of the walk through `start` that can be joined to a point on its right.
fn visible_corner(clipper: &Clipper<'_>, start: u32, point: ChartPoint) -> Option<u32> {
    let hit = RayHit::of(clipper, start, point)?;
    let seen = hit.least_hidden(clipper, start);
    // The end of a bridge has two corners, and one of them may face away from the point.
    let vertex = clipper.vertex(seen);
    corners(clipper, start)
        .find(|&corner| clipper.vertex(corner) == vertex && opens_to(clipper, corner, point))
}

/// The first point where a ray from a point to the left meets a walk.
struct RayHit {
    point: ChartPoint,
    /// The first coordinate of the meeting point.
    x: f64,
    /// The right end of the side that is met.
    end: u32,
}

impl RayHit {
    fn of(clipper: &Clipper<'_>, start: u32, point: ChartPoint) -> Option<Self> {
        let mut reached: Option<Self> = None;
        for corner in corners(clipper, start) {
            let (a, b) = (clipper.point(corner), clipper.point(clipper.next(corner)));
            // The inside lies on the left of a side, so a side that faces the point runs downward.
            if a[1] >= point[1] && b[1] <= point[1] && a[1] != b[1] {
                let x = a[0] + (point[1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1]);
                let end = if a[0] < b[0] {
                    corner
                } else {
                    clipper.next(corner)
                };
                if x <= point[0] && reached.as_ref().is_none_or(|best| x > best.x) {
                    reached = Some(Self { point, x, end });
                }
            }
        }
        reached
    }

    /// The corner that is visible from the point.
    ///
    /// If a corner hides the end of the side, it lies in the triangle between that end, the point and the end of the ray. The
    /// corner of this triangle with the smallest angle to the ray is visible.
    fn least_hidden(&self, clipper: &Clipper<'_>, start: u32) -> u32 {
        let Self { point, x, end } = *self;
        let tip = clipper.point(end);
        let [low, high] = if tip[1] < point[1] {
            [tip, point]
        } else {
            [point, tip]
        };
        let mut best = (self.angle(tip), end);
        for corner in corners(clipper, start) {
            let p = clipper.point(corner);
            let is_near = p[0] < point[0] && p[0] >= tip[0] && p[1] >= low[1] && p[1] <= high[1];
            if !is_near || corner == end || !contains_point([point, [x, point[1]], tip], p) {
                continue;
            }
            let seen = self.angle(p);
            let is_nearer = seen < best.0 || (seen == best.0 && p[0] > clipper.point(best.1)[0]);
            if is_nearer && opens_to(clipper, corner, point) {
                best = (seen, corner);
            }
        }
        best.1
    }

    /// The tangent of the angle between the ray and the direction to a corner.
    fn angle(&self, p: ChartPoint) -> f64 {
        (p[1] - self.point[1]).abs() / (self.point[0] - p[0])
    }
}

/// The corners of a walk, beginning with one of them.
fn corners<'a>(clipper: &'a Clipper<'_>, start: u32) -> impl Iterator<Item = u32> + 'a {
    let mut next = Some(start);
    std::iter::from_fn(move || {
        let corner = next?;
        next = Some(clipper.next(corner)).filter(|&next| next != start);
        Some(corner)
    })
}

/// Whether a point lies in a triangle or on its border, for any orientation of the triangle.
fn contains_point([a, b, c]: [ChartPoint; 3], p: ChartPoint) -> bool {
    let orientations = [
        orientation(a, b, p),
        orientation(b, c, p),
        orientation(c, a, p),
    ];
    orientations.iter().all(|&orientation| orientation >= 0.0)
        || orientations.iter().all(|&orientation| orientation <= 0.0)
}

/// Whether the polygon's inside at a corner lies in the direction of a point.
fn opens_to(clipper: &Clipper<'_>, corner: u32, point: ChartPoint) -> bool {
    let [before, here, next] = clipper.around(corner);
    let (is_left_of_next, is_left_of_before) = (
        orientation(here, next, point) > 0.0,
        orientation(before, here, point) > 0.0,
    );
    if orientation(before, here, next) > 0.0 {
        is_left_of_next && is_left_of_before
    } else {
        is_left_of_next || is_left_of_before
    }
}

/// A corner that may be cut off, with the square of the cut's length. It is outdated if its neighbors have changed.
#[derive(PartialEq)]
struct Ear {
    squared: f64,
    corner: u32,
    ends: [u32; 2],
}

impl Eq for Ear {}

impl Ord for Ear {
    /// The shortest cut is the greatest ear.
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .squared
            .total_cmp(&self.squared)
            .then(other.corner.cmp(&self.corner))
    }
}

impl PartialOrd for Ear {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

fn ear(clipper: &Clipper<'_>, corner: u32) -> Ear {
    let ends = [clipper.before(corner), clipper.next(corner)];
    let [a, c] = ends.map(|corner| clipper.point(corner));
    let squared = (c[0] - a[0]) * (c[0] - a[0]) + (c[1] - a[1]) * (c[1] - a[1]);
    Ear {
        squared,
        corner,
        ends,
    }
}

/// Cuts ears off until nothing is left. Returns `None` if no ear can be cut.
fn cut_ears(clipper: &mut Clipper<'_>) -> Option<()> {
    // All corners are on one walk now, and the bridges' ends are its last ones.
    let dent = |corner: u32| (clipper.point(corner), corner);
    let mut dents: Vec<(ChartPoint, u32)> = corners(clipper, 0)
        .filter(|&corner| is_dent(clipper, corner))
        .map(dent)
        .collect();
    let mut start = 0;
    while clipper.n_left() > 2 {
        let n_before = clipper.n_left();
        let mut ears: BinaryHeap<Ear> = corners(clipper, start)
            .map(|corner| ear(clipper, corner))
            .collect();
        while let Some(Ear { corner, ends, .. }) = ears.pop() {
            if clipper.n_left() == 2 {
                break;
            }
            let stands = [clipper.before(corner), clipper.next(corner)] == ends
                && !is_cut_off(clipper, corner);
            if !stands || is_blocked(clipper, &mut dents, corner) || !clipper.cut(corner) {
                continue;
            }
            start = ends[0];
            ears.extend(ends.map(|corner| ear(clipper, corner)));
        }
        // A corner may become an ear after it was tested. If a pass makes no cut, there is no ear.
        if clipper.n_left() == n_before {
            return None;
        }
    }
    Some(())
}

fn is_dent(clipper: &Clipper<'_>, corner: u32) -> bool {
    let [a, b, c] = clipper.around(corner);
    orientation(a, b, c) <= 0.0
}

/// Whether another corner lies in the triangle of an ear. Only dents have to be tested. A corner that is not a dent any more is
/// removed from the list.
fn is_blocked(clipper: &Clipper<'_>, dents: &mut Vec<(ChartPoint, u32)>, corner: u32) -> bool {
    let [a, b, c] = clipper.around(corner);
    if orientation(a, b, c) <= 0.0 {
        return true;
    }
    let bounds = [0, 1].map(|axis| {
        [
            a[axis].min(b[axis]).min(c[axis]),
            a[axis].max(b[axis]).max(c[axis]),
        ]
    });
    let is_near =
        |p: ChartPoint| (0..2).all(|axis| p[axis] >= bounds[axis][0] && p[axis] <= bounds[axis][1]);
    let is_held = |p: ChartPoint| {
        p != a
            && p != b
            && p != c
            && [
                orientation(a, b, p),
                orientation(b, c, p),
                orientation(c, a, p),
            ]
            .iter()
            .all(|&orientation| orientation >= 0.0)
    };
    let mut i = 0;
    while let Some(&(point, dent)) = dents.get(i) {
        if !is_near(point) || !is_held(point) {
            i += 1;
        } else if is_cut_off(clipper, dent) || !is_dent(clipper, dent) {
            dents.swap_remove(i);
        } else {
            return true;
        }
    }
    false
}

/// Whether a corner was cut off. Then its neighbors do not refer to it any more.
fn is_cut_off(clipper: &Clipper<'_>, corner: u32) -> bool {
    clipper.next(clipper.before(corner)) != corner || clipper.before(clipper.next(corner)) != corner
}
