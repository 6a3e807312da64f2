//! Finds the points at which the edges of a face must be divided because its boundaries are nearer to each other than their
//! chords are.
//!
//! A hole may touch a rim without sharing a vertex with it. The chords of the rim then cut off the corner of the hole, although
//! the curves do not cross. Between a chord and its curve there is a sliver. If a boundary vertex lies in that sliver, the edge
//! must be divided at the foot of the vertex (the nearest point of the curve). If chords cross but no vertex lies in a sliver,
//! both pieces are halved. Nothing here divides an edge: that is done for both of its faces at once.
//!
//! Only different boundaries are compared. The outline of a sliver crosses itself in many ways. Such a face is meshed finer
//! instead.

use super::boundary::Segment;
use super::layout::Layout;
use super::triangulated::{ChartTriangulation, Node};
use super::unwrap::near;
use crate::geometry::nearest::nearest_parameter;
use crate::geometry::{Curve, Projector, Surface};
use crate::model::BrepEdge;
use partprobe_shape::{Point, distance, subtract};

/// If a boundary has more sides, contacts are not searched for.
const MOST_SIDES: usize = 20_000;
/// Number of pieces into which a piece of curve is divided to find a foot. Their ends are compared.
const SAMPLES: usize = 8;
/// How far a vertex may lie beyond a sliver and still count, as a fraction of the sliver's height. Slivers are not exact
/// parabolas.
const BEYOND: f64 = 0.1;
/// A vertex lies on a side if it is nearer than this fraction of the boundary's extent in the chart.
const ON_SIDE: f64 = 1e-9;
/// A foot is the end of its piece if it is nearer than this fraction of the chord tolerance.
pub(crate) const AT_END: f64 = 1e-5;
/// A piece that bends by less than this fraction of the chord tolerance is not halved: the curves themselves cross there.
const STRAIGHT: f64 = 1e-4;

/// A point at which an edge should be divided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Division {
    /// Index of the edge.
    pub(crate) edge: u32,
    /// Parameter of its curve.
    pub(crate) parameter: f64,
    /// The vertex of another piece of the boundary whose foot this is, or `None` if the piece is only halved.
    pub(crate) vertex: Option<Point>,
}

/// A side of the boundary in the chart.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// Index of its loop.
    bound: usize,
    nodes: [usize; 2],
    ends: [[f64; 2]; 2],
    segment: Segment,
    /// Whether the edge ends there.
    is_vertex: [bool; 2],
    /// From the middle of the chord to the middle of the curve.
    bow: [f64; 2],
    low: [f64; 2],
    high: [f64; 2],
}

/// The data of a face from which contacts are found.
#[derive(Clone, Copy)]
pub(crate) struct Boundary<'a> {
    /// Its surface.
    pub(crate) surface: &'a Surface,
    /// The projector of that surface.
    pub(crate) projector: &'a Projector<'a>,
    /// The layout of its loops in the chart.
    pub(crate) layout: &'a Layout,
    /// Its triangles and the boundary's nodes.
    pub(crate) mesh: &'a ChartTriangulation,
    /// The shape's edges.
    pub(crate) edges: &'a [BrepEdge],
    /// The chord tolerance, in millimeters.
    pub(crate) chord: f64,
}

