//! Makes the carrier of a mesh or a point cloud without a B-Rep, with its given labels.
//!
//! Vertices, triangles and labels go in, and a [`Carrier`] comes out. Its faces are the sets of triangles, or of points, with the
//! same label, in the order of the labels. Triangles or points without a label are the last face. The labels are the layer
//! [`GIVEN`]. Nothing here reads a file or invents a label.

use crate::carrier::{Carrier, CarrierError, CarrierMeta};
use crate::estimated_normals::{N_NEIGHBORS, estimated_normals};
use crate::label_layer::{GIVEN, LabelLayer};
use crate::labels::IGNORE;
use partprobe_shape::{Face, FaceGraph, FaceType, Mesh, Point, Units, norm};
use std::collections::{BTreeMap, BTreeSet};

/// A mesh or a point cloud, with its given labels, if any.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GivenShape {
    /// The vertices of the mesh, or the points of the cloud.
    pub vertices: Vec<Point>,
    /// One normal per point of a cloud, or an empty list. The normals of a mesh are not used.
    pub normals: Vec<[f32; 3]>,
    /// The triangles. A shape without triangles is a cloud.
    pub triangles: Vec<[u32; 3]>,
    /// One label per triangle, or per point of a cloud. A negative number means that there is no label. The list is empty if the
    /// shape has no given labels.
    pub labels: Vec<i32>,
    /// The names of the labels that have a name.
    pub label_names: BTreeMap<i32, String>,
    /// The origin of the shape, for the notes of its carrier. For example, where its labels were read.
    pub notes: Vec<String>,
}

impl GivenShape {
    /// The number of triangles, or of points of a cloud, and the word for them.
    #[must_use]
    pub fn elements(&self) -> (usize, &'static str) {
        match self.triangles.len() {
            0 => (self.vertices.len(), "points"),
            n_triangles => (n_triangles, "triangles"),
        }
    }
}

