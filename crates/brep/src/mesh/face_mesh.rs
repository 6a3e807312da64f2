//! The mesh of one face: its loops and the edges' points in, triangles, area and normals out.

use super::attributes::{add_attributes, turn_attributes};
use super::boundary::{BoundaryPoint, BoundingLoops, bounding_loops, polygon, reversed};
use super::chart::Chart;
use super::closed_surface::closed_surface;
use super::closing::filling;
use super::contacts::{Boundary, Division};
use super::edge_points::{EdgePoints, Tolerance};
use super::edge_walks::{walks_of_sides, walks_of_triangles};
use super::facets::facets_mesh;
use super::layout::{Obstacle, layout};
use super::near_chords::near_chords;
use super::poles::closes;
use super::quadrature::Breaks;
use super::sphere_axis::sphere_frame;
use super::strips::{is_free, strips};
use super::surface_fit::{area_of_facets, surface_fit};
use super::triangulation::{Triangulated, triangulate};
use super::unwrap::{Off, UvLoop, unwrap_loop};
use super::volume::cone_volume;
use super::walks::edges_of;
use crate::geometry::linear::is_finite;
use crate::geometry::{Projector, Surface, trim};
use crate::model::{Brep, BrepFace, EdgeUse, Loop};
use crate::shape::AttributeChoice;
use partprobe_shape::{Point, SurfaceAttributes, cross, norm, subtract};
use std::borrow::Cow;

/// The part of a mesh's area that may leave the surface's normal.
const ROUGH_PART: f64 = 0.02;
/// The part of a face that its chords may cut off: more of it, and a lens is hardly there.
const ROUGH_SLIVERS: f64 = 0.15;

/// The part of a face by which its triangles may have more or less area: beside a sag as wide as a thin face, it is none of
/// its triangles' surface.
const ROUGH_AREA: f64 = 0.1;

/// What the faces of one shape have in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceContext<'a> {
    /// The shape.
    pub(crate) brep: &'a Brep,
    /// The divided edges, in the order of the shape's.
    pub(crate) edges: &'a [Option<EdgePoints>],
    /// The diagonal of the shape.
    pub(crate) size: f64,
    /// The shape's chord tolerance, in millimeters.
    pub(crate) chord: f64,
    /// What is wanted of the surfaces at the vertices.
    pub(crate) attributes: AttributeChoice,
    /// Places near each solid from which volumes are measured; none where they are not wanted.
    pub(crate) volume_origins: &'a [Point],
}

/// The mesh of a face.
#[derive(Clone, Debug, Default)]
pub(crate) struct FaceMesh {
    /// Vertices.
    pub(crate) points: Vec<Point>,
    /// Outward normals of the surface at the vertices, if they were asked for.
    pub(crate) normals: Vec<[f32; 3]>,
    /// What else was asked for at the vertices.
    pub(crate) attributes: SurfaceAttributes,
    /// Triangles, counter-clockwise seen from outside.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Area of the trimmed surface.
    pub(crate) area: f64,
    /// What the quadrature gave if it cannot be an area; the area is then that of the triangles.
    pub(crate) impossible_area: Option<f64>,
    /// Volume of the cone over the face, with its apex at its solid's origin; 0 where volumes are not wanted.
    pub(crate) volume: f64,
    /// Volume between the triangles and the surface, in cubic millimeters; positive where the triangles cut it off the solid.
    pub(crate) cut_off: f64,
    /// Edges of the boundary in the direction in which the triangles walk them.
    pub(crate) walks: Vec<EdgeUse>,
    /// Vertices that lie on the boundary.
    pub(crate) on_boundary: Vec<bool>,
    /// The triangles follow the surface badly, or its boundaries cross: a finer mesh is worth a try.
    pub(crate) is_rough: bool,
    /// Where edges should be divided so that its boundaries lie to each other as their curves do.
    pub(crate) divisions: Vec<Division>,
    /// What became of edges that lie too far off the surface, if there are any.
    pub(crate) off_surface: Option<Off>,
    /// Its triangles lie in the plane of its boundary, not on its surface.
    pub(crate) is_flattened: bool,
}

impl FaceMesh {
    /// The area that the triangles have together, in square millimeters.
    pub(crate) fn area_of_triangles(&self) -> f64 {
        let areas = self.triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|corner| self.points[corner as usize]);
            0.5 * norm(cross(subtract(b, a), subtract(c, a)))
        });
        areas.sum()
    }

    /// The same mesh seen from its other side.
    pub(crate) fn turn(&mut self) {
        self.triangles
            .iter_mut()
            .for_each(|corners| corners.swap(1, 2));
        self.normals
            .iter_mut()
            .for_each(|normal| *normal = normal.map(|x| -x));
        turn_attributes(&mut self.attributes);
        self.walks
            .iter_mut()
            .for_each(|walk| walk.forward = !walk.forward);
        self.volume = -self.volume;
        self.cut_off = -self.cut_off;
    }
}

