//! Lists every label source, and finds a source by its name.
//!
//! A new source is one file in the folder of this one, its `mod` line in `lib.rs`, and one line in [`SOURCES`].

use crate::controls::{CONTROLS, SourceControl};
use crate::factory::{BoxedSource, SourceContext, SourceFactory};
use crate::source::SourceError;
use crate::{
    dihedral_grow, face_rules, file_groups, given, normal_kmeans, ransac, sdf, step_flipped,
    step_jittered, step_merged, step_parts, step_split, vsa, ward,
};

/// Every source, in the order in which help texts list them.
pub const SOURCES: &[SourceFactory] = &[
    step_parts::sources::STEP_PARTS,
    step_parts::sources::STEP_PARTS_RAW,
    step_parts::sources::CANONICAL,
    face_rules::BREP_FACE,
    face_rules::PRIMITIVE,
    face_rules::PRIMITIVE_CONNECTED,
    face_rules::SMOOTH,
    file_groups::SOLID,
    file_groups::SHELL,
    file_groups::COLOR,
    file_groups::NAME,
    given::GIVEN,
    step_merged::STEP_MERGED,
    step_merged::STEP_MERGED_SHARE,
    step_split::STEP_SPLIT,
    step_flipped::STEP_FLIPPED,
    step_jittered::STEP_JITTERED,
    dihedral_grow::DIHEDRAL_GROW,
    normal_kmeans::NORMAL_KMEANS,
    vsa::VSA,
    ransac::RANSAC,
    sdf::SDF,
    ward::WARD,
    ward::WARD_MATCH,
    ward::WARD_SHARP,
    ward::WARD_COARSE,
];

/// The built-in source with this name, in an empty context.
///
/// # Errors
/// If no source has this name, or the number at its end is not possible. The message lists the possible names or numbers.
pub fn source_named(name: &str) -> Result<BoxedSource, SourceError> {
    source_among(SOURCES, name, &SourceContext::default())
}

/// The built-in source with this name, if a carrier can store its labels as a layer.
///
/// # Errors
/// As for [`source_named`], or if the labels of the source are not constant on faces.
pub fn face_source_named(name: &str) -> Result<BoxedSource, SourceError> {
    let source = source_named(name)?;
    if source.labels_faces() {
        return Ok(source);
    }
    Err(SourceError::NotOnFaces {
        source_name: name.to_owned(),
    })
}

