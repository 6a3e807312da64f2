//! The labeled mesh of one shape, with all that was known of its faces.

use crate::labels::Labels;
use crate::partition::Partition;
use crate::tau_min::{TauMin, absorb_small_parts};
use partprobe_shape::{FaceGraph, Instance, Mesh, SurfaceAttributes, Units};

/// The settings that a carrier was made with, and where it came from.
#[derive(Clone, Debug, PartialEq)]
pub struct CarrierMeta {
    /// The id of the shape in its data set.
    pub id: String,
    /// SHA-256 of the STEP text, in hexadecimal.
    pub source_sha256: String,
    /// Dihedral threshold θ, in degrees.
    pub theta_deg: f64,
    /// Parts with fewer triangles on the refined carrier are absorbed; 0 absorbs none.
    pub tau_min: u32,
    /// Chord tolerance of the tessellation, in millimeters.
    pub chord_mm: f64,
    /// Angle tolerance of the tessellation, in radians.
    pub angle_rad: f64,
    /// Diagonal of the bounding box, in millimeters.
    pub diagonal_mm: f64,
    /// The file's units.
    pub units: Units,
    /// Faces that have no triangles or could not be read, each with its reason.
    pub lost: Vec<String>,
    /// What was left out on purpose, and which faces are triangles of the file.
    pub notes: Vec<String>,
    /// The product occurrences that faces belong to; [`Face::instance`](partprobe_shape::Face::instance) counts them.
    pub instances: Vec<Instance>,
}

/// A mesh whose triangles know their faces, the face graph, and the partition before and after τ_min.
///
/// Invariants: one part and one label a face; every `tri_face` and `vertex_face` is a face of `graph`.
/// Fields are private, [`Carrier::new`] and [`Carrier::from_stored`] are the only doors.
#[derive(Clone, Debug, PartialEq)]
pub struct Carrier {
    mesh: Mesh,
    graph: FaceGraph,
    face_part: Vec<i32>,
    face_label: Vec<i32>,
    meta: CarrierMeta,
    attributes: SurfaceAttributes,
}

/// The pieces do not belong to one shape.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CarrierError {
    /// A list has not one entry for each of what it describes.
    #[error("`{list}` has {found} entries for {expected}")]
    Length {
        /// The list that is too short or too long.
        list: &'static str,
        /// How many entries it has.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// An index points outside the list that it counts.
    #[error("`{list}` points at {index}, beyond the {len} that there are")]
    Index {
        /// The list that holds the index.
        list: &'static str,
        /// The index.
        index: usize,
        /// The length of the list that it counts.
        len: usize,
    },
}

impl Carrier {
    /// Partitions the faces at `meta.theta_deg`, absorbs small parts at `meta.tau_min`, and keeps both layers.
    ///
    /// # Errors
    /// If mesh and graph are of different shapes.
    pub fn new(mesh: Mesh, graph: FaceGraph, meta: CarrierMeta) -> Result<Self, CarrierError> {
        let partition = Partition::by_type_and_angle(&graph, meta.theta_deg);
        check_indices("tri_face", mesh.tri_face.iter().copied(), graph.faces.len())?;
        let face_label = match meta.tau_min {
            0 => partition.clone(),
            tau_min => absorb_small_parts(&mesh, &graph, &partition, TauMin(tau_min)),
        };
        let as_labels =
            |partition: &Partition| partition.parts().iter().map(|&part| part as i32).collect();
        Self::from_stored(
            mesh,
            graph,
            as_labels(&partition),
            as_labels(&face_label),
            meta,
        )
    }

