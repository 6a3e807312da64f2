//! The mesh of one face: its loops and the edges' points in, triangles, area and normals out.

use super::boundary::{BoundaryPoint, BoundingLoops, bounding_loops, polygon};
use super::chart::Chart;
use super::closed_surface::closed_surface;
use super::edge_points::{EdgePoints, Tolerance};
use super::layout::{Obstacle, layout};
use super::sphere_axis::sphere_frame;
use super::surface_fit::{SurfaceFit, surface_fit};
use super::triangulation::{Triangulated, triangulate};
use super::unwrap::unwrap_loop;
use crate::geometry::linear::{is_finite, sum, unit};
use crate::geometry::{Projector, Surface, trim};
use crate::model::{Brep, BrepFace, EdgeUse};
use carrier::{Point, cross, subtract};
use std::borrow::Cow;

/// The part of a mesh's area that may leave the surface's normal.
const ROUGH_PART: f64 = 0.02;
/// The part of a face that its chords may cut off: more of it, and a lens is hardly there.
const ROUGH_SLIVERS: f64 = 0.15;

/// What the faces of one shape have in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceContext<'a> {
    /// The shape.
    pub(crate) brep: &'a Brep,
    /// The divided edges, in the order of the shape's.
    pub(crate) edges: &'a [Option<EdgePoints>],
    /// The diagonal of the shape.
    pub(crate) size: f64,
    /// Whether normals are wanted.
    pub(crate) vertex_normals: bool,
}

/// The mesh of a face.
#[derive(Clone, Debug, Default)]
pub(crate) struct FaceMesh {
    /// Vertices.
    pub(crate) points: Vec<Point>,
    /// Outward normals of the surface at the vertices, if they were asked for.
    pub(crate) normals: Vec<[f32; 3]>,
    /// Triangles, counter-clockwise seen from outside.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Area of the trimmed surface.
    pub(crate) area: f64,
    /// The triangles follow the surface badly, or its boundaries cross: a finer mesh is worth a try.
    pub(crate) is_rough: bool,
}

/// Meshes a face at a tolerance.
pub(crate) fn face_mesh(context: FaceContext<'_>, face: &BrepFace, tolerance: Tolerance) -> Result<FaceMesh, Obstacle> {
    let BoundingLoops { loops, seams } = bounding_loops(context.brep, face);
    let polygons = polygons(context, face, &loops)?;
    let surface = suited_surface(face, &polygons);
    let projector = Projector::new(&surface);
    let (chart, mesh) = if polygons.is_empty() {
        closed_surface(&surface, tolerance, context.size).ok_or("it has no boundary and its surface is open")?
    } else {
        let unwrap = |polygon: &Vec<BoundaryPoint>| unwrap_loop(&projector, &surface, polygon, context.size);
        let loops = polygons.iter().map(unwrap).collect::<Option<Vec<_>>>().ok_or("a boundary lies in one point")?;
        let layout = layout(&surface, loops, inner_place(context, &projector, &seams), tolerance)?;
        let mesh = triangulate(&surface, &layout).ok_or("its boundary has no finite parameters")?;
        (layout.chart, mesh)
    };
    let fit = surface_fit(&surface, chart, &mesh, &context.brep.edges);
    finished(context, face, &surface, chart, &mesh, fit)
}

fn polygons(
    context: FaceContext<'_>,
    face: &BrepFace,
    loops: &[Vec<EdgeUse>],
) -> Result<Vec<Vec<BoundaryPoint>>, Obstacle> {
    let polygons = loops.iter().map(|uses| polygon(uses, context.edges, !face.same_sense));
    polygons.collect::<Option<_>>().ok_or("an edge has no finite points")
}

/// The parameters of a place that is certainly inside: the middle of a seam.
fn inner_place(context: FaceContext<'_>, projector: &Projector<'_>, seams: &[u32]) -> Option<[f64; 2]> {
    let edge = context.brep.edges.get(*seams.first()? as usize)?;
    let (t0, t1) = trim(edge, &context.brep.vertices);
    Some(projector.project(edge.curve.point(0.5 * (t0 + t1)), None).uv)
}

/// The face's surface; a sphere is turned so that its poles don't disturb.
fn suited_surface<'a>(face: &'a BrepFace, polygons: &[Vec<BoundaryPoint>]) -> Cow<'a, Surface> {
    match &*face.surface {
        Surface::Sphere { frame, radius } => {
            Cow::Owned(Surface::Sphere { frame: sphere_frame(frame, polygons, *radius), radius: *radius })
        }
        surface => Cow::Borrowed(surface),
    }
}

/// Turns the triangles outward, drops those without extent, keeps the vertices that are used.
fn finished(
    context: FaceContext<'_>,
    face: &BrepFace,
    surface: &Surface,
    chart: Chart,
    mesh: &Triangulated,
    fit: SurfaceFit,
) -> Result<FaceMesh, Obstacle> {
    let inward = face.same_sense == face.flipped;
    let mut new_index = vec![u32::MAX; mesh.nodes.len()];
    let mut result = FaceMesh { area: fit.area, ..FaceMesh::default() };
    let mut parameters = Vec::new();
    for &corners in &mesh.triangles {
        let [a, b, c] = corners.map(|node| mesh.nodes[node as usize].point);
        if a == b || b == c || c == a {
            continue;
        }
        let index = corners.map(|node| {
            let slot = &mut new_index[node as usize];
            if *slot == u32::MAX {
                *slot = result.points.len() as u32;
                result.points.push(mesh.nodes[node as usize].point);
                parameters.push(mesh.nodes[node as usize].uv);
            }
            *slot
        });
        let [a, b, c] = index;
        result.triangles.push(if chart.is_mirrored() == inward { [a, b, c] } else { [a, c, b] });
    }
    if result.triangles.is_empty() {
        return Err("its boundary encloses nothing");
    }
    if !result.points.iter().all(|&point| is_finite(point)) || !fit.area.is_finite() {
        return Err("its surface has no finite places");
    }
    if context.vertex_normals {
        result.normals = outward_normals(surface, &result, &parameters, inward);
    }
    result.is_rough = mesh.has_crossings || fit.in_slivers > ROUGH_SLIVERS || fit.off_normal > ROUGH_PART;
    Ok(result)
}

/// The surface's normal at each vertex; the mean of its triangles' where it has none, as at an apex.
fn outward_normals(surface: &Surface, mesh: &FaceMesh, parameters: &[[f64; 2]], inward: bool) -> Vec<[f32; 3]> {
    let side = if inward { -1.0 } else { 1.0 };
    let mut mean = vec![[0.0; 3]; mesh.points.len()];
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|corner| mesh.points[corner as usize]);
        let normal = unit(cross(subtract(b, a), subtract(c, a))).unwrap_or_default();
        for &corner in corners {
            mean[corner as usize] = sum(mean[corner as usize], normal);
        }
    }
    let of_vertex = |(&[u, v], mean): (&[f64; 2], Point)| {
        let normal = surface.unit_normal(u, v).map(|normal| normal.map(|x| side * x));
        normal.or_else(|| unit(mean)).unwrap_or_default().map(|x| x as f32)
    };
    parameters.iter().zip(mean).map(of_vertex).collect()
}