/// The source with this name among these factories, which may be [`SOURCES`] and others.
///
/// # Errors
/// If no factory knows the name, its number is not possible, or the context lacks what the source needs.
pub fn source_among<'a>(
    factories: impl IntoIterator<Item = &'a SourceFactory>,
    name: &str,
    context: &SourceContext,
) -> Result<BoxedSource, SourceError> {
    let factories: Vec<&SourceFactory> = factories.into_iter().collect();
    let mut refusal = None;
    let mut known = Vec::new();
    for factory in &factories {
        match factory.make(name, context) {
            Some(Ok(source)) => return Ok(source),
            // A later pattern may fit better: `ward-match` begins like `ward-<K>`.
            Some(Err(error)) => refusal = refusal.or(Some(error)),
            None => known.push(factory.pattern().to_owned()),
        }
    }
    if let Some((control, other)) = SourceControl::of_name(name) {
        return source_among(factories, other, context).map(|other| control.of(other));
    }
    known.extend(CONTROLS.iter().map(SourceControl::pattern));
    Err(refusal.unwrap_or_else(|| SourceError::Unknown {
        name: name.to_owned(),
        known: known.join(", "),
    }))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::step_parts::StepParts;
    use partprobe_carrier::{Carrier, CarrierMeta, Edge, Face, FaceGraph, FaceType, Mesh, Units};

    /// A plane without a solid, color or name.
    pub(crate) fn plain_face() -> Face {
        Face::new(1, FaceType::Plane, 1.0)
    }

    /// A carrier with these faces, no edges, and one triangle per face.
    pub(crate) fn carrier_of_faces(faces: Vec<Face>) -> Carrier {
        let mesh = Mesh {
            vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            vertex_face: vec![0; 3],
            triangles: vec![[0, 1, 2]; faces.len()],
            tri_face: (0..).take(faces.len()).collect(),
            vertex_normal: Vec::new(),
        };
        carrier_of_graph(
            mesh,
            FaceGraph {
                faces,
                edges: Vec::new(),
            },
        )
    }

    /// A carrier with these faces and edges `(face, face, φ)`, partitioned at 8°.
    pub(crate) fn carrier_of(mesh: Mesh, types: &[FaceType], edges: &[(u32, u32, f64)]) -> Carrier {
        let face = |&face_type: &FaceType| Face::new(1, face_type, 1.0);
        let edges = edges
            .iter()
            .map(|&(a, b, phi)| Edge {
                faces: [a, b],
                phi,
                length: 1.0,
            })
            .collect();
        carrier_of_graph(
            mesh,
            FaceGraph {
                faces: types.iter().map(face).collect(),
                edges,
            },
        )
    }

    fn carrier_of_graph(mesh: Mesh, graph: FaceGraph) -> Carrier {
        let meta = CarrierMeta {
            id: "shape".to_owned(),
            source_sha256: String::new(),
            theta_deg: 8.0,
            tau_min: 0,
            chord_mm: 0.01,
            angle_rad: 0.3,
            diagonal_mm: mesh.diagonal(),
            units: Units::millimeters_and_radians(),
            lost: Vec::new(),
            notes: Vec::new(),
            instances: Vec::new(),
        };
        let rule = StepParts {
            theta_deg: meta.theta_deg,
            tau_min: meta.tau_min,
        };
        let layers = rule.layers(&mesh, &graph);
        Carrier::new(mesh, graph, layers, meta).unwrap()
    }

    #[test]
    fn every_source_answers_to_its_name() {
        for factory in SOURCES {
            let stem = factory.pattern().split('<').next().unwrap();
            let number = factory
                .numbers()
                .map(|numbers| numbers.end().to_string())
                .unwrap_or_default();
            let name = format!("{stem}{number}");
            assert_eq!(source_named(&name).unwrap().name(), name);
        }
    }

    #[test]
    fn a_source_that_declares_face_labels_labels_faces() {
        let carrier = carrier_of_faces(vec![plain_face(); 3]);
        let mut n_checked = 0;
        for factory in SOURCES {
            let number = factory.numbers().map(|numbers| numbers.start().to_string());
            let stem = factory.pattern().split('<').next().unwrap();
            let name = format!("{stem}{}", number.unwrap_or_default());
            // `color` and `name` refuse faces without colors and names.
            let Ok(labels) = source_named(&name).unwrap().labels(&carrier, 0) else {
                continue;
            };
            let is_layer = labels.of_faces().is_some();
            assert_eq!(is_layer, factory.labels_faces(), "{name}");
            assert_eq!(is_layer, face_source_named(&name).is_ok(), "{name}");
            n_checked += 1;
        }
        assert!(n_checked > SOURCES.len() / 2);
    }

    #[test]
    fn a_control_is_named_by_the_source_that_it_follows() {
        for name in [
            "step-merged-to-ward-20",
            "step-split-to-normal-kmeans-20",
            "capped-brep-face",
            "capped-step-split-to-ward-match",
        ] {
            assert_eq!(source_named(name).unwrap().name(), name);
        }
        check_refused("capped-nothing", "`nothing` is not a label source");
        check_refused("capped-ward-0", "put a whole number from 1 to 1000");
        check_refused("capped-", "`capped-` is not a label source");
        assert!(face_source_named("step-merged-to-ward-20").is_ok());
    }

    #[test]
    fn no_two_sources_share_a_name() {
        let names: std::collections::BTreeSet<&str> =
            SOURCES.iter().map(SourceFactory::pattern).collect();
        assert_eq!(names.len(), SOURCES.len());
    }

    #[track_caller]
    fn check_refused(name: &str, message: &str) {
        let error = source_named(name).err().unwrap().to_string();
        assert!(error.contains(message), "{error}");
    }

    #[test]
    fn other_names_are_refused_with_the_known_ones() {
        check_refused(
            "ward",
            "known ones are step-parts, step-parts-raw, canonical, brep-face, primitive, primitive-connected, ",
        );
        check_refused("", "`` is not a label source");
        for name in [
            "normal-kmeans-",
            "normal-kmeans-0",
            "normal-kmeans-1001",
            "normal-kmeans-020",
            "normal-kmeans-x",
        ] {
            check_refused(name, "put a whole number from 1 to 1000 at its end");
        }
    }
}