/// The reason why a mesh or a cloud has no carrier.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GivenError {
    /// There is neither a triangle nor a point.
    #[error("there are no triangles and no points")]
    Empty,
    /// A coordinate is NaN or infinite.
    #[error("{vertex} {number} has a coordinate that is not a finite number")]
    NotFinite {
        /// `vertex` or `point`.
        vertex: &'static str,
        /// Its number, counted from 0.
        number: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, and there are only {n_vertices}")]
    Corner {
        /// The number of the triangle, counted from 0.
        triangle: usize,
        /// The number of the vertex, counted from 0.
        vertex: u32,
        /// The number of vertices.
        n_vertices: usize,
    },
    /// There are more or fewer labels than triangles or points.
    #[error("there are {n_labels} labels for {n_elements} {elements}")]
    LabelCount {
        /// The number of labels.
        n_labels: usize,
        /// The number of triangles or points.
        n_elements: usize,
        /// `triangles` or `points`.
        elements: &'static str,
    },
    /// There are more or fewer normals than points.
    #[error("there are {n_normals} normals for {n_points} points")]
    NormalCount {
        /// The number of normals.
        n_normals: usize,
        /// The number of points.
        n_points: usize,
    },
    /// All points coincide, or no triangle has an area.
    #[error("it has no extent: {0}")]
    NoExtent(&'static str),
    /// The mesh, the faces and the labels do not make a carrier.
    #[error(transparent)]
    Carrier(#[from] CarrierError),
}

/// The carrier of a mesh or a cloud. `source_sha256` is the hash of the file from which it was read.
///
/// Coordinates are not changed: a unit of the file counts as one millimeter. Points without usable normals get estimated ones,
/// and a note says so.
///
/// # Errors
/// If the shape is empty or has no extent, or its lists do not fit each other.
pub fn carrier_of_given(
    shape: GivenShape,
    id: &str,
    source_sha256: &str,
) -> Result<Carrier, GivenError> {
    check(&shape)?;
    let faces = LabeledFaces::of(&shape);
    let mut notes = shape.notes.clone();
    let mesh = if shape.triangles.is_empty() {
        let normals = normals_of_cloud(&shape, &mut notes);
        cloud_with_faces(shape.vertices, normals, &faces.of_element)
    } else {
        mesh_with_faces(&shape.vertices, &shape.triangles, &faces.of_element)
    };
    let graph = FaceGraph {
        faces: faces.rows(&mesh, &shape.label_names),
        edges: Vec::new(),
    };
    let diagonal = mesh.diagonal();
    if !(diagonal > 0.0 && diagonal.is_finite()) {
        return Err(GivenError::NoExtent("all of its points coincide"));
    }
    let meta = CarrierMeta {
        id: id.to_owned(),
        source_sha256: source_sha256.to_owned(),
        theta_deg: 0.0,
        tau_min: 0,
        chord_mm: 0.0,
        angle_rad: 0.0,
        diagonal_mm: diagonal,
        units: Units {
            length: "unknown".to_owned(),
            ..Units::millimeters_and_radians()
        },
        lost: Vec::new(),
        notes,
        instances: Vec::new(),
    };
    Ok(Carrier::new(mesh, graph, [(GIVEN, faces.layer())], meta)?)
}

fn check(shape: &GivenShape) -> Result<(), GivenError> {
    let n_vertices = shape.vertices.len();
    let is_cloud = shape.triangles.is_empty();
    if n_vertices == 0 {
        return Err(GivenError::Empty);
    }
    let is_finite = |point: &Point| point.iter().all(|x| x.is_finite());
    if let Some(number) = shape.vertices.iter().position(|point| !is_finite(point)) {
        let vertex = if is_cloud { "point" } else { "vertex" };
        return Err(GivenError::NotFinite { vertex, number });
    }
    for (triangle, corners) in shape.triangles.iter().enumerate() {
        if let Some(&vertex) = corners
            .iter()
            .find(|&&vertex| vertex as usize >= n_vertices)
        {
            return Err(GivenError::Corner {
                triangle,
                vertex,
                n_vertices,
            });
        }
    }
    let (n_elements, elements) = shape.elements();
    let n_labels = shape.labels.len();
    if n_labels != 0 && n_labels != n_elements {
        return Err(GivenError::LabelCount {
            n_labels,
            n_elements,
            elements,
        });
    }
    let n_normals = shape.normals.len();
    if is_cloud && n_normals != 0 && n_normals != n_vertices {
        return Err(GivenError::NormalCount {
            n_normals,
            n_points: n_vertices,
        });
    }
    let has_area = |&[a, b, c]: &[u32; 3]| {
        let corners = [a, b, c].map(|vertex| shape.vertices[vertex as usize]);
        partprobe_shape::triangle_area(corners) > 0.0
    };
    if !is_cloud && !shape.triangles.iter().any(has_area) {
        return Err(GivenError::NoExtent("no triangle has an area"));
    }
    Ok(())
}

/// The labels as faces.
struct LabeledFaces {
    /// The given label of each face, or `None` for the face of the triangles or points without a label.
    labels: Vec<Option<i32>>,
    /// The face of each triangle or point.
    of_element: Vec<u32>,
}

impl LabeledFaces {
    fn of(shape: &GivenShape) -> Self {
        let (n_elements, _) = shape.elements();
        let label_of = |element: usize| {
            shape
                .labels
                .get(element)
                .copied()
                .filter(|&label| label >= 0)
        };
        let distinct: BTreeSet<i32> = (0..n_elements).filter_map(label_of).collect();
        let face_of: BTreeMap<i32, u32> = distinct.iter().copied().zip(0..).collect();
        let unlabeled = distinct.len() as u32;
        let of_element: Vec<u32> = (0..n_elements)
            .map(|element| label_of(element).map_or(unlabeled, |label| face_of[&label]))
            .collect();
        let mut labels: Vec<Option<i32>> = distinct.into_iter().map(Some).collect();
        if of_element.contains(&unlabeled) {
            labels.push(None);
        }
        Self { labels, of_element }
    }

    fn layer(&self) -> LabelLayer {
        let label = |(rank, label): (i32, &Option<i32>)| label.map_or(IGNORE, |_| rank);
        (0..).zip(&self.labels).map(label).collect()
    }

    /// The faces, named by their labels. A cloud has no area.
    fn rows(&self, mesh: &Mesh, names: &BTreeMap<i32, String>) -> Vec<Face> {
        let mut areas = vec![0.0; self.labels.len()];
        for (area, &face) in mesh.triangle_areas().into_iter().zip(&mesh.tri_face) {
            areas[face as usize] += area;
        }
        let name = |label: i32| {
            names
                .get(&label)
                .cloned()
                .unwrap_or_else(|| label.to_string())
        };
        let face = |(&label, area): (&Option<i32>, f64)| Face {
            name: label.map(name),
            ..Face::new(0, FaceType::Other, area)
        };
        self.labels.iter().zip(areas).map(face).collect()
    }
}

/// The given normals as unit vectors, or estimated normals if one is missing. A note tells if they are estimated.
fn normals_of_cloud(shape: &GivenShape, notes: &mut Vec<String>) -> Vec<[f32; 3]> {
    let n_without = shape
        .normals
        .iter()
        .filter(|normal| unit(**normal).is_none())
        .count();
    if !shape.normals.is_empty() && n_without == 0 {
        notes.push("the normals came with the points".to_owned());
        return shape
            .normals
            .iter()
            .filter_map(|&normal| unit(normal))
            .collect();
    }
    let reason = if shape.normals.is_empty() {
        "the points came without normals".to_owned()
    } else {
        format!("{n_without} of the normals that came with the points have no direction")
    };
    notes.push(format!(
        "{reason}; all were estimated from the {N_NEIGHBORS} nearest points"
    ));
    estimated_normals(&shape.vertices)
}

fn unit(vector: [f32; 3]) -> Option<[f32; 3]> {
    let vector = vector.map(f64::from);
    let length = norm(vector);
    (length > 0.0 && length.is_finite()).then(|| vector.map(|x| (x / length) as f32))
}

fn cloud_with_faces(points: Vec<Point>, normals: Vec<[f32; 3]>, face_of_point: &[u32]) -> Mesh {
    Mesh {
        vertex_face: face_of_point.to_vec(),
        tri_face: face_of_point.to_vec(),
        ..Mesh::cloud(points, normals)
    }
}

/// The mesh in which each vertex belongs to one face. Vertices between faces are doubled, and vertices without a triangle are
/// left out.
fn mesh_with_faces(vertices: &[Point], triangles: &[[u32; 3]], face_of_triangle: &[u32]) -> Mesh {
    let mut mesh = Mesh {
        tri_face: face_of_triangle.to_vec(),
        ..Mesh::default()
    };
    let mut new_index = BTreeMap::new();
    for (corners, &face) in triangles.iter().zip(face_of_triangle) {
        let corners = corners.map(|vertex| {
            *new_index.entry((vertex, face)).or_insert_with(|| {
                mesh.vertices.push(vertices[vertex as usize]);
                mesh.vertex_face.push(face);
                (mesh.vertices.len() - 1) as u32
            })
        });
        mesh.triangles.push(corners);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape_kind::ShapeKind;

    const SQUARE: [Point; 4] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];

    fn mesh(labels: &[i32]) -> GivenShape {
        GivenShape {
            vertices: SQUARE.to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 1, 3]],
            labels: labels.to_vec(),
            label_names: BTreeMap::from([(9, "leg".to_owned())]),
            ..GivenShape::default()
        }
    }

    fn cloud(normals: &[[f32; 3]]) -> GivenShape {
        GivenShape {
            vertices: SQUARE.to_vec(),
            normals: normals.to_vec(),
            labels: vec![1, 1, 0, -5],
            ..GivenShape::default()
        }
    }

    #[test]
    fn faces_are_the_sets_of_one_label() {
        let carrier = carrier_of_given(mesh(&[9, -1, 4]), "a", "00").unwrap();
        assert_eq!(carrier.kind(), ShapeKind::Mesh);
        assert_eq!(carrier.mesh().tri_face, [1, 2, 0]);
        assert_eq!(carrier.part_of_face(), [0, 1, -1]);
        assert_eq!((carrier.n_parts(), carrier.n_raw_parts()), (2, 2));
        let names: Vec<_> = carrier
            .graph()
            .faces
            .iter()
            .map(|face| face.name.as_deref())
            .collect();
        assert_eq!(names, [Some("4"), Some("leg"), None]);
        assert_eq!(carrier.graph().faces[1].area, 0.5);
        // No two faces share a vertex.
        assert_eq!(carrier.mesh().vertices.len(), 9);

        let without = carrier_of_given(mesh(&[]), "a", "00").unwrap();
        assert_eq!((without.part_of_face(), without.n_parts()), (&[-1][..], 0));
        assert_eq!(without.mesh().vertices.len(), 4);
    }

    #[test]
    fn a_cloud_keeps_its_points_and_normals() {
        let carrier = carrier_of_given(cloud(&[[0.0, 0.0, 2.0]; 4]), "a", "00").unwrap();
        assert_eq!(carrier.kind(), ShapeKind::Cloud);
        assert_eq!(carrier.mesh().vertices, SQUARE);
        assert_eq!(carrier.mesh().vertex_normal, [[0.0, 0.0, 1.0]; 4]);
        assert_eq!(carrier.triangle_labels().of_triangle(), [1, 1, 0, -1]);
        assert_eq!(carrier.meta().notes, ["the normals came with the points"]);

        for normals in [vec![], vec![[0.0; 3]; 4]] {
            let carrier = carrier_of_given(cloud(&normals), "a", "00").unwrap();
            assert!(
                carrier
                    .mesh()
                    .vertex_normal
                    .iter()
                    .all(|normal| normal[2].abs() > 0.999)
            );
            assert!(
                carrier.meta().notes[0].contains("estimated"),
                "{:?}",
                carrier.meta()
            );
        }
    }

    #[track_caller]
    fn check_refusal(change: impl FnOnce(&mut GivenShape), expected: &str) {
        let mut shape = mesh(&[]);
        change(&mut shape);
        let error = carrier_of_given(shape, "a", "00").unwrap_err();
        assert_eq!(error.to_string(), expected);
    }

    #[test]
    fn what_does_not_fit_is_named() {
        check_refusal(
            |shape| *shape = GivenShape::default(),
            "there are no triangles and no points",
        );
        check_refusal(
            |shape| shape.vertices[2][1] = f64::NAN,
            "vertex 2 has a coordinate that is not a finite number",
        );
        check_refusal(
            |shape| shape.triangles[1][2] = 4,
            "triangle 1 names vertex 4, and there are only 4",
        );
        check_refusal(
            |shape| shape.labels = vec![1],
            "there are 1 labels for 3 triangles",
        );
        check_refusal(
            |shape| shape.triangles = vec![[1, 1, 2]],
            "it has no extent: no triangle has an area",
        );
        check_refusal(
            |shape| {
                *shape = GivenShape {
                    vertices: vec![[1.0; 3]; 4],
                    ..GivenShape::default()
                }
            },
            "it has no extent: all of its points coincide",
        );
    }
}
