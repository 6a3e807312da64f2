//! Holds the labeled mesh of one shape, with all data of its faces.
//!
//! A mesh, a face graph, label layers and settings go in, and their sizes and indices are checked. Nothing here computes a
//! label.

use crate::label_layer::{GIVEN, LabelLayer, STEP_PARTS, STEP_PARTS_RAW};
use crate::labels::Labels;
use crate::shape_kind::ShapeKind;
use partprobe_shape::{FaceGraph, Instance, Mesh, SurfaceAttributes, Units};
use std::collections::BTreeMap;

/// The settings with which a carrier was made, and its origin.
#[derive(Clone, Debug, PartialEq)]
pub struct CarrierMeta {
    /// The id of the shape in its data set.
    pub id: String,
    /// SHA-256 of the STEP text, in hexadecimal.
    pub source_sha256: String,
    /// Dihedral threshold θ, in degrees.
    pub theta_deg: f64,
    /// Parts with fewer triangles on the refined carrier are absorbed. A value of 0 absorbs no part.
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
    /// Notes about what was left out on purpose, and about faces that the file gives as triangles.
    pub notes: Vec<String>,
    /// The product occurrences to which faces belong. [`Face::instance`](partprobe_shape::Face::instance) is an index into this
    /// list.
    pub instances: Vec<Instance>,
}

/// A mesh in which every triangle records its face, the graph of the faces, and labels of the faces by several sources.
///
/// A shape is read from a STEP file, or it is a mesh or a point cloud alone. [`Carrier::kind`] says which.
///
/// Invariants: every layer has one label per face; either the layers [`STEP_PARTS`] and [`STEP_PARTS_RAW`] exist, or the layer
/// [`GIVEN`] does; every `tri_face` and `vertex_face` is a face of `graph`. The fields are private, so every carrier was checked
/// by [`Carrier::new`].
#[derive(Clone, Debug, PartialEq)]
pub struct Carrier {
    mesh: Mesh,
    graph: FaceGraph,
    layers: BTreeMap<String, LabelLayer>,
    meta: CarrierMeta,
    attributes: SurfaceAttributes,
}

/// The reason why a mesh, a graph and layers do not make a carrier.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CarrierError {
    /// A list does not have one entry per described item.
    #[error("`{list}` has {found} entries for {expected}")]
    Length {
        /// The list that is too short or too long.
        list: &'static str,
        /// The number of its entries.
        found: usize,
        /// The expected number of entries.
        expected: usize,
    },
    /// A layer does not have one label per face.
    #[error("the label layer `{layer}` has {found} labels for {n_faces} faces")]
    LayerLength {
        /// The name of the layer.
        layer: String,
        /// The number of its labels.
        found: usize,
        /// The number of faces.
        n_faces: usize,
    },
    /// A layer that every carrier has is missing.
    #[error("the label layer `{0}` is missing")]
    MissingLayer(&'static str),
    /// An index is outside the list to which it refers.
    #[error("`{list}` points at {index}, beyond the {len} that there are")]
    Index {
        /// The list that contains the index.
        list: &'static str,
        /// The index.
        index: usize,
        /// The length of the list to which it refers.
        len: usize,
    },
}

impl Carrier {
    /// Takes a mesh, the faces to which its triangles belong, and their labels by name.
    ///
    /// The layers [`STEP_PARTS`] and [`STEP_PARTS_RAW`] must be among them. A shape without a B-Rep has the layer [`GIVEN`]
    /// instead; [`carrier_of_given`](crate::carrier_of_given) makes its carrier.
    ///
    /// # Errors
    /// If mesh, graph and layers do not belong to the same shape, or a layer is missing.
    pub fn new<N: Into<String>>(
        mesh: Mesh,
        graph: FaceGraph,
        layers: impl IntoIterator<Item = (N, LabelLayer)>,
        meta: CarrierMeta,
    ) -> Result<Self, CarrierError> {
        let layers = layers.into_iter().map(|(name, layer)| (name.into(), layer));
        let carrier = Self {
            mesh,
            graph,
            layers: layers.collect(),
            meta,
            attributes: SurfaceAttributes::default(),
        };
        carrier.check()?;
        Ok(carrier)
    }