impl Boundary<'_> {
    /// The points at which edges must be divided. There are nearly always none, because the boundaries lie in the chart as they
    /// do on the surface. This test costs almost nothing.
    pub(crate) fn contacts(&self) -> Vec<Division> {
        if !self.is_suspect() {
            return Vec::new();
        }
        let pieces = self.pieces();
        let extent = extent_of(&pieces);
        let mut divisions = Vec::new();
        for (i, a) in pieces.iter().enumerate() {
            let may_meet = pieces[i + 1..].iter().take_while(|b| b.low[0] <= a.high[0]);
            for b in may_meet
                .filter(|b| a.bound != b.bound && b.low[1] <= a.high[1] && a.low[1] <= b.high[1])
            {
                self.between(a, b, extent, &mut divisions);
            }
        }
        divisions
    }

    /// Whether sides cross, or whether some have the face on their left and others on their right.
    fn is_suspect(&self) -> bool {
        let sides = &self.mesh.sides;
        let n_sides = sides.len();
        let n_left = sides.iter().filter(|side| side.side > 0.0).count();
        let has_holes = self.layout.loops.len() > 1;
        has_holes
            && n_sides <= MOST_SIDES
            && (self.mesh.has_crossings || (n_left > 0 && n_left < n_sides))
    }

    /// The sides that replace pieces of curves. Those that begin farthest left come first.
    fn pieces(&self) -> Vec<Piece> {
        let mut pieces = Vec::new();
        let mut first = 0;
        for (index, bound) in self.layout.loops.iter().enumerate() {
            let n = bound.corners.len();
            for (i, corner) in bound.corners.iter().enumerate() {
                let nodes = [first + i, first + (i + 1) % n];
                let neighbor = |i: usize| bound.corners[i % n].segment;
                let joins = |a: Option<Segment>, b: Option<Segment>| {
                    a.zip(b)
                        .is_some_and(|(a, b)| a.edge == b.edge && a.to == b.from)
                };
                let is_vertex =
                    [(i + n - 1, i), (i, i + 1)].map(|(i, j)| !joins(neighbor(i), neighbor(j)));
                pieces.extend(
                    corner
                        .segment
                        .and_then(|segment| self.piece(nodes, segment, is_vertex))
                        .map(|piece| Piece {
                            bound: index,
                            ..piece
                        }),
                );
            }
            first += n;
        }
        pieces.sort_by(|a, b| a.low[0].total_cmp(&b.low[0]));
        pieces
    }

    fn piece(&self, nodes: [usize; 2], segment: Segment, is_vertex: [bool; 2]) -> Option<Piece> {
        let [from, to] = nodes.map(|node| &self.mesh.nodes[node]);
        let ends = [from.x, to.x];
        let bow = self.bow(from, to, segment)?;
        let tip =
            [0, 1].map(|axis| 0.5 * (ends[0][axis] + ends[1][axis]) + (1.0 + BEYOND) * bow[axis]);
        // The bounding box of the parallelogram in which the sliver lies.
        let reach = |pick: fn(f64, f64) -> f64| {
            [0, 1].map(|axis| {
                let half = 0.5 * (ends[1][axis] - ends[0][axis]);
                let at_tip = pick(tip[axis] - half, tip[axis] + half);
                pick(pick(ends[0][axis], ends[1][axis]), at_tip)
            })
        };
        Some(Piece {
            bound: 0,
            nodes,
            ends,
            segment,
            is_vertex,
            bow,
            low: reach(f64::min),
            high: reach(f64::max),
        })
    }

    /// The vector from the middle of a chord to the middle of its curve, in the chart.
    fn bow(&self, from: &Node, to: &Node, segment: Segment) -> Option<[f64; 2]> {
        let curve = &*self.edges.get(segment.edge as usize)?.curve;
        let middle = curve.point(0.5 * (segment.from + segment.to));
        let period = self.surface.period();
        let chord = [0, 1].map(|axis| near(to.uv[axis] - from.uv[axis], 0.0, period[axis]));
        let seed = [0, 1].map(|axis| from.uv[axis] + 0.5 * chord[axis]);
        let found = self.projector.project(middle, Some(seed)).uv;
        let uv = [0, 1].map(|axis| near(found[axis], seed[axis], period[axis]));
        let x = self.layout.chart.to_plane(uv);
        Some([0, 1].map(|axis| x[axis] - 0.5 * (from.x[axis] + to.x[axis])))
    }

    /// The divisions that two pieces need.
    fn between(&self, a: &Piece, b: &Piece, extent: f64, divisions: &mut Vec<Division>) {
        // A straight piece is divided only if no curved piece can be divided.
        let mut pairs = [(a, b), (b, a)];
        pairs.sort_by_key(|(piece, _)| self.is_straight(piece));
        let feet = pairs.map(|(piece, other)| self.feet_in_sliver(piece, other, extent));
        if feet.iter().all(Vec::is_empty) && !cross_each_other(a.ends, b.ends) {
            return;
        }
        for (&(piece, _), mut feet) in pairs.iter().zip(feet) {
            feet.retain(|foot| !self.is_at_end(piece, foot));
            if !feet.is_empty() {
                return divisions.extend(feet);
            }
        }
        if let Some(division) = self.near_ends(a, b) {
            return divisions.push(division);
        }
        // No vertex lies in a sliver, but the sides cross. A vertex may lie beyond the other curve by a rounding error.
        for (piece, other) in pairs {
            let feet = self.new_feet_on_curve(piece, other);
            if !feet.is_empty() {
                return divisions.extend(feet);
            }
        }
        divisions.extend([a, b].into_iter().filter_map(|piece| self.half(piece)));
    }

    /// The feet on `piece` of the ends of `other` that lie in the sliver between `piece` and its chord.
    fn feet_in_sliver(&self, piece: &Piece, other: &Piece, extent: f64) -> Vec<Division> {
        let nodes = other.nodes.into_iter().zip(other.ends);
        nodes
            .filter(|(_, x)| piece.contains_point(*x, ON_SIDE * extent))
            .filter_map(|(node, _)| self.foot(piece, node))
            .collect()
    }

    /// The feet on `piece` of the ends of `other` that lie on its curve, but not at its ends.
    fn new_feet_on_curve(&self, piece: &Piece, other: &Piece) -> Vec<Division> {
        other
            .nodes
            .into_iter()
            .filter_map(|node| self.foot(piece, node))
            .filter(|foot| self.is_on_curve(foot) && !self.is_at_end(piece, foot))
            .collect()
    }

    /// Whether a foot is an end of its piece.
    fn is_at_end(&self, piece: &Piece, foot: &Division) -> bool {
        let point = self.edges[foot.edge as usize].curve.point(foot.parameter);
        piece
            .nodes
            .iter()
            .any(|&node| distance(self.mesh.nodes[node].point, point) <= AT_END * self.chord)
    }

    /// The division that moves an end of one piece onto a nearby end of the other piece. A vertex is moved only onto a vertex.
    fn near_ends(&self, a: &Piece, b: &Piece) -> Option<Division> {
        let point = |piece: &Piece, end: usize| self.mesh.nodes[piece.nodes[end]].point;
        let pairs = [(0, 0), (0, 1), (1, 0), (1, 1)]
            .map(|(i, j)| (i, j, distance(point(a, i), point(b, j))));
        let near = pairs
            .into_iter()
            .filter(|(.., gap)| *gap > 0.0 && *gap <= SNAP * self.chord);
        let (i, j, _) = near.min_by(|a, b| a.2.total_cmp(&b.2))?;
        let moving = |piece: &Piece, end: usize, to: Point| {
            let Segment {
                edge,
                from,
                to: last,
            } = piece.segment;
            Division {
                edge,
                parameter: if end == 0 { from } else { last },
                vertex: Some(to),
            }
        };
        Some(if b.is_vertex[j] {
            moving(a, i, point(b, j))
        } else {
            moving(b, j, point(a, i))
        })
    }

    /// The foot of a node on a piece of curve.
    fn foot(&self, piece: &Piece, node: usize) -> Option<Division> {
        let edge = self.edges.get(piece.segment.edge as usize)?;
        Some(foot_on(edge, piece.segment, self.mesh.nodes[node].point))
    }

    fn is_on_curve(&self, foot: &Division) -> bool {
        let point = self.edges[foot.edge as usize].curve.point(foot.parameter);
        foot.vertex
            .is_some_and(|vertex| distance(vertex, point) <= SNAP * self.chord)
    }

    fn is_straight(&self, piece: &Piece) -> bool {
        self.edges
            .get(piece.segment.edge as usize)
            .is_none_or(|edge| matches!(*edge.curve, Curve::Line { .. }))
    }

    /// The middle of a piece that is curved.
    fn half(&self, piece: &Piece) -> Option<Division> {
        let Segment { edge, from, to } = piece.segment;
        let curve = &*self.edges.get(edge as usize)?.curve;
        let parameter = 0.5 * (from + to);
        let [a, b] = piece.nodes.map(|node| self.mesh.nodes[node].point);
        let middle = [0, 1, 2].map(|axis| 0.5 * (a[axis] + b[axis]));
        let bends = !self.is_straight(piece)
            && distance(middle, curve.point(parameter)) > STRAIGHT * self.chord;
        bends.then_some(Division {
            edge,
            parameter,
            vertex: None,
        })
    }
}

