//! Meshes one face: triangulates it in its chart, closes it up to its boundary, and measures how well its triangles follow its
//! surface.

use super::attributes::vertex_attributes;
use super::boundary::BoundaryPoint;
use super::chart::Chart;
use super::charted_face::{ChartedFace, chart_face};
use super::edge_points::Tolerance;
use super::edge_walks::{walks_of_sides, walks_of_triangles};
use super::error::FaceMeshError;
use super::face_context::FaceContext;
use super::face_mesh::FaceMesh;
use super::facets::facets_mesh;
use super::gap_filling::filling;
use super::near_chords::near_chords;
use super::quadrature::Breaks;
use super::strips::{Strips, is_free, strips};
use super::surface_fit::{SurfaceFit, area_of_facets, surface_fit};
use super::triangulated::ChartTriangulation;
use super::volume::cone_volume;
use crate::geometry::linear::is_finite;
use crate::geometry::{Projector, Surface};
use crate::model::BrepFace;
use partprobe_shape::Point;

/// Largest fraction of a mesh's area whose triangles may deviate from the surface's normal.
const ROUGH_NORMALS: f64 = 0.02;
/// Largest fraction of a face that its chords may cut off. If a lens loses more, hardly anything of it is left.
const ROUGH_SLIVERS: f64 = 0.15;
/// Largest relative difference between the area of a face's triangles and of its surface. On a face as narrow as the sag of
/// its chords, the triangles may miss the surface entirely.
const ROUGH_AREA: f64 = 0.1;

/// Meshes a face at a tolerance.
pub(crate) fn mesh_face(
    context: FaceContext<'_>,
    face: &BrepFace,
    tolerance: Tolerance,
) -> Result<FaceMesh, FaceMeshError> {
    if let Surface::Facets(facets) = &*face.surface {
        let origin = context.volume_origin(face);
        return sound(facets_mesh(face, facets, context.attributes, origin));
    }
    let charted = chart_face(context, face, tolerance)?;
    let projector = Projector::new(&charted.surface);
    let measures = Measures::new(context, &charted, &projector);

    let (mut mesh, parameters) = closed_triangles(context, face, &charted, &projector);
    let misses_area = measures.misses_area(&mesh);
    mesh.is_rough = charted.mesh.has_crossings || measures.misses_surface() || misses_area;
    set_measures(&mut mesh, context, face, &charted, &measures);
    (mesh.normals, mesh.attributes) = vertex_attributes(
        (&mesh.points, &mesh.triangles, &parameters),
        face,
        &charted.surface,
        context.attributes,
    );

    mesh.off_surface = charted.off_surface;
    mesh.divisions = charted.divisions;
    if misses_area && charted.polygons.len() > 1 && mesh.divisions.is_empty() {
        mesh.divisions = near_chords(&charted.mesh, &context.brep.edges, context.chord);
    }
    sound(mesh)
}

/// Integrals over a face's surface.
struct Measures {
    breaks: Breaks,
    strips: Strips,
    fit: SurfaceFit,
}

impl Measures {
    fn new(context: FaceContext<'_>, charted: &ChartedFace<'_>, projector: &Projector<'_>) -> Self {
        let surface: &Surface = &charted.surface;
        let mesh = &charted.mesh;
        let (breaks, about) = if is_free(surface) {
            (breaks_of(surface, mesh), area_of_facets(mesh))
        } else {
            Default::default()
        };
        let strips = strips(projector, mesh, &context.brep.edges, &breaks, about);
        let fit = surface_fit(surface, charted.chart, mesh, &strips, (&breaks, about));
        Self {
            breaks,
            strips,
            fit,
        }
    }

    fn misses_area(&self, mesh: &FaceMesh) -> bool {
        (mesh.area_of_triangles() - self.fit.area).abs() > ROUGH_AREA * self.fit.area
    }

    fn misses_surface(&self) -> bool {
        self.fit.in_slivers > ROUGH_SLIVERS || self.fit.off_normal > ROUGH_NORMALS
    }
}

/// Sets the area of the face, the volume that its triangles cut off, and the volume under it.
fn set_measures(
    mesh: &mut FaceMesh,
    context: FaceContext<'_>,
    face: &BrepFace,
    charted: &ChartedFace<'_>,
    measures: &Measures,
) {
    let Measures {
        breaks,
        strips,
        fit,
    } = measures;
    let inward = face.is_inward();
    // If the quadrature fails, the area must not become negative.
    mesh.impossible_area = (fit.area <= 0.0).then_some(fit.area);
    mesh.area = if fit.area > 0.0 {
        fit.area
    } else {
        mesh.area_of_triangles()
    };
    mesh.cut_off = if inward { -fit.between } else { fit.between };
    if let Some(origin) = context.volume_origin(face) {
        let volume = cone_volume(
            &charted.surface,
            charted.chart,
            (&charted.mesh, strips),
            (breaks, fit.area),
            origin,
        );
        mesh.volume = if inward { -volume } else { volume };
    }
}

/// The triangles of a face, with the gaps up to its boundary filled, and the parameters of their vertices.
fn closed_triangles(
    context: FaceContext<'_>,
    face: &BrepFace,
    charted: &ChartedFace<'_>,
    projector: &Projector<'_>,
) -> (FaceMesh, Vec<[f64; 2]>) {
    let ChartedFace {
        polygons,
        chart,
        mesh,
        ..
    } = charted;
    let inward = face.is_inward();
    let (mut result, mut parameters) = outward_triangles(*chart, mesh, inward);
    let n_sides: usize = polygons.iter().map(Vec::len).sum();
    if mesh.is_ragged || mesh.sides.len() < n_sides {
        close(&mut result, polygons, inward);
        let added = &result.points[parameters.len()..];
        parameters.extend(added.iter().map(|&point| projector.project(point, None).uv));
        result.walks =
            walks_of_triangles(&result.points, &result.triangles, polygons, context.edges);
    } else {
        result.walks = walks_of_sides(&mesh.sides, context.edges, chart.is_mirrored() != inward);
    }
    (result, parameters)
}

/// The knots in the parameter range of the nodes, extended for triangles that reach over a seam.
fn breaks_of(surface: &Surface, mesh: &ChartTriangulation) -> Breaks {
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

/// The triangles, oriented outward, without those that have no extent; the vertices that they use; and the parameters of
/// these vertices.
fn outward_triangles(
    chart: Chart,
    mesh: &ChartTriangulation,
    inward: bool,
) -> (FaceMesh, Vec<[f64; 2]>) {
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

/// Fills the gaps between the triangles and the boundary, so that the meshes of the neighbors meet this one.
fn close(mesh: &mut FaceMesh, polygons: &[Vec<BoundaryPoint>], inward: bool) {
    let walk = |polygon: &Vec<BoundaryPoint>| {
        let mut points: Vec<Point> = polygon.iter().map(|corner| corner.point).collect();
        if inward {
            points.reverse();
        }
        points
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

/// Returns the mesh if it has triangles and all its points are finite.
fn sound(mesh: FaceMesh) -> Result<FaceMesh, FaceMeshError> {
    if mesh.triangles.is_empty() {
        Err(FaceMeshError::Empty)
    } else if !mesh.points.iter().all(|&point| is_finite(point)) || !mesh.area.is_finite() {
        Err(FaceMeshError::Infinite)
    } else {
        Ok(mesh)
    }
}
