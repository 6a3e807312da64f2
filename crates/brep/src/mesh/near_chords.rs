//! Finds vertices of a face's boundary that are nearer to another of its curves than that curve's chord is, and divides that
//! curve next to them.
//!
//! The two circles of a ring that is thinner than the sag of their chords must be divided at the same angles. Otherwise a
//! triangle between a vertex of one circle and a chord of the other would be as high as the sag, for any width of the ring.

use super::boundary::Segment;
use super::contacts::{AT_END, Division, foot_on};
use super::triangulated::{ChartTriangulation, Side};
use crate::model::BrepEdge;
use partprobe_shape::{Point, cross, distance, norm, subtract};

/// If a boundary has more sides, nothing is searched for.
const MOST_SIDES: usize = 20_000;
/// A chord that sags by less than this fraction of the chord tolerance is straight.
const STRAIGHT: f64 = 1e-6;

/// The divisions that align the chords of neighboring curves. `chord` is the shape's chord tolerance, in millimeters.
pub(crate) fn near_chords(
    mesh: &ChartTriangulation,
    edges: &[BrepEdge],
    chord: f64,
) -> Vec<Division> {
    if mesh.sides.len() > MOST_SIDES {
        return Vec::new();
    }
    let nodes = nodes_by_first_axis(mesh);
    let mut divisions = Vec::new();
    for side in &mesh.sides {
        let Some(piece) = CurvePiece::of(mesh, edges, side) else {
            continue;
        };
        if piece.sag <= STRAIGHT * chord {
            continue;
        }
        let vertices = others_within(&nodes, &piece);
        divisions.extend(vertices.filter_map(|vertex| piece.division_at(vertex, chord)));
    }
    divisions
}

/// The boundary's vertices with the edges that begin there, in the order of their first coordinates.
fn nodes_by_first_axis(mesh: &ChartTriangulation) -> Vec<(Point, u32)> {
    let mut nodes: Vec<(Point, u32)> = mesh
        .sides
        .iter()
        .map(|side| (mesh.nodes[side.from].point, side.segment.edge))
        .collect();
    nodes.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
    nodes
}

/// A piece of a curve with its chord.
struct CurvePiece<'a> {
    edge: &'a BrepEdge,
    segment: Segment,
    /// The ends of the chord.
    ends: [Point; 2],
    /// The curve's point in the middle of the piece.
    tip: Point,
    /// The distance between that point and the middle of the chord.
    sag: f64,
}

impl<'a> CurvePiece<'a> {
    /// The piece of curve that a side of the boundary replaces. Returns `None` if the side has no edge.
    fn of(mesh: &ChartTriangulation, edges: &'a [BrepEdge], side: &Side) -> Option<Self> {
        let segment = side.segment;
        let edge = edges.get(segment.edge as usize)?;
        let [a, b] = [side.from, side.to].map(|node| mesh.nodes[node].point);
        let tip = edge.curve.point(0.5 * (segment.from + segment.to));
        let middle = [0, 1, 2].map(|axis| 0.5 * (a[axis] + b[axis]));
        Some(Self {
            edge,
            segment,
            ends: [a, b],
            tip,
            sag: distance(tip, middle),
        })
    }

    /// The lowest and the highest corner of a box around the piece.
    fn bounds(&self) -> [Point; 2] {
        let [a, b] = self.ends;
        let low = [0, 1, 2].map(|axis| a[axis].min(b[axis]).min(self.tip[axis]) - self.sag);
        let high = [0, 1, 2].map(|axis| a[axis].max(b[axis]).max(self.tip[axis]) + self.sag);
        [low, high]
    }

    /// The division at the foot of a vertex, if the vertex is nearer to the curve than the chord is.
    fn division_at(&self, vertex: Point, chord: f64) -> Option<Division> {
        let [a, b] = self.ends;
        let foot = foot_on(self.edge, self.segment, vertex);
        let foot_point = self.edge.curve.point(foot.parameter);
        let is_end = [a, b]
            .into_iter()
            .any(|end| distance(end, foot_point) <= AT_END * chord);
        let is_near = !is_end && distance(vertex, foot_point) < from_chord(foot_point, a, b);
        is_near.then_some(foot)
    }
}

/// The vertices of other curves in the box around a piece, without the piece's ends.
fn others_within(nodes: &[(Point, u32)], piece: &CurvePiece<'_>) -> impl Iterator<Item = Point> {
    let [low, high] = piece.bounds();
    let [a, b] = piece.ends;
    let edge = piece.segment.edge;
    let first = nodes.partition_point(|(point, _)| point[0] < low[0]);
    nodes[first..]
        .iter()
        .take_while(move |(point, _)| point[0] <= high[0])
        .filter(move |(point, other)| {
            *other != edge
                && *point != a
                && *point != b
                && (1..3).all(|axis| point[axis] >= low[axis] && point[axis] <= high[axis])
        })
        .map(|&(vertex, _)| vertex)
}

/// The distance of a point from the line through two other points.
fn from_chord(point: Point, a: Point, b: Point) -> f64 {
    let along = subtract(b, a);
    norm(cross(subtract(point, a), along)) / norm(along)
}