/// A vertex whose distance from a curve is less than this fraction of the chord tolerance may be taken as a point of the curve.
pub(crate) const SNAP: f64 = 0.01;

/// The foot of a vertex on a piece of an edge.
pub(crate) fn foot_on(edge: &BrepEdge, segment: Segment, vertex: Point) -> Division {
    let Segment {
        edge: index,
        from,
        to,
    } = segment;
    let (low, high) = (from.min(to), from.max(to));
    let samples: Vec<f64> = (0..=SAMPLES)
        .map(|i| low + (high - low) * i as f64 / SAMPLES as f64)
        .collect();
    let parameter = nearest_parameter(&samples, |t| {
        let (point, slope) = edge.curve.derivative(t);
        (subtract(point, vertex), slope)
    });
    Division {
        edge: index,
        parameter,
        vertex: Some(vertex),
    }
}

impl Piece {
    /// Whether a point lies between the chord and the curve. The ends do not count. The curve is approximated by a parabola.
    fn contains_point(&self, x: [f64; 2], on_side: f64) -> bool {
        let [a, b] = self.ends;
        if x == a || x == b {
            return false;
        }
        let (chord, arm) = (between(a, b), between(a, x));
        let (length, height) = (dot(chord, chord), dot(self.bow, self.bow).sqrt());
        let share = dot(arm, chord) / length;
        if !(share > 0.0 && share < 1.0) {
            return false;
        }
        if height <= on_side {
            return cross_2d(chord, arm).abs() <= on_side * length.sqrt();
        }
        // The coordinates of the point in the skew frame of chord and bow.
        let determinant = cross_2d(chord, self.bow);
        if determinant.abs() <= on_side * length.sqrt() {
            return cross_2d(chord, arm).abs() <= on_side * length.sqrt();
        }
        let along = cross_2d(arm, self.bow) / determinant;
        let rise = cross_2d(chord, arm) / determinant;
        let curve = 4.0 * along * (1.0 - along);
        along > 0.0
            && along < 1.0
            && rise * height >= -on_side
            && rise <= (1.0 + BEYOND) * curve + on_side / height
    }
}

fn extent_of(pieces: &[Piece]) -> f64 {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for piece in pieces {
        for axis in [0, 1] {
            low[axis] = low[axis].min(piece.low[axis]);
            high[axis] = high[axis].max(piece.high[axis]);
        }
    }
    (high[0] - low[0]).max(high[1] - low[1]).max(0.0)
}

/// Whether the two ends of each side are on different sides of the other one.
fn cross_each_other(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> bool {
    let separates = |[from, to]: [[f64; 2]; 2], other: [[f64; 2]; 2]| {
        let chord = between(from, to);
        cross_2d(chord, between(from, other[0])) * cross_2d(chord, between(from, other[1])) < 0.0
    };
    separates(a, b) && separates(b, a)
}

fn between(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [b[0] - a[0], b[1] - a[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross_2d(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
