//! Fills the gaps between a face's triangles and its boundary, so that neighboring faces close exactly.
//!
//! Neighbors close exactly if each of them uses every side of its boundary once. This fails if boundaries cross or touch
//! themselves in the parameter plane, or if vertices coincide there. The gap between the border of the triangles and the boundary
//! is then a set of closed walks. Most of them are no wider than the defect. Each of them is filled. No vertex is moved. A
//! triangle is removed only if the filling folds back onto it.

use crate::geometry::linear::{scaled, sum};
use partprobe_shape::{Point, distance};
use std::collections::{BTreeMap, BTreeSet};

/// The largest number of corners of a walk that is filled by clipping corners. A larger walk is filled from its middle.
const MOST_CLIPPED: usize = 2000;

/// Triangles that fill the gaps, and the vertices that they need.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Filling {
    /// Vertices whose indices follow those of the mesh.
    pub(crate) points: Vec<Point>,
    /// Corners are indices into the mesh's vertices, followed by `points`.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Triangles of the mesh that would lie back to back with a triangle of the filling, in ascending order. Both are left out.
    pub(crate) cancelled: Vec<usize>,
}

/// Points with numbers. Points with equal coordinates have the same number.
#[derive(Default)]
struct NumberedPoints {
    points: Vec<Point>,
    number_of: BTreeMap<[u64; 3], u32>,
}

/// Directed sides. A side and its opposite cancel. A key has the lower number first. Its value counts the walks from the lower to
/// the higher number.
type Chain = BTreeMap<(u32, u32), i32>;

impl NumberedPoints {
    fn number(&mut self, point: Point) -> u32 {
        let next = self.points.len() as u32;
        let number = *self
            .number_of
            .entry(point.map(|x| (x + 0.0).to_bits()))
            .or_insert(next);
        if number == next {
            self.points.push(point);
        }
        number
    }

    fn numbers(&mut self, points: &[Point]) -> Vec<u32> {
        points.iter().map(|&point| self.number(point)).collect()
    }
}

/// Fills the gaps between triangles and the walks that bound them.
///
/// The triangles lie on the left of the walks. Some files write a walk in the wrong direction: if more triangles run against a
/// walk than along it, the walk is reversed.
pub(crate) fn filling(points: &[Point], triangles: &[[u32; 3]], walks: &[Vec<Point>]) -> Filling {
    let mut fill = Fill::default();
    let numbers = fill.numbered.numbers(points);
    let border = fill.border(triangles, &numbers);
    let mut missing: Chain = border
        .iter()
        .map(|(&side, &times)| (side, -times))
        .collect();
    for walk in walks {
        fill.add_walk(walk, &border, &mut missing);
    }
    for cycle in simple_cycles(&missing) {
        fill.cycle(cycle);
    }
    fill.finish(points.len(), &numbers)
}

fn add(chain: &mut Chain, from: u32, to: u32, times: i32) {
    if from != to {
        *chain.entry((from.min(to), from.max(to))).or_default() +=
            if from < to { times } else { -times };
    }
}

fn walks_along(chain: &Chain, from: u32, to: u32) -> i32 {
    let times = chain
        .get(&(from.min(to), from.max(to)))
        .copied()
        .unwrap_or_default();
    if from < to { times } else { -times }
}

/// The same triangle, with its corners rotated so that the lowest comes first.
fn lowest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a <= b && a <= c {
        [a, b, c]
    } else if b <= c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Closed walks that visit no point twice and together make up the chain.
fn simple_cycles(chain: &Chain) -> Vec<Vec<u32>> {
    let mut leaving: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (&(low, high), &times) in chain {
        let (from, to) = if times > 0 { (low, high) } else { (high, low) };
        leaving
            .entry(from)
            .or_default()
            .extend(std::iter::repeat_n(to, times.unsigned_abs() as usize));
    }
    let starts: Vec<u32> = leaving.keys().copied().collect();
    let mut cycles = Vec::new();
    for start in starts {
        let mut walk = vec![start];
        let mut step_of = BTreeMap::from([(start, 0)]);
        while let Some(next) = walk
            .last()
            .and_then(|at| leaving.get_mut(at))
            .and_then(Vec::pop)
        {
            match step_of.get(&next).copied() {
                Some(step) => {
                    let cycle = walk.split_off(step + 1);
                    for point in &cycle {
                        step_of.remove(point);
                    }
                    cycles.push(std::iter::once(next).chain(cycle).collect());
                }
                None => {
                    step_of.insert(next, walk.len());
                    walk.push(next);
                }
            }
        }
    }
    cycles
}

/// Triangles over numbered points.
#[derive(Default)]
struct Fill {
    numbered: NumberedPoints,
    /// Sides that the face already has. A second use of one of them would join more than two triangles.
    taken: BTreeSet<(u32, u32)>,
    /// The index of each triangle of the mesh, by its points.
    standing: BTreeMap<[u32; 3], usize>,
    triangles: Vec<[u32; 3]>,
    cancelled: Vec<usize>,
}

