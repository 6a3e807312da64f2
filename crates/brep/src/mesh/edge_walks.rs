//! Finds the direction in which the triangles of a face walk along each edge of its boundary.
//!
//! The loops of the file also give this direction, but the loop of a hole may have the wrong direction. The triangles fill the
//! face correctly even then, so they are more reliable.

use super::boundary::{BoundaryPoint, Segment};
use super::edge_points::EdgePoints;
use super::triangulated::Side;
use crate::model::EdgeUse;
use partprobe_shape::Point;
use std::collections::BTreeMap;

/// The directions in which triangles that are counter-clockwise in the chart walk the edges.
///
/// `is_reversed` says that the face's triangles are oriented opposite to those of the chart. An edge that has triangles on both
/// sides, or on neither side, is left out.
pub(crate) fn walks_of_sides(
    sides: &[Side],
    edges: &[Option<EdgePoints>],
    is_reversed: bool,
) -> Vec<EdgeUse> {
    let hand = if is_reversed { -1.0 } else { 1.0 };
    walks(sides, edges, |side| (side.segment, hand * side.side))
}

/// Finds the same directions from the triangles themselves. This is for a face whose boundary has sides that are not sides of the
/// chart.
pub(crate) fn walks_of_triangles(
    points: &[Point],
    triangles: &[[u32; 3]],
    polygons: &[Vec<BoundaryPoint>],
    edges: &[Option<EdgePoints>],
) -> Vec<EdgeUse> {
    let border = border(points, triangles);
    let mut walked: Vec<(Segment, f64)> = Vec::new();
    for polygon in polygons {
        let next = polygon.iter().cycle().skip(1);
        walked.extend(polygon.iter().zip(next).map(|(from, to)| {
            let n_times = |from: Point, to: Point| {
                border
                    .get(&(key(from), key(to)))
                    .copied()
                    .unwrap_or_default()
            };
            let hand = n_times(from.point, to.point) - n_times(to.point, from.point);
            (from.segment, f64::from(hand.signum()))
        }));
    }
    walks(&walked, edges, |&piece| piece)
}

/// For each pair of points, how often the triangles walk from the first to the second.
fn border(points: &[Point], triangles: &[[u32; 3]]) -> BTreeMap<([u64; 3], [u64; 3]), i32> {
    let mut border = BTreeMap::new();
    for corners in triangles {
        let [a, b, c] = corners.map(|corner| key(points[corner as usize]));
        for side in [(a, b), (b, c), (c, a)] {
            *border.entry(side).or_default() += 1;
        }
    }
    border
}

fn key(point: Point) -> [u64; 3] {
    point.map(|x| (x + 0.0).to_bits())
}

/// Finds the direction of each edge from the majority of its pieces, which are consecutive. `hand_of` returns the segment of a
/// piece, and a positive number if the triangles walk the piece from its beginning to its end.
fn walks<T>(
    pieces: &[T],
    edges: &[Option<EdgePoints>],
    hand_of: impl Fn(&T) -> (Segment, f64),
) -> Vec<EdgeUse> {
    let runs = pieces.chunk_by(|a, b| hand_of(a).0.edge == hand_of(b).0.edge);
    let direction = |run: &[T]| {
        let edge = hand_of(run.first()?).0.edge;
        let parameters = &edges.get(edge as usize)?.as_ref()?.parameters;
        let ascends = parameters.last()? - parameters.first()?;
        let along = |piece: &T| {
            let (segment, hand) = hand_of(piece);
            hand * (segment.to - segment.from).signum()
        };
        let hand = ascends.signum() * run.iter().map(along).sum::<f64>();
        (ascends != 0.0 && hand != 0.0).then_some(EdgeUse {
            edge,
            forward: hand > 0.0,
        })
    };
    runs.filter_map(direction).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Edge 0 is divided upward, edge 1 downward, edge 2 has no length.
    fn edges() -> Vec<Option<EdgePoints>> {
        let divided = |parameters: &[f64]| {
            Some(EdgePoints {
                parameters: parameters.to_vec(),
                points: vec![[0.0; 3]; parameters.len()],
            })
        };
        vec![
            divided(&[0.0, 1.0, 2.0]),
            divided(&[5.0, 4.0]),
            divided(&[1.0, 1.0]),
            None,
        ]
    }

    fn side(edge: u32, [from, to]: [f64; 2], side: f64) -> Side {
        Side {
            from: 0,
            to: 1,
            segment: Segment { edge, from, to },
            side,
        }
    }

    #[track_caller]
    fn check(sides: &[Side], is_reversed: bool, expected: &[(u32, bool)]) {
        let found: Vec<(u32, bool)> = walks_of_sides(sides, &edges(), is_reversed)
            .iter()
            .map(|walk| (walk.edge, walk.forward))
            .collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn the_side_of_the_triangles_says_which_way_an_edge_is_walked() {
        let there = [side(0, [0.0, 1.0], 1.0), side(0, [1.0, 2.0], 1.0)];
        check(&there, false, &[(0, true)]);
        check(&there, true, &[(0, false)]);
        check(
            &[side(0, [2.0, 1.0], 1.0), side(0, [1.0, 0.0], 1.0)],
            false,
            &[(0, false)],
        );
        check(
            &[side(0, [2.0, 1.0], -1.0), side(0, [1.0, 0.0], -1.0)],
            false,
            &[(0, true)],
        );
        check(
            &[side(1, [5.0, 4.0], 1.0), side(0, [0.0, 1.0], -1.0)],
            false,
            &[(1, true), (0, false)],
        );
        // Triangles on both sides, an edge without length, an edge without points.
        check(
            &[side(0, [0.0, 1.0], 1.0), side(0, [1.0, 2.0], -1.0)],
            false,
            &[],
        );
        check(
            &[
                side(2, [1.0, 1.0], 1.0),
                side(3, [0.0, 1.0], 1.0),
                side(9, [0.0, 1.0], 1.0),
            ],
            false,
            &[],
        );
    }

    #[test]
    fn triangles_alone_give_the_same_result() {
        let corners = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
        ];
        let segments = [(0, 0.0, 1.0), (0, 1.0, 2.0), (1, 5.0, 4.5), (1, 4.5, 4.0)];
        let polygon: Vec<BoundaryPoint> = corners
            .into_iter()
            .zip(segments)
            .map(|(point, (edge, from, to))| BoundaryPoint {
                point,
                segment: Segment { edge, from, to },
            })
            .collect();
        let walks = |triangles: &[[u32; 3]]| {
            let found = walks_of_triangles(
                &corners,
                triangles,
                std::slice::from_ref(&polygon),
                &edges(),
            );
            found
                .iter()
                .map(|walk| (walk.edge, walk.forward))
                .collect::<Vec<_>>()
        };
        assert_eq!(walks(&[[0, 1, 3], [1, 2, 3]]), [(0, true), (1, true)]);
        assert_eq!(walks(&[[0, 3, 1], [1, 3, 2]]), [(0, false), (1, false)]);
        // A side at which two triangles lie back to back does not count.
        assert_eq!(
            walks(&[[0, 1, 3], [0, 3, 1], [1, 2, 3]]),
            [(0, true), (1, true)]
        );
        assert_eq!(walks(&[]), []);
    }
}