    /// Takes a carrier as a file holds it.
    ///
    /// # Errors
    /// If a list has the wrong length or an index points outside its list.
    pub fn from_stored(
        mesh: Mesh,
        graph: FaceGraph,
        face_part: Vec<i32>,
        face_label: Vec<i32>,
        meta: CarrierMeta,
    ) -> Result<Self, CarrierError> {
        let n_faces = graph.faces.len();
        check_length("face_part", face_part.len(), n_faces)?;
        check_length("face_label", face_label.len(), n_faces)?;
        check_length("tri_face", mesh.tri_face.len(), mesh.triangles.len())?;
        check_length("vertex_face", mesh.vertex_face.len(), mesh.vertices.len())?;
        if !mesh.vertex_normal.is_empty() {
            check_length(
                "vertex_normal",
                mesh.vertex_normal.len(),
                mesh.vertices.len(),
            )?;
        }
        check_indices("tri_face", mesh.tri_face.iter().copied(), n_faces)?;
        check_indices("vertex_face", mesh.vertex_face.iter().copied(), n_faces)?;
        check_indices(
            "triangles",
            mesh.triangles.iter().flatten().copied(),
            mesh.vertices.len(),
        )?;
        check_indices(
            "edge_faces",
            graph.edges.iter().flat_map(|edge| edge.faces),
            n_faces,
        )?;
        Ok(Self {
            mesh,
            graph,
            face_part,
            face_label,
            meta,
            attributes: SurfaceAttributes::default(),
        })
    }

    /// The same carrier with what its surfaces say at its vertices.
    ///
    /// # Errors
    /// If a list that isn't empty has not one row for each vertex.
    pub fn with_attributes(self, attributes: SurfaceAttributes) -> Result<Self, CarrierError> {
        let SurfaceAttributes {
            uv,
            curvature,
            direction,
        } = &attributes;
        let lists = [
            ("vertex_uv", uv.len()),
            ("vertex_curvature", curvature.len()),
            ("vertex_direction", direction.len()),
        ];
        for (list, found) in lists.into_iter().filter(|&(_, found)| found > 0) {
            check_length(list, found, self.mesh.vertices.len())?;
        }
        Ok(Self { attributes, ..self })
    }

    /// The triangles and their source faces.
    #[must_use]
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The faces and the edges between them.
    #[must_use]
    pub fn graph(&self) -> &FaceGraph {
        &self.graph
    }

    /// The part of each face, as the predicate gives it.
    #[must_use]
    pub fn face_part(&self) -> &[i32] {
        &self.face_part
    }

    /// The label of each face, after small parts were absorbed; training and evaluation use these.
    #[must_use]
    pub fn face_label(&self) -> &[i32] {
        &self.face_label
    }

    /// What the true surfaces say at the vertices; lists that were not asked for are empty.
    #[must_use]
    pub fn attributes(&self) -> &SurfaceAttributes {
        &self.attributes
    }

    /// The settings and the origin.
    #[must_use]
    pub fn meta(&self) -> &CarrierMeta {
        &self.meta
    }

    /// How many parts the predicate gives.
    #[must_use]
    pub fn n_parts(&self) -> usize {
        count_ids(&self.face_part)
    }

    /// How many labels there are after small parts were absorbed.
    #[must_use]
    pub fn n_labels(&self) -> usize {
        count_ids(&self.face_label)
    }

    /// The label of each triangle (paper §3.3: y_j = ℓ(f_j)).
    #[must_use]
    pub fn triangle_labels(&self) -> Labels {
        Labels::from_faces(&self.mesh.tri_face, &self.face_label)
    }
}

fn count_ids(ids: &[i32]) -> usize {
    ids.iter()
        .max()
        .map_or(0, |&max| usize::try_from(max + 1).unwrap_or(0))
}

fn check_length(list: &'static str, found: usize, expected: usize) -> Result<(), CarrierError> {
    if found == expected {
        Ok(())
    } else {
        Err(CarrierError::Length {
            list,
            found,
            expected,
        })
    }
}

fn check_indices(
    list: &'static str,
    mut indices: impl Iterator<Item = u32>,
    len: usize,
) -> Result<(), CarrierError> {
    match indices.find(|&index| index as usize >= len) {
        Some(index) => Err(CarrierError::Index {
            list,
            index: index as usize,
            len,
        }),
        None => Ok(()),
    }
}
