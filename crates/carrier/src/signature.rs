//! Describes a shape so that duplicates are recognized: types, edges, relative areas, and the form of simple shapes.
//!
//! A face graph and a mesh go in, and a [`Signature`] comes out. It does not change if the shape is moved or scaled.

use crate::carrier::Carrier;
use crate::form::{Form, are_equal, are_same_mesh, form};
use crate::shape_kind::ShapeKind;
use partprobe_shape::{FaceGraph, FaceType, Mesh};

/// Relative face areas that differ by no more than this are equal.
const AREA_TOLERANCE: f64 = 1e-3;

/// For shapes with this number of faces or fewer, the form is also compared, because the relative areas do not distinguish them.
/// For example, all shapes with a single face have equal relative areas.
const FEW_FACES: usize = 4;

/// The signature of a shape: numbers that do not change if it is moved, scaled or renumbered.
#[derive(Clone, Debug, PartialEq)]
pub struct Signature {
    /// The number of faces of each primitive type, by type code.
    pub type_histogram: [u32; FaceType::ALL.len()],
    /// The number of shared edges.
    pub n_edges: usize,
    /// Each face's fraction of the whole area, the largest first.
    pub relative_areas: Vec<f64>,
    /// The spread of the surface and of its normals, for shapes with few faces and for shapes without a B-Rep.
    pub form: Option<[f64; 8]>,
    /// The kind of data from which the shape was read. Without a B-Rep, types and edges carry no information.
    pub kind: ShapeKind,
}

/// The values that equal shapes have in common: kind, types and the number of edges.
pub type Family = (ShapeKind, [u32; FaceType::ALL.len()], usize);

/// The signature of a shape from its faces and its triangles.
#[must_use]
pub fn signature(graph: &FaceGraph, mesh: &Mesh) -> Signature {
    let mut type_histogram = [0; FaceType::ALL.len()];
    for face in &graph.faces {
        type_histogram[usize::from(face.face_type.code())] += 1;
    }
    let total: f64 = graph.faces.iter().map(|face| face.area).sum();
    let share = |area: f64| {
        if total > 0.0 && area.is_finite() {
            area / total
        } else {
            0.0
        }
    };
    let mut relative_areas: Vec<f64> = graph.faces.iter().map(|face| share(face.area)).collect();
    relative_areas.sort_by(|a, b| b.total_cmp(a));
    let form = (graph.faces.len() <= FEW_FACES).then(|| form(mesh));
    Signature {
        type_histogram,
        n_edges: graph.edges.len(),
        relative_areas,
        form,
        kind: ShapeKind::Brep,
    }
}

/// The signature of the shape of a carrier.
#[must_use]
pub fn signature_of_carrier(carrier: &Carrier) -> Signature {
    let (graph, mesh) = (carrier.graph(), carrier.mesh());
    let outline = signature(graph, mesh);
    match carrier.kind() {
        ShapeKind::Brep => outline,
        kind => Signature {
            form: Some(form(mesh)),
            kind,
            ..outline
        },
    }
}

impl Signature {
    /// The values that equal shapes have in common.
    #[must_use]
    pub fn family(&self) -> Family {
        (self.kind, self.type_histogram, self.n_edges)
    }

    /// Whether shapes of the same family are related, so that a split must not separate them.
    ///
    /// They are related if they have a B-Rep. Meshes and clouds with the same number of labels are not related.
    #[must_use]
    pub fn relates_family(&self) -> bool {
        self.kind == ShapeKind::Brep
    }

    /// Whether the two shapes count as the same shape.
    #[must_use]
    pub fn is_duplicate_of(&self, other: &Self) -> bool {
        let areas = || self.relative_areas.iter().zip(&other.relative_areas);
        self.family() == other.family()
            && self.relative_areas.len() == other.relative_areas.len()
            && areas().all(|(a, b)| (a - b).abs() <= AREA_TOLERANCE)
            && self.forms_agree(other)
    }

