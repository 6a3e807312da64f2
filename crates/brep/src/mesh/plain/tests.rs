//! Tests the plain triangulation against the laws of a triangulation and against the general one.

use super::network::orientation;
use super::*;
use proptest::prelude::*;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::BTreeSet;
use std::f64::consts::TAU;

/// Corners at equal angles and at the given distances from the middle. The points are skewed like those of charts, so that no
/// four of them lie on a circle.
fn star(middle: ChartPoint, distances: &[f64]) -> Vec<ChartPoint> {
    let n = distances.len() as f64;
    let corner = |(i, distance): (usize, &f64)| {
        let (sin, cos) = (TAU * i as f64 / n).sin_cos();
        let (x, y) = (middle[0] + distance * cos, middle[1] + distance * sin);
        [x + 0.043 * y, 1.061 * y]
    };
    distances.iter().enumerate().map(corner).collect()
}

fn area_of(network: &Network) -> f64 {
    let doubled = |triangle: usize| {
        let [a, b, c] = network.corner_points(triangle);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    0.5 * (0..network.corners.len()).map(doubled).sum::<f64>()
}

fn signed_area(points: &[ChartPoint], walk: &[u32]) -> f64 {
    let start = points[walk[0] as usize];
    let arm = |vertex: u32| [0, 1].map(|axis| points[vertex as usize][axis] - start[axis]);
    let doubled = |pair: &[u32]| {
        let [a, b] = [arm(pair[0]), arm(pair[1])];
        a[0] * b[1] - a[1] * b[0]
    };
    0.5 * walk.windows(2).map(doubled).sum::<f64>()
}

/// Checks that every triangle runs counter-clockwise, that neighbors refer to each other, that the sides without a neighbor are
/// the boundary, and that the area is that of the boundary.
fn check_laws(face: &PlainFace, walks: &[Vec<ChartPoint>]) {
    let network = &face.network;
    let mut border = BTreeSet::new();
    for (triangle, corners) in network.corners.iter().enumerate() {
        let [a, b, c] = network.corner_points(triangle);
        assert!(orientation(a, b, c) > 0.0);
        for side in 0..3 {
            let ends = [corners[side], corners[(side + 1) % 3]];
            if network.is_boundary(triangle, side) {
                assert!(border.insert(ends));
                continue;
            }
            let (other, other_side) = network::triangle_and_side(network.behind[triangle][side]);
            let beyond = network.corners[other];
            assert_eq!([beyond[(other_side + 1) % 3], beyond[other_side]], ends);
        }
    }
    let mut first = 0;
    let mut expected = BTreeSet::new();
    for (walk, hand) in walks.iter().zip(&face.hands) {
        let n = walk.len() as u32;
        let sides = (0..n).map(|i| [first + i, first + (i + 1) % n]);
        expected.extend(sides.map(|[from, to]| if *hand > 0.0 { [from, to] } else { [to, from] }));
        first += n;
    }
    assert_eq!(border, expected);
    let signed = walks.iter().zip(&face.hands).map(|(walk, hand)| {
        let all: Vec<u32> = (0..walk.len() as u32).collect();
        hand * signed_area(walk, &all)
    });
    let area: f64 = signed.sum();
    // Both sums are rounded. For a sliver they may not have a single correct digit.
    let rounding = 1e-14 * network.points.len() as f64 * extent(&network.points).powi(2);
    assert!(
        (area_of(network) - area).abs() <= 1e-9 * area.abs() + rounding,
        "{} for {area}",
        area_of(network)
    );
}

/// The longer side of the box around the points.
fn extent(points: &[ChartPoint]) -> f64 {
    let along = |axis: usize| {
        let values = || points.iter().map(|point| point[axis]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    along(0).max(along(1))
}

fn lowest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    let low = a.min(b).min(c);
    if a == low {
        [a, b, c]
    } else if b == low {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// The triangles of the general triangulation that lie between the walks.
fn by_spade(walks: &[Vec<ChartPoint>], inner: &[ChartPoint]) -> BTreeSet<[u32; 3]> {
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    for walk in walks {
        let handles: Vec<_> = walk
            .iter()
            .map(|&[x, y]| cdt.insert(Point2::new(x, y)).unwrap())
            .collect();
        for (i, &from) in handles.iter().enumerate() {
            cdt.add_constraint(from, handles[(i + 1) % handles.len()]);
        }
    }
    inner.iter().for_each(|&[x, y]| {
        cdt.insert(Point2::new(x, y)).unwrap();
    });
    let is_inside = |[x, y]: ChartPoint| {
        let crossed = |walk: &Vec<ChartPoint>| {
            let next = walk.iter().cycle().skip(1);
            walk.iter()
                .zip(next)
                .filter(|&(&a, &b)| crate::mesh::layout::is_crossed(a, b, [x, y]))
                .count()
        };
        walks.iter().map(crossed).sum::<usize>() % 2 == 1
    };
    let faces = cdt
        .inner_faces()
        .filter(|face| is_inside(face.center().into()));
    faces
        .map(|face| lowest_first(face.vertices().map(|vertex| vertex.fix().index() as u32)))
        .collect()
}

fn face_of(walks: &[Vec<ChartPoint>]) -> Option<PlainFace> {
    let lengths: Vec<usize> = walks.iter().map(Vec::len).collect();
    PlainFace::new(&walks.concat(), &lengths)
}

/// Triangulates, checks all laws and compares with the general triangulation.
#[track_caller]
fn check(walks: &[Vec<ChartPoint>], inner: &[ChartPoint]) {
    let mut face = face_of(walks).unwrap();
    check_laws(&face, walks);
    let held = face.holders(inner);
    let inside: Vec<ChartPoint> = inner
        .iter()
        .zip(held)
        .filter(|(_, held)| held.is_some())
        .map(|(&point, _)| point)
        .collect();
    for &point in &inside {
        face.insert(point).unwrap();
    }
    check_laws(&face, walks);
    let found: BTreeSet<_> = face.triangles().iter().copied().map(lowest_first).collect();
    assert_eq!(found, by_spade(walks, &inside));
}

fn reversed(mut walk: Vec<ChartPoint>, is_reversed: bool) -> Vec<ChartPoint> {
    if is_reversed {
        walk.reverse();
    }
    walk
}

#[test]
fn every_way_gives_the_same_triangles() {
    let circle = |n: usize, radius: f64| star([0.0; 2], &vec![radius; n]);
    let dented = [1.0, 0.3, 1.0, 0.9, 0.2, 1.0, 0.95, 0.25, 1.1, 0.4, 0.8];
    for is_reversed in [false, true] {
        check(
            &[reversed(circle(40, 1.0), is_reversed)],
            &star([0.1, 0.0], &[0.5; 9]),
        );
        check(
            &[reversed(star([0.0; 2], &dented), is_reversed)],
            &star([0.0; 2], &[0.15; 5]),
        );
        check(
            &[circle(40, 1.0), reversed(circle(24, 0.9), is_reversed)],
            &[],
        );
        check(
            &[reversed(circle(24, 0.9), is_reversed), circle(40, 1.0)],
            &[],
        );
        let plate = [
            star([0.0; 2], &[10.0; 4]),
            reversed(star([3.0, 2.0], &[1.0; 12]), is_reversed),
        ];
        let plate = [
            plate.as_slice(),
            &[star([-2.0, -3.0], &dented), star([-3.0, 3.5], &[1.5; 7])],
        ]
        .concat();
        check(&plate, &star([0.5, 0.25], &[2.75; 17]));
    }
}

#[track_caller]
fn check_refusal(walks: &[&[ChartPoint]]) {
    let walks: Vec<Vec<ChartPoint>> = walks.iter().map(|walk| walk.to_vec()).collect();
    assert!(face_of(&walks).is_none());
}

#[test]
fn what_is_not_plain_is_refused() {
    let square: &[ChartPoint] = &[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
    let inside: &[ChartPoint] = &[[1.0, 1.0], [2.0, 1.5], [1.0, 2.0]];
    assert!(face_of(&[square.to_vec(), inside.to_vec()]).is_some());
    // A bow, a spike, a double corner, a boundary of two corners.
    check_refusal(&[&[[0.0, 0.0], [4.0, 4.0], [4.0, 0.0], [0.0, 4.0]]]);
    check_refusal(&[&[
        [0.0, 0.0],
        [4.0, 0.0],
        [6.0, 0.0],
        [4.0, 0.0],
        [4.0, 4.0],
        [0.0, 4.0],
    ]]);
    check_refusal(&[&[[0.0, 0.0], [4.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]]);
    check_refusal(&[&[[0.0, 0.0], [4.0, 0.0]]]);
    // A walk that winds twice, and crosses itself.
    check_refusal(&[&[
        [4.0, 0.0],
        [0.0, 4.0],
        [-4.0, 0.0],
        [0.0, -4.0],
        [2.0, 0.5],
        [0.5, 2.0],
        [-2.0, 0.5],
        [0.5, -2.0],
    ]]);
    // Holes that touch a side, share a corner, cross it, lie outside, lie in another hole.
    check_refusal(&[square, &[[0.0, 1.0], [2.0, 1.5], [1.0, 2.0]]]);
    check_refusal(&[square, &[[4.0, 4.0], [2.0, 1.5], [1.0, 2.0]]]);
    check_refusal(&[square, &[[1.0, 1.0], [5.0, 1.5], [1.0, 2.0]]]);
    check_refusal(&[square, &[[5.0, 1.0], [6.0, 1.5], [5.0, 2.0]]]);
    check_refusal(&[square, inside, &[[1.2, 1.3], [1.5, 1.5], [1.2, 1.6]]]);
    check_refusal(&[&[[0.0, 0.0], [f64::NAN, 0.0], [4.0, 4.0]]]);
}

/// The shoelace sum of this triangle is rounded to 0, although its corners do not lie on one line.
#[test]
fn a_sliver_keeps_its_sense() {
    let shift = 0.02514205387650238;
    let mut walk: Vec<ChartPoint> = vec![
        [2.0, -2.0 + shift],
        [1.0, -1.0 + shift],
        [5.0, -5.0 + shift],
    ];
    let all = [0, 1, 2];
    assert_eq!(signed_area(&walk, &all), 0.0);
    for is_reversed in [false, true] {
        for _ in 0..3 {
            walk.rotate_left(1);
            let walks = [reversed(walk.clone(), is_reversed)];
            let [a, b, c] = all.map(|corner| walks[0][corner as usize]);
            let face = face_of(&walks).unwrap();
            assert_eq!(face.hands, [orientation(a, b, c).signum()]);
            check_laws(&face, &walks);
        }
    }
}

proptest! {
    #[test]
    fn stars_inside_stars_are_triangulated(
        outer in prop::collection::vec(2.0_f64..4.0, 3..60),
        hole in prop::collection::vec(0.2_f64..0.9, 3..30),
        middle in prop::array::uniform2(-0.3_f64..0.3),
        inner in prop::collection::vec(prop::array::uniform2(-4.0_f64..4.0), 0..60),
    ) {
        let walks = [star([0.0; 2], &outer), star(middle, &hole)];
        // If there are few and distant corners, a side may cut the hole.
        match face_of(&walks) {
            Some(_) => check(&walks, &inner),
            None => prop_assert!(outer.len() < 8),
        }
        check(&walks[..1], &inner);
    }

    #[test]
    fn any_walks_give_a_triangulation_or_nothing(
        walks in prop::collection::vec(prop::collection::vec(prop::array::uniform2(-5_i8..6), 3..10), 1..4),
        shift in prop::collection::vec(prop::array::uniform2(-0.1_f64..0.1), 4),
    ) {
        let walks: Vec<Vec<ChartPoint>> = walks
            .iter()
            .zip(&shift)
            .map(|(walk, shift)| walk.iter().map(|point| [0, 1].map(|i| f64::from(point[i]) + shift[i])).collect())
            .collect();
        if let Some(face) = face_of(&walks) {
            check_laws(&face, &walks);
        }
    }

    #[test]
    fn wavy_bands_of_any_width(
        n in 8_usize..60,
        width in 0.001_f64..1.0,
        waves in prop::collection::vec(-0.3_f64..0.3, 1..5),
    ) {
        let distance = |i: usize, base: f64| {
            let angle = TAU * i as f64 / n as f64;
            base + waves.iter().enumerate().map(|(k, wave)| wave * (angle * (k + 1) as f64).cos()).sum::<f64>() / 4.0
        };
        let rim = |base: f64| star([0.0; 2], &(0..n).map(|i| distance(i, base)).collect::<Vec<_>>());
        check(&[rim(1.0 + width), rim(1.0)], &[]);
    }
}
