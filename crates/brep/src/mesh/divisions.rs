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

/// The largest number of further divisions of one edge.
const MOST: usize = 4000;
/// Two divisions count as one if they are nearer to each other than this fraction of the edge's parameter range.
const SAME: f64 = 1e-12;
/// A division by tolerance is removed if a further division is nearer than this fraction of its pieces. Corners of a curve are
/// kept.
const CROWDED: f64 = 0.05;
/// A vertex lies on a curve if it is nearer to it than this fraction of the shape's size.
const ON_CURVE: f64 = 1e-11;

/// A point that divides an edge.
#[derive(Clone, Copy, Debug)]
struct DivisionPoint {
    parameter: f64,
    /// Its position if it is not on the curve: the vertex that touches the edge there.
    at: Option<Point>,
}

/// The further divisions of all edges of a shape.
#[derive(Clone, Debug)]
pub(crate) struct Divisions {
    division_points: Vec<Vec<DivisionPoint>>,
    /// Vertices that are moved onto a vertex of another boundary, because the two differ by a rounding error only.
    moved: BTreeMap<u32, Point>,
    /// A vertex that is nearer to a curve than this is taken as a point of the curve, in millimeters.
    snap: f64,
    /// A vertex that is nearer to a curve than this lies on it, in millimeters.
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

    /// Adds the divisions that all faces request. Returns the edges that change, in ascending order.
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

    /// Adds a division that a face requests. Returns whether this changes anything. `points` are the current points of the edge.
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
        // A point of the edge may already be near the vertex. Then that point moves onto the vertex, because its sides still
        // cross those of the other boundary.
        if let Some(i) = self.inner_point_at(points, parameter, SAME * span, vertex) {
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

    /// Adds a point of the curve, unless the edge is already divided there. Returns whether this changes anything.
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

    /// The index of the inner point of an edge whose parameter differs from the vertex's by at most `same`, or that is at the
    /// vertex.
    fn inner_point_at(
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

    /// The points of an edge, including its further divisions.
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
        let mut all = points_far_from_divisions(&points, division_points, edge.curve.has_kinks());
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
    /// The vertex at this division, or else the point of the curve at its parameter.
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

/// The points of an edge, with their parameters, that have no further division too near. The ends are always kept.
///
/// On a curve with kinks, only points at the same parameter are too near.
fn points_far_from_divisions(
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

/// Inserts a division point, or sets the vertex of a division point that exists there. Returns whether this changes anything.
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