    fn forms_agree(&self, other: &Self) -> bool {
        let forms: Option<(&Form, &Form)> = self.form.as_ref().zip(other.form.as_ref());
        let agree = match self.kind {
            ShapeKind::Brep => are_equal,
            // Without types and edges, the form alone decides: only the same triangles or points count as equal.
            ShapeKind::Mesh | ShapeKind::Cloud => are_same_mesh,
        };
        forms.is_none_or(|(a, b)| agree(a, b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_shape::{Edge, Face};

    fn graph(faces: &[(FaceType, f64)], n_edges: usize) -> FaceGraph {
        let face = |&(face_type, area)| Face::new(1, face_type, area);
        let edge = Edge {
            faces: [0, 1],
            phi: 90.0,
            length: 1.0,
        };
        FaceGraph {
            faces: faces.iter().map(face).collect(),
            edges: vec![edge; n_edges],
        }
    }

    #[test]
    fn order_and_scale_do_not_matter() {
        use FaceType::{Plane, Torus};
        let a = signature(&graph(&[(Plane, 1.0), (Torus, 3.0)], 2), &Mesh::default());
        let b = signature(&graph(&[(Torus, 30.0), (Plane, 10.0)], 2), &Mesh::default());
        assert_eq!(a, b);
        assert_eq!(a.type_histogram, [1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0]);
        assert_eq!(
            (a.n_edges, a.relative_areas.as_slice()),
            (2, &[0.75, 0.25][..])
        );
    }

    #[test]
    fn duplicates_agree_in_types_edges_and_areas() {
        use FaceType::{Cone, Plane};
        let base = signature(&graph(&[(Plane, 0.5), (Cone, 0.5)], 2), &Mesh::default());
        let is_duplicate = |faces: &[(FaceType, f64)], n_edges| {
            signature(&graph(faces, n_edges), &Mesh::default()).is_duplicate_of(&base)
        };
        assert!(is_duplicate(&[(Plane, 0.5009), (Cone, 0.4991)], 2));
        assert!(!is_duplicate(&[(Plane, 0.5011), (Cone, 0.4989)], 2));
        assert!(!is_duplicate(&[(Plane, 0.5), (Cone, 0.5)], 3));
        assert!(!is_duplicate(&[(Plane, 0.5), (Plane, 0.5)], 2));
    }

    #[test]
    fn shapes_without_area_have_a_signature_too() {
        let areas = |faces: &[(FaceType, f64)]| {
            signature(&graph(faces, 0), &Mesh::default()).relative_areas
        };
        assert_eq!(areas(&[]), [0.0; 0]);
        assert_eq!(areas(&[(FaceType::Plane, 0.0)]), [0.0]);
        assert_eq!(areas(&[(FaceType::Plane, f64::NAN)]), [0.0]);
    }

    #[test]
    fn single_faces_of_one_type_are_one_shape_only_if_their_forms_agree() {
        let of_corners = |corners: [[f64; 3]; 3]| {
            let (vertex_face, tri_face) = (vec![0; 3], vec![0]);
            let mesh = Mesh {
                vertices: corners.to_vec(),
                vertex_face,
                triangles: vec![[0, 1, 2]],
                tri_face,
                vertex_normal: Vec::new(),
            };
            signature(&graph(&[(FaceType::Bspline, 1.0)], 0), &mesh)
        };
        let base = of_corners([[0.0; 3], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        let larger = of_corners([[1.0, 0.0, 0.0], [1.0, 6.0, 0.0], [1.0, 0.0, 8.0]]);
        let longer = of_corners([[0.0; 3], [3.0, 0.0, 0.0], [0.0, 9.0, 0.0]]);
        assert!(larger.is_duplicate_of(&base) && !longer.is_duplicate_of(&base));
        let n_faces = FEW_FACES + 1;
        assert_eq!(
            signature(
                &graph(&vec![(FaceType::Plane, 1.0); n_faces], 0),
                &Mesh::default()
            )
            .form,
            None
        );
    }
}