impl Fill {
    /// The border of the mesh's triangles. The triangles and their sides are also added to `standing` and `taken`. `numbers` are
    /// the numbers of the mesh's vertices.
    fn border(&mut self, triangles: &[[u32; 3]], numbers: &[u32]) -> Chain {
        let mut border = Chain::new();
        for (triangle, corners) in triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|corner| numbers[corner as usize]);
            self.standing.insert(lowest_first([a, b, c]), triangle);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                add(&mut border, from, to, 1);
                self.taken.insert((from.min(to), from.max(to)));
            }
        }
        border
    }

    /// Adds the sides of a walk to the missing sides, in the direction of most triangles along the walk.
    fn add_walk(&mut self, walk: &[Point], border: &Chain, missing: &mut Chain) {
        let numbers = self.numbered.numbers(walk);
        let next = numbers.iter().copied().cycle().skip(1);
        let sides: Vec<(u32, u32)> = numbers.iter().copied().zip(next).collect();
        let along: i32 = sides
            .iter()
            .map(|&(from, to)| walks_along(border, from, to).signum())
            .sum();
        let times = if along < 0 { -1 } else { 1 };
        for (from, to) in sides {
            add(missing, from, to, times);
            self.taken.insert((from.min(to), from.max(to)));
        }
    }

    /// Clips the corner with the shortest cut repeatedly. If every cut is taken, fills the rest from its middle.
    fn cycle(&mut self, mut cycle: Vec<u32>) {
        while cycle.len() > 3 {
            let n = cycle.len();
            let cut = |i: usize| (cycle[(i + n - 1) % n], cycle[(i + 1) % n]);
            let is_free = |&i: &usize| {
                let (before, after) = cut(i);
                !self.taken.contains(&(before.min(after), before.max(after)))
            };
            let length = |&i: &usize| {
                let (before, after) = cut(i);
                distance(
                    self.numbered.points[before as usize],
                    self.numbered.points[after as usize],
                )
            };
            let free = (0..n).filter(|_| n <= MOST_CLIPPED).filter(is_free);
            let Some(i) = free.min_by(|a, b| length(a).total_cmp(&length(b))) else {
                return self.fan(&cycle);
            };
            let (before, after) = cut(i);
            self.add([before, cycle[i], after]);
            self.taken.insert((before.min(after), before.max(after)));
            cycle.remove(i);
        }
        if let [a, b, c] = cycle[..] {
            self.add([a, b, c]);
        }
    }

    fn add(&mut self, [a, b, c]: [u32; 3]) {
        match self.standing.remove(&lowest_first([a, c, b])) {
            Some(triangle) => self.cancelled.push(triangle),
            None => self.triangles.push([a, b, c]),
        }
    }

    fn fan(&mut self, cycle: &[u32]) {
        let middle = self.middle(cycle);
        let next = cycle.iter().cycle().skip(1);
        self.triangles.extend(
            cycle
                .iter()
                .zip(next)
                .map(|(&from, &to)| [from, to, middle]),
        );
    }

    /// A point between the points of a cycle that differs from all of them. The mean alone may be equal to one of them.
    fn middle(&mut self, cycle: &[u32]) -> u32 {
        let point = |&number: &u32| self.numbered.points[number as usize];
        let total = cycle.iter().map(point).fold([0.0; 3], sum);
        let toward = |weight: usize| {
            let pull = cycle.first().map(point).unwrap_or_default();
            scaled(
                sum(total, scaled(pull, weight as f64)),
                1.0 / (cycle.len() + weight) as f64,
            )
        };
        let is_new = |middle: &Point| !cycle.iter().any(|number| point(number) == *middle);
        let middle = (0..=cycle.len())
            .map(toward)
            .find(is_new)
            .unwrap_or_else(|| toward(0));
        self.numbered.number(middle)
    }

    /// Converts numbers to vertex indices. A point of the mesh gets its index there, and a new point gets an index after those of
    /// the mesh.
    fn finish(self, n_points: usize, numbers: &[u32]) -> Filling {
        let mut index_of: Vec<Option<u32>> = vec![None; self.numbered.points.len()];
        for (index, &number) in (0..n_points as u32).zip(numbers) {
            index_of[number as usize].get_or_insert(index);
        }
        let mut filling = Filling {
            cancelled: self.cancelled,
            ..Filling::default()
        };
        filling.cancelled.sort_unstable();
        for corners in self.triangles {
            let corners = corners.map(|number| {
                *index_of[number as usize].get_or_insert_with(|| {
                    filling.points.push(self.numbered.points[number as usize]);
                    (n_points + filling.points.len() - 1) as u32
                })
            });
            filling.triangles.push(corners);
        }
        filling
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The sides that no other triangle walks in the opposite direction, and how often each of them is walked.
    fn border(points: &[Point], triangles: &[[u32; 3]]) -> BTreeMap<[[u64; 3]; 2], i32> {
        let key = |corner: u32| points[corner as usize].map(f64::to_bits);
        let mut border: BTreeMap<[[u64; 3]; 2], i32> = BTreeMap::new();
        for &[a, b, c] in triangles {
            let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| (key(from), key(to)));
            for (from, to) in sides.into_iter().filter(|(from, to)| from != to) {
                *border.entry([from.min(to), from.max(to)]).or_default() +=
                    if from < to { 1 } else { -1 };
            }
        }
        border.retain(|_, times| *times != 0);
        border
    }

    fn flat(corners: &[[f64; 2]]) -> Vec<Point> {
        corners.iter().map(|&[x, y]| [x, y, 0.0]).collect()
    }

    fn left(triangles: &[[u32; 3]], cancelled: &[usize]) -> Vec<[u32; 3]> {
        (0..)
            .zip(triangles)
            .filter(|(i, _)| !cancelled.contains(i))
            .map(|(_, &corners)| corners)
            .collect()
    }

    #[track_caller]
    fn check(points: &[Point], triangles: &[[u32; 3]], walks: &[Vec<Point>], n_missing: usize) {
        let found = filling(points, triangles, walks);
        assert_eq!(found.triangles.len(), n_missing);
        let all_points = [points, &found.points].concat();
        let all_triangles = [left(triangles, &found.cancelled), found.triangles.clone()].concat();
        let mut expected = BTreeMap::new();
        for walk in walks {
            for (from, to) in walk.iter().zip(walk.iter().cycle().skip(1)) {
                let (from, to) = (from.map(f64::to_bits), to.map(f64::to_bits));
                *expected.entry([from.min(to), from.max(to)]).or_insert(0) +=
                    if from < to { 1 } else { -1 };
            }
        }
        expected.retain(|_, times| *times != 0);
        assert_eq!(border(&all_points, &all_triangles), expected);
    }

    #[test]
    fn gaps_between_triangles_and_boundary_are_filled() {
        let square = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        check(
            &square,
            &[[0, 1, 2], [0, 2, 3]],
            std::slice::from_ref(&square),
            0,
        );
        // A missing ear, a missing face, a vertex on a side that the boundary does not have.
        check(&square, &[[0, 1, 2]], std::slice::from_ref(&square), 1);
        check(&[], &[], std::slice::from_ref(&square), 2);
        let with_middle = [square.clone(), flat(&[[0.5, 0.0]])].concat();
        check(
            &with_middle,
            &[[0, 4, 3], [4, 2, 3], [4, 1, 2]],
            std::slice::from_ref(&square),
            1,
        );
        // A triangle on the wrong side of a boundary side is removed.
        check(
            &with_middle,
            &[[0, 1, 2], [0, 2, 3], [0, 4, 1]],
            std::slice::from_ref(&square),
            0,
        );
        // A boundary that is written in the opposite direction is still the boundary.
        let reversed: Vec<Point> = square.iter().rev().copied().collect();
        assert_eq!(
            filling(&square, &[[0, 1, 2], [0, 2, 3]], &[reversed]),
            Filling::default()
        );
    }

    #[test]
    fn a_walk_whose_cuts_are_taken_is_filled_from_its_middle() {
        let square = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        let slits = [vec![square[0], square[2]], vec![square[1], square[3]]];
        let found = filling(
            &[],
            &[],
            &[square.clone(), slits[0].clone(), slits[1].clone()],
        );
        assert_eq!((found.points.len(), found.triangles.len()), (5, 4));
    }

    #[test]
    fn the_middle_of_a_walk_there_and_back_is_a_separate_point() {
        let mut fill = Fill::default();
        let cycle: Vec<u32> = [0.0, 1.0, 2.0, 1.0]
            .into_iter()
            .map(|x| fill.numbered.number([x, 0.0, 0.0]))
            .collect();
        assert_eq!(
            (cycle.as_slice(), fill.middle(&cycle)),
            ([0, 1, 2, 1].as_slice(), 3)
        );
    }

    proptest! {
        #[test]
        fn any_triangles_are_completed(
            corners in prop::collection::vec([0_u8..4, 0_u8..4, 0_u8..4], 3..12),
            triangles in prop::collection::vec([0_usize..12, 0_usize..12, 0_usize..12], 0..8),
        ) {
            let walk: Vec<Point> = corners.iter().map(|corner| corner.map(f64::from)).collect();
            let triangles: Vec<[u32; 3]> =
                triangles.iter().map(|corners| corners.map(|corner| (corner % walk.len()) as u32)).collect();
            let found = filling(&walk, &triangles, std::slice::from_ref(&walk));
            let points = [walk.clone(), found.points].concat();
            let whole = [left(&triangles, &found.cancelled), found.triangles].concat();
            let n = walk.len() as u32;
            let fan: Vec<[u32; 3]> = (1..n - 1).map(|i| [0, i, i + 1]).collect();
            let back: Vec<[u32; 3]> = fan.iter().map(|&[a, b, c]| [a, c, b]).collect();
            let border = border(&points, &whole);
            prop_assert!(border == super::tests::border(&walk, &fan) || border == super::tests::border(&walk, &back));
        }
    }
}
