//! The names under which label sources are asked for.

use crate::face_rules::FaceRule;
use crate::normal_kmeans::NormalKMeans;
use crate::source::{LabelSource, SourceError};

/// A source that can be asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KnownSource {
    /// The name to ask with; `<K>` stands for a number of labels.
    pub name: String,
    /// One line that says what the labels are.
    pub description: &'static str,
}

/// Every source, in the order in which help texts list them.
#[must_use]
pub fn known_sources() -> Vec<KnownSource> {
    let rules = FaceRule::ALL.iter().map(|rule| (rule.name().to_owned(), rule.description()));
    let counted = (format!("{}<K>", NormalKMeans::PREFIX), NormalKMeans::DESCRIPTION);
    rules.chain([counted]).map(|(name, description)| KnownSource { name, description }).collect()
}

/// The source with this name.
///
/// # Errors
/// If no source has this name, or the number at its end is no number of labels; the message lists the known ones.
pub fn source_named(name: &str) -> Result<Box<dyn LabelSource + Send + Sync>, SourceError> {
    if let Some(rule) = FaceRule::ALL.into_iter().find(|rule| rule.name() == name) {
        return Ok(Box::new(rule));
    }
    if let Some(count) = name.strip_prefix(NormalKMeans::PREFIX) {
        // `020` or `+20` would stand beside `20` in scores as another source.
        let count = count.parse().ok().filter(|parsed: &u32| parsed.to_string() == count);
        let source = count.and_then(NormalKMeans::new);
        let source = source.ok_or_else(|| SourceError::LabelCount { name: name.to_owned() })?;
        return Ok(Box::new(source));
    }
    let known: Vec<String> = known_sources().into_iter().map(|source| source.name).collect();
    Err(SourceError::Unknown { name: name.to_owned(), known: known.join(", ") })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use carrier::{Carrier, CarrierMeta, Edge, Face, FaceGraph, FaceType, Mesh, Units};

    /// A carrier with these faces and edges `(face, face, φ)`, partitioned at 8°.
    pub(crate) fn carrier_of(mesh: Mesh, types: &[FaceType], edges: &[(u32, u32, f64)]) -> Carrier {
        let face = |&face_type: &FaceType| Face {
            step_id: 1,
            face_type,
            canonical_type: face_type,
            area: 1.0,
            shell: 0,
            solid: None,
            instance: 0,
            name: None,
            color: None,
            layer: None,
        };
        let edges = edges.iter().map(|&(a, b, phi)| Edge { faces: [a, b], phi, length: 1.0 }).collect();
        let graph = FaceGraph { faces: types.iter().map(face).collect(), edges };
        let units = Units { length: "mm".to_owned(), mm_per_unit: 1.0, angle: "radian".to_owned(), rad_per_unit: 1.0 };
        let meta = CarrierMeta {
            id: "shape".to_owned(),
            source_sha256: String::new(),
            theta_deg: 8.0,
            tau_min: 0,
            chord_mm: 0.01,
            angle_rad: 0.3,
            diagonal_mm: mesh.diagonal(),
            units,
            lost: Vec::new(),
            notes: Vec::new(),
            instances: Vec::new(),
        };
        Carrier::new(mesh, graph, meta).unwrap()
    }

    #[test]
    fn every_known_source_answers_to_its_name() {
        for known in known_sources() {
            let name = known.name.replace("<K>", "20");
            assert_eq!(source_named(&name).unwrap().name(), name);
        }
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
            "known ones are step-parts, canonical, brep-face, primitive, primitive-connected, normal-kmeans-<K>",
        );
        check_refused("", "`` is no label source");
        for name in ["normal-kmeans-", "normal-kmeans-0", "normal-kmeans-1001", "normal-kmeans-020", "normal-kmeans-x"]
        {
            check_refused(name, "put a number from 1 to 1000 at its end");
        }
    }
}
