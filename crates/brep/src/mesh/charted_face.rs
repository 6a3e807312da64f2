//! Triangulates one face in a plane: its loops become polygons of edge points, the polygons are unwrapped into the parameter
//! plane, and a chart maps them to the plane of the triangulation.

use super::boundary::{BoundaryPoint, BoundingLoops, bounding_loops, polygon, reversed};
use super::chart::Chart;
use super::closed_surface::closed_surface;
use super::contacts::{Boundary, Division};
use super::edge_points::Tolerance;
use super::error::FaceMeshError;
use super::face_context::FaceContext;
use super::layout::layout;
use super::poles::closes;
use super::repaired::edges_of;
use super::sphere_axis::sphere_frame;
use super::triangulated::ChartTriangulation;
use super::triangulation::triangulate;
use super::unwrap::{Off, UvLoop, unwrap_loop};
use crate::geometry::{Projector, Surface, trim};
use crate::model::{BrepFace, EdgeUse, Loop};
use std::borrow::Cow;

/// A face in the plane of its triangulation.
pub(super) struct ChartedFace<'a> {
    /// The boundaries, walked with the face on their left.
    pub(super) polygons: Vec<Vec<BoundaryPoint>>,
    /// The surface in the parameters of the triangulation.
    pub(super) surface: Cow<'a, Surface>,
    /// The map from parameters to the plane of the triangulation.
    pub(super) chart: Chart,
    /// The triangulation.
    pub(super) mesh: ChartTriangulation,
    /// Divisions of edges that keep the boundaries apart.
    pub(super) divisions: Vec<Division>,
    /// How the triangulation treats edges that lie off the surface, if there are any.
    pub(super) off_surface: Option<Off>,
}

/// Triangulates a face without its seams. If the other boundaries do not suffice (holes all around a closed surface, so that each
/// straight cut meets one), the face is cut open at the seams that the file gives.
pub(super) fn chart_face<'a>(
    context: FaceContext<'_>,
    face: &'a BrepFace,
    tolerance: Tolerance,
) -> Result<ChartedFace<'a>, FaceMeshError> {
    let BoundingLoops { loops, seams } = bounding_loops(context.brep, face);
    let Some(&seam) = seams.first() else {
        return chart_walks(context, face, &loops, None, tolerance);
    };
    let error = match chart_walks(context, face, &loops, Some(seam), tolerance) {
        Ok(charted) => return Ok(charted),
        Err(error) => error,
    };
    let written: Vec<Vec<EdgeUse>> = face.loops.iter().filter_map(edges_of).cloned().collect();
    let cut_open = chart_walks(context, face, &written, None, tolerance);
    cut_open
        .or_else(|_| chart_walks(context, face, &loops, None, tolerance))
        .map_err(|_| error)
}

/// Triangulates the region between closed walks. The middle of a seam is certainly inside.
fn chart_walks<'a>(
    context: FaceContext<'_>,
    face: &'a BrepFace,
    walks: &[Vec<EdgeUse>],
    seam: Option<u32>,
    tolerance: Tolerance,
) -> Result<ChartedFace<'a>, FaceMeshError> {
    let mut polygons = polygons(context, face, walks)?;
    let surface = suited_surface(face, &polygons);
    let projector = Projector::new(&surface);
    if polygons.is_empty() {
        let apices = apices(context, face, &projector);
        let (chart, mesh) = closed_surface(&surface, &apices, tolerance, context.size)
            .ok_or(FaceMeshError::NoBoundary)?;
        drop(projector);
        return Ok(ChartedFace {
            polygons,
            surface,
            chart,
            mesh,
            divisions: Vec::new(),
            off_surface: None,
        });
    }

    let (loops, off_surface) = unwrapped(&projector, &surface, &mut polygons, context.size)
        .ok_or(FaceMeshError::PointBoundary)?;
    let inner = seam.and_then(|seam| middle_of(context, &projector, seam));
    let layout = layout(&surface, loops, inner, tolerance, context.size)?;
    let mesh = triangulate(&surface, &layout).ok_or(FaceMeshError::BoundaryParameters)?;
    let boundary = Boundary {
        surface: &surface,
        projector: &projector,
        layout: &layout,
        mesh: &mesh,
        edges: &context.brep.edges,
        chord: context.chord,
    };
    let divisions = boundary.contacts();
    drop(projector);
    Ok(ChartedFace {
        polygons,
        surface,
        chart: layout.chart,
        mesh,
        divisions,
        off_surface,
    })
}

