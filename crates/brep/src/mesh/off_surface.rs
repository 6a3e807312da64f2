//! Finds edges that are far from the surface of their face, and the bound that separates them from merely imprecise edges.
//!
//! Exporters round numbers, so edges are some micrometers off their surfaces. The mesh uses the edges' own points, so neighbors
//! meet. If an edge is meters away, the edge or the surface is wrong, and the file contradicts itself. Then the mesh does not
//! follow the edge, and the face is named.

use super::repaired::edges_of;
use crate::geometry::{Curve, Projector, Surface, trim};
use crate::model::{Brep, BrepEdge, BrepFace};
use partprobe_shape::{Point, bounding_diagonal, distance};

/// An edge is off its surface if its distance exceeds this fraction of the shape's diagonal. Three of 1 673 real files have such
/// edges, on twelve faces.
pub(super) const OFF_SHAPE: f64 = 1e-3;
/// If the distance exceeds this fraction of the diagonal, the mesh does not follow the edge. No edge of those files is so far
/// away: the farthest one is 0.8 % of the diagonal off its surface.
pub(super) const FAR: f64 = 1e-2;
/// The distance must also exceed this fraction of the extent of the boundary itself.
const OFF_LOOP: f64 = 1e-2;
/// Number of pieces of each curved edge. Their ends are measured.
const PIECES: usize = 8;
/// Number of pieces of each straight edge on a surface that is not a plane.
const STRAIGHT_PIECES: usize = 2;

/// The edges of a face that are off its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OffSurface {
    /// `#` number of the edge that lies farthest away.
    pub(crate) edge: u64,
    /// The distance of that edge, in millimeters.
    pub(crate) distance: f64,
    /// The largest distance that still counts as imprecision, in millimeters.
    pub(crate) bound: f64,
    /// The number of edges that are farther away than `bound`.
    pub(crate) n_edges: usize,
    /// The fraction of the boundary's points that are farther away than `bound`.
    pub(crate) share: f64,
}

impl OffSurface {
    /// The message about these edges. It does not name the face.
    pub(crate) fn message(&self) -> String {
        let Self {
            edge,
            distance,
            bound,
            n_edges,
            ..
        } = self;
        let others = match n_edges {
            0 | 1 => String::new(),
            2 => "; so does 1 more edge".to_owned(),
            n => format!("; so do {} more edges", n - 1),
        };
        format!(
            "its edge #{edge} lies {distance:.3e} mm off its surface, more than {bound:.3e} mm{others}"
        )
    }
}

/// The largest distance that the points of a boundary may have from their surface, in millimeters. `size` is the diagonal of the
/// shape.
pub(super) fn off_bound(boundary: impl Iterator<Item = Point>, size: f64) -> f64 {
    let points: Vec<Point> = boundary.collect();
    (OFF_SHAPE * size).max(OFF_LOOP * bounding_diagonal(&points))
}

/// The edge that lies farthest off the face's surface. Returns `None` if all edges are near enough.
pub(crate) fn off_surface(brep: &Brep, face: &BrepFace, size: f64) -> Option<OffSurface> {
    farthest_off_surface(brep, face, size, |_| true)
}

/// The straight edge that lies farthest off the face's surface. Both its ends may lie on the surface, for example if it is a
/// chord of a cylinder. The mesh has no corner between the ends, so meshing does not find such an edge.
pub(crate) fn straight_off_surface(brep: &Brep, face: &BrepFace, size: f64) -> Option<OffSurface> {
    // A straight line between two points of a plane lies in the plane, and a very short edge cannot leave its surface far enough.
    let may_leave =
        |edge: &BrepEdge| is_straight(edge) && length_between_ends(brep, edge) > OFF_SHAPE * size;
    let is_flat = matches!(*face.surface, Surface::Plane(_) | Surface::Facets(_));
    let uses = || face.loops.iter().filter_map(edges_of).flatten();
    let has_any =
        !is_flat && uses().any(|use_| brep.edges.get(use_.edge as usize).is_some_and(may_leave));
    if has_any {
        farthest_off_surface(brep, face, size, may_leave)
    } else {
        None
    }
}

fn is_straight(edge: &BrepEdge) -> bool {
    matches!(*edge.curve, Curve::Line { .. })
}

fn length_between_ends(brep: &Brep, edge: &BrepEdge) -> f64 {
    let [start, end] = [edge.start, edge.end].map(|vertex| brep.vertices.get(vertex as usize));
    start
        .zip(end)
        .map_or(0.0, |(start, end)| distance(start.point, end.point))
}

fn farthest_off_surface(
    brep: &Brep,
    face: &BrepFace,
    size: f64,
    asks: impl Fn(&BrepEdge) -> bool,
) -> Option<OffSurface> {
    let projector = Projector::new(&face.surface);
    let is_flat = matches!(*face.surface, Surface::Plane(_));
    let mut found = OffSurface {
        edge: 0,
        distance: 0.0,
        bound: 0.0,
        n_edges: 0,
        share: 0.0,
    };
    let (mut n_off, mut n_points) = (0, 0);
    for uses in face.loops.iter().filter_map(edges_of) {
        let edges: Vec<(&BrepEdge, Vec<Point>)> = uses
            .iter()
            .filter_map(|use_| points_on_edge(brep, use_.edge, is_flat))
            .collect();
        let bound = off_bound(edges.iter().flat_map(|(_, points)| points).copied(), size);
        for (edge, points) in edges.into_iter().filter(|(edge, _)| asks(edge)) {
            let distances = points
                .iter()
                .map(|&point| projector.project(point, None).distance);
            let beyond: Vec<f64> = distances.filter(|distance| *distance > bound).collect();
            n_points += points.len();
            n_off += beyond.len();
            found.n_edges += usize::from(!beyond.is_empty());
            let farthest = beyond.into_iter().fold(0.0, f64::max);
            if farthest > found.distance {
                (found.edge, found.distance, found.bound) = (edge.step_id, farthest, bound);
            }
        }
    }
    found.share = n_off as f64 / n_points as f64;
    (n_off > 0).then_some(found)
}

/// Points along an edge. On a plane, the ends of a straight edge suffice.
fn points_on_edge(brep: &Brep, edge: u32, is_flat: bool) -> Option<(&BrepEdge, Vec<Point>)> {
    let edge = brep.edges.get(edge as usize)?;
    let [start, end] = [edge.start, edge.end].map(|vertex| brep.vertices.get(vertex as usize));
    let (t0, t1) = trim(edge, &brep.vertices);
    let n_pieces = match is_straight(edge) {
        true if is_flat => 1,
        true => STRAIGHT_PIECES,
        false => PIECES,
    };
    let inner = (1..n_pieces).map(|i| {
        edge.curve
            .point(t0 + (t1 - t0) * i as f64 / n_pieces as f64)
    });
    let points = std::iter::once(start?.point)
        .chain(inner)
        .chain([end?.point]);
    Some((edge, points.collect()))
}
