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
        let index = division.edge as usize;
        let parameter = division.parameter;
        let Some((first, last)) = parameter_ends(points) else {
            return false;
        };
        let span = (last - first).abs();
        let Some(vertex) = division.vertex else {
            return self.add_on_curve(index, points, parameter, span);
        };
        if points.points.contains(&vertex) {
            return false;
        }
        // The vertex may be nearly met already, by a point that must then move there: its sides still cross another's.
        if let Some(i) = self.met_inside(points, parameter, SAME * span, vertex) {
            let new = DivisionPoint {
                parameter: points.parameters[i],
                at: Some(vertex),
            };
            return distance(points.points[i], vertex) <= self.snap
                && insert(&mut self.division_points[index], new, span);
        }
        let ends = [(first, edge.start), (last, edge.end)];
        let is_here = |(end, _): &(f64, u32)| (end - parameter).abs() <= SAME * span;
        if let Some((_, end)) = ends.into_iter().find(is_here) {
            let end_index = if end == edge.start {
                0
            } else {
                points.points.len() - 1
            };
            self.join(end, points.points[end_index], vertex);
            return false;
        }
        let gap = distance(edge.curve.point(parameter), vertex);
        let new = DivisionPoint {
            parameter,
            at: (gap <= self.on_curve).then_some(vertex),
        };
        insert(&mut self.division_points[index], new, span)
    }

    /// Adds a point of the curve, unless the edge is divided there; whether that changes anything.
    fn add_on_curve(
        &mut self,
        index: usize,
        points: &EdgePoints,
        parameter: f64,
        span: f64,
    ) -> bool {
        let is_new = points
            .parameters
            .iter()
            .all(|&t| (t - parameter).abs() > SAME * span);
        let new = DivisionPoint {
            parameter,
            at: None,
        };
        is_new && insert(&mut self.division_points[index], new, span)
    }

    /// The inner point of an edge that has a vertex's parameter within `same`, or lies where the vertex is.
    fn met_inside(
        &self,
        points: &EdgePoints,
        parameter: f64,
        same: f64,
        vertex: Point,
    ) -> Option<usize> {
        (1..points.points.len().saturating_sub(1)).find(|&i| {
            (points.parameters[i] - parameter).abs() <= same
                || distance(points.points[i], vertex) <= self.on_curve
        })
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
        self.move_ends(edge, &mut points);
        let division_points = self.division_points[index].as_slice();
        let Some((first, last)) = parameter_ends(&points) else {
            return points;
        };
        if division_points.is_empty() {
            return points;
        }
        let mut all = uncrowded(&points, division_points, edge.curve.has_kinks());
        let (low, high) = (first.min(last), first.max(last));
        let inside = division_points
            .iter()
            .filter(|division| division.parameter > low && division.parameter < high);
        all.extend(inside.map(|division| (division.parameter, division.point_on(edge))));
        if last >= first {
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
        } else {
            all.sort_by(|a, b| b.0.total_cmp(&a.0));
        }
        let (parameters, points) = all.into_iter().unzip();
        EdgePoints { parameters, points }
    }

    /// Moves the ends of an edge onto the vertices that they touch.
    fn move_ends(&self, edge: &BrepEdge, points: &mut EdgePoints) {
        if let (Some(&start), Some(first)) =
            (self.moved.get(&edge.start), points.points.first_mut())
        {
            *first = start;
        }
        if let (Some(&end), Some(last)) = (self.moved.get(&edge.end), points.points.last_mut()) {
            *last = end;
        }
    }
}

impl DivisionPoint {
    /// The point itself, or that of the curve at its parameter.
    fn point_on(&self, edge: &BrepEdge) -> Point {
        self.at.unwrap_or_else(|| edge.curve.point(self.parameter))
    }
}

/// The parameters of the first and the last point of an edge, if it has points.
fn parameter_ends(points: &EdgePoints) -> Option<(f64, f64)> {
    let first = *points.parameters.first()?;
    let last = *points.parameters.last()?;
    Some((first, last))
}

/// The points of an edge, with their parameters, that have no further division too near; the ends always stay.
///
/// On a curve with kinks only points at the same parameter are too near.
fn uncrowded(
    points: &EdgePoints,
    division_points: &[DivisionPoint],
    has_kinks: bool,
) -> Vec<(f64, Point)> {
    let parameters = points.parameters.as_slice();
    let n = parameters.len();
    let mut kept = Vec::with_capacity(n + division_points.len());
    for (i, (&parameter, &point)) in parameters.iter().zip(&points.points).enumerate() {
        let crowded = if has_kinks {
            SAME * (parameters[n - 1] - parameters[0]).abs()
        } else {
            let step = (parameters[(i + 1).min(n - 1)] - parameters[i.saturating_sub(1)]).abs();
            CROWDED * 0.5 * step
        };
        let is_end = i == 0 || i + 1 == n;
        let is_near = |division: &DivisionPoint| (division.parameter - parameter).abs() <= crowded;
        if is_end || !division_points.iter().any(is_near) {
            kept.push((parameter, point));
        }
    }
    kept
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