/// The boundaries in the parameter plane.
///
/// If a boundary passes through a pole, its sense decides on which side it passes around the pole. With the wrong sense it passes
/// on the other side, and then the boundaries wind around a surface that does not close elsewhere. In this case they are
/// reversed.
fn unwrapped(
    projector: &Projector<'_>,
    surface: &Surface,
    polygons: &mut [Vec<BoundaryPoint>],
    size: f64,
) -> Option<(Vec<UvLoop>, Option<Off>)> {
    let mut off_surface = None;
    let mut unwrap = |polygon: &mut Vec<BoundaryPoint>| {
        let unwrapped = unwrap_loop(projector, surface, polygon, size)?;
        off_surface = off_surface.max(unwrapped.off_surface);
        Some(unwrapped.bound)
    };
    let winding = |loops: &[UvLoop]| {
        [0, 1].map(|axis| loops.iter().map(|bound| bound.windings[axis]).sum::<i32>())
    };
    let loops: Vec<UvLoop> = polygons
        .iter_mut()
        .map(&mut unwrap)
        .collect::<Option<_>>()?;
    let is_in_doubt = winding(&loops) != [0; 2] && loops.iter().any(UvLoop::goes_around_pole);
    if !is_in_doubt || [0, 1].iter().all(|&axis| closes(surface, axis, size)) {
        return Some((loops, off_surface));
    }
    let backwards = polygons
        .iter()
        .map(|polygon| unwrap(&mut reversed(polygon)))
        .collect::<Option<Vec<_>>>();
    let loops = backwards
        .filter(|loops| winding(loops) == [0; 2])
        .unwrap_or(loops);
    Some((loops, off_surface))
}

fn polygons(
    context: FaceContext<'_>,
    face: &BrepFace,
    loops: &[Vec<EdgeUse>],
) -> Result<Vec<Vec<BoundaryPoint>>, FaceMeshError> {
    let polygons = loops
        .iter()
        .map(|uses| polygon(uses, context.edges, !face.same_sense));
    polygons
        .collect::<Option<_>>()
        .ok_or(FaceMeshError::EdgePoints)
}

/// The parameters of the middle of an edge.
fn middle_of(context: FaceContext<'_>, projector: &Projector<'_>, edge: u32) -> Option<[f64; 2]> {
    let edge = context.brep.edges.get(edge as usize)?;
    let (t0, t1) = trim(edge, &context.brep.vertices);
    Some(
        projector
            .project(edge.curve.point(0.5 * (t0 + t1)), None)
            .uv,
    )
}

/// The parameters of the vertices that bound the face without an edge.
fn apices(context: FaceContext<'_>, face: &BrepFace, projector: &Projector<'_>) -> Vec<[f64; 2]> {
    let vertices = face.loops.iter().filter_map(|bound| match bound {
        Loop::Vertex(vertex) => context.brep.vertices.get(*vertex as usize),
        Loop::Edges(_) => None,
    });
    vertices
        .map(|vertex| projector.project(vertex.point, None).uv)
        .collect()
}

/// The face's surface. A sphere is rotated so that its poles are away from the boundaries.
fn suited_surface<'a>(face: &'a BrepFace, polygons: &[Vec<BoundaryPoint>]) -> Cow<'a, Surface> {
    match &*face.surface {
        Surface::Sphere { frame, radius } => Cow::Owned(Surface::Sphere {
            frame: sphere_frame(frame, polygons, *radius),
            radius: *radius,
        }),
        surface => Cow::Borrowed(surface),
    }
}