impl<'a> FaceContext<'a> {
    /// The place from which the volume under a face is measured, where it is wanted.
    fn volume_origin(&self, face: &BrepFace) -> Option<&'a Point> {
        self.volume_origins
            .get(self.brep.shells.get(face.shell as usize)?.solid? as usize)
    }
}

/// Meshes a face at a tolerance.
pub(crate) fn face_mesh(
    context: FaceContext<'_>,
    face: &BrepFace,
    tolerance: Tolerance,
) -> Result<FaceMesh, Obstacle> {
    if let Surface::Facets(facets) = &*face.surface {
        return sound(facets_mesh(
            face,
            facets,
            context.attributes,
            context.volume_origin(face).copied(),
        ));
    }
    let Charted {
        polygons,
        surface,
        chart,
        mesh,
        mut divisions,
        off_surface,
    } = charted(context, face, tolerance)?;
    let projector = Projector::new(&surface);
    let (breaks, about) = match is_free(&surface) {
        true => (breaks_of(&surface, &mesh), area_of_facets(&mesh)),
        false => Default::default(),
    };
    let strips = strips(&projector, &mesh, &context.brep.edges, &breaks, about);
    let fit = surface_fit(&surface, chart, &mesh, &strips, (&breaks, about));
    let inward = face.is_inward();
    let (mut result, mut parameters) = outward_triangles(chart, &mesh, inward);
    if mesh.is_ragged || mesh.sides.len() < polygons.iter().map(Vec::len).sum() {
        close(&mut result, &polygons, inward);
        parameters.extend(
            result.points[parameters.len()..]
                .iter()
                .map(|&point| projector.project(point, None).uv),
        );
        result.walks =
            walks_of_triangles(&result.points, &result.triangles, &polygons, context.edges);
    } else {
        result.walks = walks_of_sides(&mesh.sides, context.edges, chart.is_mirrored() != inward);
    }
    let misses_area = (result.area_of_triangles() - fit.area).abs() > ROUGH_AREA * fit.area;
    let misses_surface = fit.in_slivers > ROUGH_SLIVERS || fit.off_normal > ROUGH_PART;
    result.is_rough = mesh.has_crossings || misses_surface || misses_area;
    if misses_area && polygons.len() > 1 && divisions.is_empty() {
        divisions = near_chords(&mesh, &context.brep.edges, context.chord);
    }
    result.divisions = divisions;
    result.off_surface = off_surface;
    // A quadrature that went wrong must not become a negative area.
    result.impossible_area = (fit.area <= 0.0).then_some(fit.area);
    result.area = if fit.area > 0.0 {
        fit.area
    } else {
        result.area_of_triangles()
    };
    result.cut_off = if inward { -fit.between } else { fit.between };
    if let Some(&origin) = context.volume_origin(face) {
        let volume = cone_volume(
            &surface,
            chart,
            (&mesh, &strips),
            (&breaks, fit.area),
            origin,
        );
        result.volume = if inward { -volume } else { volume };
    }
    add_attributes(&mut result, face, &surface, &parameters, context.attributes);
    sound(result)
}

/// The knots among the nodes, with room for triangles that reach over a seam.
fn breaks_of(surface: &Surface, mesh: &Triangulated) -> Breaks {
    let mut extent = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for node in &mesh.nodes {
        for (ends, x) in extent.iter_mut().zip(node.uv) {
            *ends = [ends[0].min(x), ends[1].max(x)];
        }
    }
    let widened = extent.map(|[low, high]| [low - (high - low), high + (high - low)]);
    Breaks {
        knots: surface.breaks_between(widened),
        has_kinks: surface.has_kinks(),
    }
}

/// A face in the plane of its triangulation.
struct Charted<'a> {
    polygons: Vec<Vec<BoundaryPoint>>,
    surface: Cow<'a, Surface>,
    chart: Chart,
    mesh: Triangulated,
    divisions: Vec<Division>,
    off_surface: Option<Off>,
}

/// Triangulates a face without its seams. Where what remains says too little (holes all around a closed surface, which no
/// straight cut misses), the seams cut it open as the file has it.
fn charted<'a>(
    context: FaceContext<'_>,
    face: &'a BrepFace,
    tolerance: Tolerance,
) -> Result<Charted<'a>, Obstacle> {
    let BoundingLoops { loops, seams } = bounding_loops(context.brep, face);
    let Some(&seam) = seams.first() else {
        return charted_walks(context, face, &loops, None, tolerance);
    };
    let obstacle = match charted_walks(context, face, &loops, Some(seam), tolerance) {
        Ok(charted) => return Ok(charted),
        Err(obstacle) => obstacle,
    };
    let written: Vec<Vec<EdgeUse>> = face.loops.iter().filter_map(edges_of).cloned().collect();
    let cut_open = charted_walks(context, face, &written, None, tolerance);
    cut_open
        .or_else(|_| charted_walks(context, face, &loops, None, tolerance))
        .map_err(|_| obstacle)
}

