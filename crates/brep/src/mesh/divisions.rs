//! Keeps the divisions of edges that faces request beyond those of the tolerances, and applies them to the points of an edge.
//!
//! An edge keeps these divisions however finely it is divided later, and all of its faces get the same points.

use super::contacts::{Division, SNAP};
use super::edge_points::EdgePoints;
use super::error::FaceMeshError;
use super::face_mesh::FaceMesh;
use crate::model::{Brep, BrepEdge};
use partprobe_shape::{Point, distance};
use std::collections::BTreeMap;

/// Further divisions of one edge.
const MOST: usize = 4000;
/// Two divisions nearer than this fraction of an edge's parameters are one.
const SAME: f64 = 1e-12;
/// A division by tolerance goes if a further one lies nearer than this fraction of its pieces. Corners of a curve stay.
const CROWDED: f64 = 0.05;
/// A vertex that lies nearer to a curve than this fraction of the shape's size lies on it.
const ON_CURVE: f64 = 1e-11;

/// A point that divides an edge.
#[derive(Clone, Copy, Debug)]
struct DivisionPoint {
    parameter: f64,
    /// Where it is, if not where the curve is: the vertex that touches the edge there.
    at: Option<Point>,
}

/// The further divisions of all edges of a shape.
#[derive(Clone, Debug)]
pub(crate) struct Divisions {
    division_points: Vec<Vec<DivisionPoint>>,
    /// Vertices that are moved onto a vertex of another boundary, which they touch but for a rounding.
    moved: BTreeMap<u32, Point>,
    /// How near a vertex must come to a curve to be taken for a point of it, in millimeters.
    snap: f64,
    /// How near it must come to count as lying on it.
    on_curve: f64,
}

impl Divisions {
    /// No divisions yet. `size` is the diagonal of the shape and `chord` its chord tolerance, in millimeters.
    pub(crate) fn none(n_edges: usize, size: f64, chord: f64) -> Self {
        Self {
            division_points: vec![Vec::new(); n_edges],
            moved: BTreeMap::new(),
            snap: SNAP * chord,
            on_curve: ON_CURVE * size,
        }
    }

    /// Adds what all faces ask for; the edges that change, ascending.
    pub(crate) fn add_all(
        &mut self,
        brep: &Brep,
        edges: &[Option<EdgePoints>],
        meshes: &[Result<FaceMesh, FaceMeshError>],
    ) -> Vec<usize> {
        let mut touched = Vec::new();
        let n_moved = self.moved.len();
        for &division in meshes.iter().flatten().flat_map(|mesh| &mesh.divisions) {
            let index = division.edge as usize;
            let Some(Some(points)) = edges.get(index) else {
                continue;
            };
            if self.add(&brep.edges[index], points, division) {
                touched.push(index);
            }
        }
        if self.moved.len() > n_moved {
            let is_moved = |edge: &BrepEdge| {
                [edge.start, edge.end]
                    .iter()
                    .any(|end| self.moved.contains_key(end))
            };
            touched.extend((0..brep.edges.len()).filter(|&edge| is_moved(&brep.edges[edge])));
        }
        touched.sort_unstable();
        touched.dedup();
        touched
    }

    /// Adds what a face asks for; whether that changes anything. `points` are the edge's points as they are now.
    fn add(&mut self, edge: &BrepEdge, points: &EdgePoints, division: Division) -> bool {
        let Division {
            edge: index,
            parameter,
            vertex,
        } = division;
        let [Some(&first), Some(&last)] = [points.parameters.first(), points.parameters.last()]
        else {
            return false;
        };
        let span = (last - first).abs();
        let inner = 1..points.points.len().saturating_sub(1);
        let Some(vertex) = vertex else {
            let is_new = points
                .parameters
                .iter()
                .all(|&t| (t - parameter).abs() > SAME * span);
            return is_new
                && insert(
                    &mut self.division_points[index as usize],
                    DivisionPoint {
                        parameter,
                        at: None,
                    },
                    span,
                );
        };
        let division_points = &mut self.division_points[index as usize];
        if points.points.contains(&vertex) {
            return false;
        }
        // The vertex may be nearly met already, by a point that must then move there: its sides still cross another's.
        let is_met = |&i: &usize| {
            (points.parameters[i] - parameter).abs() <= SAME * span
                || distance(points.points[i], vertex) <= self.on_curve
        };
        if let Some(i) = inner.clone().find(is_met) {
            return distance(points.points[i], vertex) <= self.snap
                && insert(
                    division_points,
                    DivisionPoint {
                        parameter: points.parameters[i],
                        at: Some(vertex),
                    },
                    span,
                );
        }
        let ends = [(first, edge.start), (last, edge.end)];
        if let Some((_, end)) = ends
            .into_iter()
            .find(|(end, _)| (end - parameter).abs() <= SAME * span)
        {
            let end_point = points.points[if end == edge.start {
                0
            } else {
                points.points.len() - 1
            }];
            self.join(end, end_point, vertex);
            return false;
        }
        let gap = distance(edge.curve.point(parameter), vertex);
        insert(
            division_points,
            DivisionPoint {
                parameter,
                at: (gap <= self.on_curve).then_some(vertex),
            },
            span,
        )
    }