    /// Checks all invariants except those of the attributes.
    fn check(&self) -> Result<(), CarrierError> {
        let Self { mesh, graph, .. } = self;
        let n_faces = graph.faces.len();
        let required: &[&str] = match self.kind() {
            ShapeKind::Brep => &[STEP_PARTS_RAW, STEP_PARTS],
            ShapeKind::Mesh | ShapeKind::Cloud => &[GIVEN],
        };
        for &name in required {
            if !self.layers.contains_key(name) {
                return Err(CarrierError::MissingLayer(name));
            }
        }
        for (name, layer) in &self.layers {
            check_layer(name, layer, n_faces)?;
        }
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
        Ok(())
    }

    /// The same carrier with one more layer. A layer of the same name is replaced.
    ///
    /// # Errors
    /// If the layer does not have one label per face.
    pub fn with_layer(
        mut self,
        name: impl Into<String>,
        layer: LabelLayer,
    ) -> Result<Self, CarrierError> {
        let name = name.into();
        check_layer(&name, &layer, self.graph.faces.len())?;
        self.layers.insert(name, layer);
        Ok(self)
    }

    /// The same carrier with one more line in the notes of its settings.
    #[must_use]
    pub fn with_note(mut self, note: String) -> Self {
        self.meta.notes.push(note);
        self
    }

    /// The same carrier with attributes of the true surfaces at its vertices.
    ///
    /// # Errors
    /// If a list that is not empty does not have one row per vertex.
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

    /// The labels of the faces by the name of their source, in the order of the names.
    #[must_use]
    pub fn layers(&self) -> &BTreeMap<String, LabelLayer> {
        &self.layers
    }

    /// The labels of the faces by the source with this name. Returns `None` if the carrier does not store them.
    #[must_use]
    pub fn layer(&self, name: &str) -> Option<&LabelLayer> {
        self.layers.get(name)
    }

    /// The kind of data from which the shape was read: a B-Rep, a mesh, or a point cloud.
    #[must_use]
    pub fn kind(&self) -> ShapeKind {
        let is_given = self.layers.contains_key(GIVEN) && !self.layers.contains_key(STEP_PARTS);
        match is_given {
            false => ShapeKind::Brep,
            true if self.mesh.is_cloud() => ShapeKind::Cloud,
            true => ShapeKind::Mesh,
        }
    }

    /// The layer of the parts before small ones were absorbed. A shape without a B-Rep has its given labels instead.
    fn raw_parts(&self) -> Option<&LabelLayer> {
        self.layer(STEP_PARTS_RAW).or_else(|| self.layer(GIVEN))
    }

    /// The layer of the parts. A shape without a B-Rep has its given labels instead.
    fn parts(&self) -> Option<&LabelLayer> {
        self.layer(STEP_PARTS).or_else(|| self.layer(GIVEN))
    }

    /// The part of each face before small parts were absorbed: the layer [`STEP_PARTS_RAW`], or [`GIVEN`] if the shape has
    /// no B-Rep.
    #[must_use]
    pub fn raw_part_of_face(&self) -> &[i32] {
        self.raw_parts().map_or(&[], LabelLayer::of_face)
    }

    /// The part of each face after small parts were absorbed: the layer [`STEP_PARTS`], or [`GIVEN`] if the shape has no B-Rep. A
    /// face without a given label has a negative number.
    #[must_use]
    pub fn part_of_face(&self) -> &[i32] {
        self.parts().map_or(&[], LabelLayer::of_face)
    }

    /// The attributes of the true surfaces at the vertices. Lists that were not requested are empty.
    #[must_use]
    pub fn attributes(&self) -> &SurfaceAttributes {
        &self.attributes
    }

    /// The settings and the origin.
    #[must_use]
    pub fn meta(&self) -> &CarrierMeta {
        &self.meta
    }

    /// The number of parts before small parts were absorbed.
    #[must_use]
    pub fn n_raw_parts(&self) -> usize {
        self.raw_parts().map_or(0, LabelLayer::n_labels)
    }

    /// The number of parts after small parts were absorbed.
    #[must_use]
    pub fn n_parts(&self) -> usize {
        self.parts().map_or(0, LabelLayer::n_labels)
    }

    /// The part of each triangle: the label of its face (paper §3.3: y_j = ℓ(f_j)).
    #[must_use]
    pub fn triangle_labels(&self) -> Labels {
        Labels::from_faces(&self.mesh.tri_face, self.part_of_face())
    }
}

fn check_layer(name: &str, layer: &LabelLayer, n_faces: usize) -> Result<(), CarrierError> {
    let found = layer.of_face().len();
    if found == n_faces {
        return Ok(());
    }
    Err(CarrierError::LayerLength {
        layer: name.to_owned(),
        found,
        n_faces,
    })
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
