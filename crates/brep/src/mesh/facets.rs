//! Takes over the triangles of a face that the file gives as triangles.

use super::attributes::forget_attributes;
use super::face_mesh::FaceMesh;
use super::orientation::walks_of_loops;
use super::settings::AttributeChoice;
use crate::geometry::Facets;
use crate::geometry::linear::unit;
use crate::model::BrepFace;
use partprobe_shape::{Point, SurfaceAttributes, cross, dot, subtract};

/// The triangles of a face, oriented outward. `origin` is the point from which volumes are measured, if they are wanted.
///
/// There is no surface under them, so parameters and curvatures are undefined.
pub(crate) fn facets_mesh(
    face: &BrepFace,
    facets: &Facets,
    choice: AttributeChoice,
    origin: Option<Point>,
) -> FaceMesh {
    let mut mesh = FaceMesh {
        points: facets.points.clone(),
        triangles: facets.triangles.clone(),
        area: facets.area(),
        on_boundary: vec![false; facets.points.len()],
        ..FaceMesh::default()
    };
    if choice.normal {
        mesh.normals = normals(facets);
    }
    mesh.attributes = undefined(choice, facets.points.len());
    if let Some(origin) = origin {
        mesh.volume = mesh
            .triangles
            .iter()
            .map(|&corners| cone(&mesh.points, corners, origin))
            .sum();
    }
    if face.is_inward() {
        mesh.reverse();
    }
    // The loops were made from the triangles, so they give the directions in which the triangles walk the edges.
    mesh.walks = walks_of_loops(face).collect();
    mesh
}

/// The normals of the file, or else the mean normal of the triangles that meet at each vertex.
fn normals(facets: &Facets) -> Vec<[f32; 3]> {
    let mean = facets.mean_normals();
    let given = facets
        .normals
        .iter()
        .copied()
        .chain(std::iter::repeat([0.0; 3]));
    let of_point =
        |(given, mean): (Point, Point)| unit(given).or_else(|| unit(mean)).unwrap_or_default();
    given
        .zip(mean)
        .map(|pair| of_point(pair).map(|x| x as f32))
        .collect()
}

fn undefined(choice: AttributeChoice, n_points: usize) -> SurfaceAttributes {
    let mut attributes = SurfaceAttributes::default();
    if choice.uv {
        attributes.uv = vec![[0.0; 2]; n_points];
    }
    if choice.curvature {
        attributes.curvature = vec![[0.0; 2]; n_points];
        attributes.direction = vec![[[0.0; 3]; 2]; n_points];
    }
    forget_attributes(&mut attributes);
    attributes
}

fn cone(points: &[Point], corners: [u32; 3], origin: Point) -> f64 {
    let [a, b, c] = corners.map(|corner| subtract(points[corner as usize], origin));
    dot(a, cross(b, c)) / 6.0
}