    /// Moves a vertex onto another one, unless it is too far away or one of the two is moved already.
    fn join(&mut self, vertex: u32, point: Point, other: Point) {
        let is_target = |moved: &Point| *moved == point;
        if distance(point, other) <= self.snap
            && !self.moved.contains_key(&vertex)
            && !self.moved.values().any(is_target)
        {
            self.moved.insert(vertex, other);
        }
    }

    /// The points of an edge with its further divisions among them.
    pub(crate) fn applied(
        &self,
        index: usize,
        edge: &BrepEdge,
        mut points: EdgePoints,
    ) -> EdgePoints {
        let division_points = &self.division_points[index];
        if let (Some(&start), Some(first)) =
            (self.moved.get(&edge.start), points.points.first_mut())
        {
            *first = start;
        }
        if let (Some(&end), Some(last)) = (self.moved.get(&edge.end), points.points.last_mut()) {
            *last = end;
        }
        let [Some(&first), Some(&last)] = [points.parameters.first(), points.parameters.last()]
        else {
            return points;
        };
        if division_points.is_empty() {
            return points;
        }
        let (forward, has_kinks) = (last >= first, edge.curve.has_kinks());
        let n = points.parameters.len();
        let mut all: Vec<(f64, Point, bool)> = Vec::with_capacity(n + division_points.len());
        for (i, (&parameter, &point)) in points.parameters.iter().zip(&points.points).enumerate() {
            let is_end = i == 0 || i + 1 == n;
            let step = (points.parameters[(i + 1).min(n - 1)]
                - points.parameters[i.saturating_sub(1)])
            .abs();
            let crowded = if has_kinks {
                SAME * (last - first).abs()
            } else {
                CROWDED * 0.5 * step
            };
            let is_near =
                |division: &DivisionPoint| (division.parameter - parameter).abs() <= crowded;
            if is_end || !division_points.iter().any(is_near) {
                all.push((parameter, point, is_end));
            }
        }
        let ends = (first.min(last), first.max(last));
        let inside = division_points
            .iter()
            .filter(|division| division.parameter > ends.0 && division.parameter < ends.1);
        all.extend(inside.map(|division| {
            (
                division.parameter,
                division
                    .at
                    .unwrap_or_else(|| edge.curve.point(division.parameter)),
                false,
            )
        }));
        all.sort_by(|a, b| {
            if forward {
                a.0.total_cmp(&b.0)
            } else {
                b.0.total_cmp(&a.0)
            }
        });
        EdgePoints {
            parameters: all.iter().map(|(parameter, ..)| *parameter).collect(),
            points: all.iter().map(|(_, point, _)| *point).collect(),
        }
    }
}

/// Inserts a point, or gives one that is there already its point; whether that changes anything.
fn insert(division_points: &mut Vec<DivisionPoint>, new: DivisionPoint, span: f64) -> bool {
    if let Some(division) = division_points
        .iter_mut()
        .find(|division| (division.parameter - new.parameter).abs() <= SAME * span)
    {
        let changes = new.at.is_some() && division.at != new.at;
        division.at = new.at.or(division.at);
        return changes;
    }
    let has_room = division_points.len() < MOST;
    if has_room {
        division_points.push(new);
    }
    has_room
}