/// Triangulates what lies between closed walks; the middle of a seam is certainly inside.
fn charted_walks<'a>(
    context: FaceContext<'_>,
    face: &'a BrepFace,
    walks: &[Vec<EdgeUse>],
    seam: Option<u32>,
    tolerance: Tolerance,
) -> Result<Charted<'a>, Obstacle> {
    let mut polygons = polygons(context, face, walks)?;
    let surface = suited_surface(face, &polygons);
    let projector = Projector::new(&surface);
    let (mut divisions, mut off_surface) = (Vec::new(), None);
    let (chart, mesh) = if polygons.is_empty() {
        let apices = apices(context, face, &projector);
        closed_surface(&surface, &apices, tolerance, context.size)
            .ok_or("it has no boundary and its surface is open")?
    } else {
        let unwrapped = unwrapped(&projector, &surface, &mut polygons, context.size);
        let (loops, off) = unwrapped.ok_or("a boundary lies in one point")?;
        off_surface = off;
        let inner = seam.and_then(|seam| middle_of(context, &projector, seam));
        let layout = layout(&surface, loops, inner, tolerance, context.size)?;
        let mesh = triangulate(&surface, &layout).ok_or("its boundary has no finite parameters")?;
        let (surface, projector, edges) = (&*surface, &projector, &*context.brep.edges);
        let boundary = Boundary {
            surface,
            projector,
            layout: &layout,
            mesh: &mesh,
            edges,
            chord: context.chord,
        };
        divisions = boundary.contacts();
        (layout.chart, mesh)
    };
    drop(projector);
    Ok(Charted {
        polygons,
        surface,
        chart,
        mesh,
        divisions,
        off_surface,
    })
}

/// The boundaries in the parameter plane.
///
/// Where a boundary passes through a pole, its sense says by which way round it turns there. Against the true sense it turns by
/// the rest of the turn, and then the boundaries wind around a surface that closes nowhere else: they are walked backwards.
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
    let is_in_doubt = winding(&loops) != [0; 2] && loops.iter().any(UvLoop::turns_at_pole);
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
) -> Result<Vec<Vec<BoundaryPoint>>, Obstacle> {
    let polygons = loops
        .iter()
        .map(|uses| polygon(uses, context.edges, !face.same_sense));
    polygons
        .collect::<Option<_>>()
        .ok_or("an edge has no finite points")
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

/// The face's surface; a sphere is turned so that its poles don't disturb.
fn suited_surface<'a>(face: &'a BrepFace, polygons: &[Vec<BoundaryPoint>]) -> Cow<'a, Surface> {
    match &*face.surface {
        Surface::Sphere { frame, radius } => Cow::Owned(Surface::Sphere {
            frame: sphere_frame(frame, polygons, *radius),
            radius: *radius,
        }),
        surface => Cow::Borrowed(surface),
    }
}

/// The triangles, turned outward, without those that have no extent, and the vertices that they use with their
/// parameters.
fn outward_triangles(chart: Chart, mesh: &Triangulated, inward: bool) -> (FaceMesh, Vec<[f64; 2]>) {
    let mut new_index = vec![u32::MAX; mesh.nodes.len()];
    let mut result = FaceMesh {
        points: Vec::with_capacity(mesh.nodes.len()),
        on_boundary: Vec::with_capacity(mesh.nodes.len()),
        triangles: Vec::with_capacity(mesh.triangles.len()),
        ..FaceMesh::default()
    };
    let mut parameters = Vec::with_capacity(mesh.nodes.len());
    let n_bounding = mesh.n_bounding as u32;
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
                result.on_boundary.push(node < n_bounding);
                parameters.push(mesh.nodes[node as usize].uv);
            }
            *slot
        });
        let [a, b, c] = index;
        result.triangles.push(if chart.is_mirrored() == inward {
            [a, b, c]
        } else {
            [a, c, b]
        });
    }
    (result, parameters)
}

/// Fills what lies between the triangles and the boundary, so that the neighbors' meshes meet this one.
fn close(mesh: &mut FaceMesh, polygons: &[Vec<BoundaryPoint>], inward: bool) {
    let walk = |polygon: &Vec<BoundaryPoint>| {
        let mut places: Vec<Point> = polygon.iter().map(|corner| corner.point).collect();
        if inward {
            places.reverse();
        }
        places
    };
    let walks: Vec<Vec<Point>> = polygons.iter().map(walk).collect();
    let filling = filling(&mesh.points, &mesh.triangles, &walks);
    mesh.points.extend(filling.points);
    mesh.on_boundary = vec![true; mesh.points.len()];
    for &triangle in filling.cancelled.iter().rev() {
        mesh.triangles.remove(triangle);
    }
    mesh.triangles.extend(filling.triangles);
}

/// A mesh with triangles at finite places, or why it is none.
fn sound(mesh: FaceMesh) -> Result<FaceMesh, Obstacle> {
    if mesh.triangles.is_empty() {
        Err("its boundary encloses nothing")
    } else if !mesh.points.iter().all(|&point| is_finite(point)) || !mesh.area.is_finite() {
        Err("its surface has no finite places")
    } else {
        Ok(mesh)
    }
}
