//! Finds the face of each label.

use super::face_labels::{FaceLabels, RawLabel, raw_label};
use crate::import::{JoinProblem, named};
use crate::shape_key::is_solid;
use partprobe_carrier::{Carrier, Face};
use std::collections::BTreeMap;

/// The key by which a label is joined to its face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JoinBy {
    /// The key that the file names. If it names none, the only possible key.
    Auto,
    /// The `#` number of the face.
    StepId,
    /// The name of the face.
    Name,
    /// The position of the face in the file's shells.
    Order,
    /// There is no file. The name of the face is its label.
    NameIsLabel,
}

impl JoinBy {
    fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::StepId => "step-id",
            Self::Name => "name",
            Self::Order => "order",
            Self::NameIsLabel => "name-is-label",
        }
    }
}

/// The scope in which a label is unique.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scope {
    /// Equal labels of a shape are one label.
    Shape,
    /// Equal labels of one entry are one label. A shape may have several entries, for example one line per solid.
    Entry,
}

/// The label of each face, before labels are numbered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct JoinedFaces {
    pub(super) by: &'static str,
    pub(super) label_of_face: Vec<RawLabel>,
    /// Keys that no face has.
    pub(super) unused: Vec<String>,
}

type KeyedLabels = Vec<(String, RawLabel)>;

/// Joins the labels of a shape, from one or several entries, to the faces of its carrier.
///
/// # Errors
/// If the labels do not fit the faces, or fit in two ways that differ.
pub(super) fn join(
    carrier: &Carrier,
    entries: &[FaceLabels],
    by: JoinBy,
    scope: Scope,
    background: Option<&str>,
) -> Result<JoinedFaces, JoinProblem> {
    let faces = &carrier.graph().faces;
    if by == JoinBy::NameIsLabel {
        return names_as_labels(faces);
    }
    if let [FaceLabels::InOrder(labels)] = entries {
        return match by {
            JoinBy::Auto | JoinBy::Order => in_order(faces, labels),
            other => Err(refused(format!(
                "the labels have no keys, so they cannot be joined by {}; they can by order",
                other.name()
            ))),
        };
    }

    let stored_keys = keys_of_entries(entries)?;
    // A file may have labels for only some of its solids.
    let may_be_elsewhere = entries.len() > 1 || is_solid(&carrier.meta().id);
    let own: Vec<(usize, &KeyedLabels)> = keyed_entries(entries)
        .filter(|(_, keyed)| !may_be_elsewhere || name_a_face(keyed, faces))
        .collect();
    if own.is_empty() {
        return Err(JoinProblem::NoLabels);
    }
    let keyed = merged_entries(&own, scope, background);
    match (by, stored_keys) {
        (JoinBy::Auto, JoinBy::Auto) => by_any(faces, &keyed),
        (JoinBy::Auto, stored_keys) => joined_by(faces, &keyed, stored_keys)?.ensure_matched(),
        (requested, _) => joined_by(faces, &keyed, requested)?.ensure_matched(),
    }
}

fn refused(reason: String) -> JoinProblem {
    JoinProblem::Refused(reason)
}

/// The kind of keys that the entries name.
fn keys_of_entries(entries: &[FaceLabels]) -> Result<JoinBy, JoinProblem> {
    let of_entry = |entry: &FaceLabels| match entry {
        FaceLabels::InOrder(_) => JoinBy::Order,
        FaceLabels::Keyed(_) => JoinBy::Auto,
        FaceLabels::Named(_) => JoinBy::Name,
        FaceLabels::ByStepId(_) => JoinBy::StepId,
    };
    let first = entries.first().map_or(JoinBy::Auto, of_entry);
    let is_mixed = entries.iter().any(|entry| of_entry(entry) != first);
    if is_mixed || (first == JoinBy::Order && entries.len() > 1) {
        return Err(refused(format!(
            "{} files or lines have labels of this shape, and they name the faces in different ways, or not at all; give one of them",
            entries.len()
        )));
    }
    Ok(first)
}

/// The entries with keys, each with its number.
fn keyed_entries(entries: &[FaceLabels]) -> impl Iterator<Item = (usize, &KeyedLabels)> {
    entries
        .iter()
        .enumerate()
        .filter_map(|(number, entry)| match entry {
            FaceLabels::Keyed(keyed) | FaceLabels::Named(keyed) | FaceLabels::ByStepId(keyed) => {
                Some((number, keyed))
            }
            FaceLabels::InOrder(_) => None,
        })
}

/// Whether any key is the STEP id or the name of a face.
fn name_a_face(keyed: &KeyedLabels, faces: &[Face]) -> bool {
    let found = [match_step_ids(faces, keyed), match_names(faces, keyed)];
    found.iter().flatten().any(|faces| !faces.is_empty())
}

fn merged_entries(
    entries: &[(usize, &KeyedLabels)],
    scope: Scope,
    background: Option<&str>,
) -> KeyedLabels {
    let scoped = |number: usize, label: &RawLabel| match (label, scope) {
        (Some(label), Scope::Entry) if Some(label.as_str()) != background => {
            Some(format!("{number}/{label}"))
        }
        (label, _) => label.clone(),
    };
    let of_entry = |&(number, keyed): &(usize, &KeyedLabels)| -> KeyedLabels {
        keyed
            .iter()
            .map(|(key, label)| (key.clone(), scoped(number, label)))
            .collect()
    };
    entries.iter().flat_map(of_entry).collect()
}

fn names_as_labels(faces: &[Face]) -> Result<JoinedFaces, JoinProblem> {
    let label = |face: &Face| face.name.as_deref().and_then(raw_label);
    let label_of_face: Vec<RawLabel> = faces.iter().map(label).collect();
    let found = JoinedFaces {
        by: JoinBy::NameIsLabel.name(),
        label_of_face,
        unused: Vec::new(),
    };
    if found.n_matched() == 0 {
        return Err(refused("no face has a name that is a label".to_owned()));
    }
    Ok(found)
}

fn in_order(faces: &[Face], labels: &[RawLabel]) -> Result<JoinedFaces, JoinProblem> {
    if labels.len() != faces.len() {
        return Err(refused(format!(
            "there are {} labels in order, and the shape has {} faces; labels by order need a label for each face of the \
             file, which must be labeled as one shape",
            labels.len(),
            faces.len()
        )));
    }
    Ok(JoinedFaces {
        by: JoinBy::Order.name(),
        label_of_face: labels.to_vec(),
        unused: Vec::new(),
    })
}

/// Joins by the only possible kind of keys. Several kinds are allowed if they give the same labels.
fn by_any(faces: &[Face], keyed: &KeyedLabels) -> Result<JoinedFaces, JoinProblem> {
    let mut possible: Vec<JoinedFaces> = Vec::new();
    let mut problems = Vec::new();
    for by in [JoinBy::StepId, JoinBy::Name, JoinBy::Order] {
        match joined_by(faces, keyed, by) {
            Ok(joined) if joined.n_found(keyed) > 0 => possible.push(joined),
            Ok(_) => {}
            Err(problem) => problems.push(problem),
        }
    }
    // A join that finds a face for every key, and a key for every face, is preferred.
    let is_whole =
        |joined: &JoinedFaces| joined.unused.is_empty() && joined.n_found(keyed) >= faces.len();
    if possible.iter().any(is_whole) {
        possible.retain(is_whole);
    }
    possible.dedup_by(|second, first| second.label_of_face == first.label_of_face);
    match possible.as_slice() {
        [one] => Ok(one.clone()),
        [] => Err(problems
            .into_iter()
            .next()
            .unwrap_or_else(|| no_face_found(keyed))),
        several => {
            let ways: Vec<&str> = several.iter().map(|joined| joined.by).collect();
            Err(refused(format!(
                "the labels fit by {}, and these differ; choose one with the key `by`",
                ways.join(" and by ")
            )))
        }
    }
}

fn no_face_found(keyed: &KeyedLabels) -> JoinProblem {
    let keys: Vec<String> = keyed.iter().map(|(key, _)| key.clone()).collect();
    refused(format!(
        "no face is known by the keys of the labels: {}",
        named(&keys)
    ))
}

fn joined_by(faces: &[Face], keyed: &KeyedLabels, by: JoinBy) -> Result<JoinedFaces, JoinProblem> {
    if by == JoinBy::Order {
        return by_index(faces, keyed);
    }
    let found = match by {
        JoinBy::Name => match_names(faces, keyed),
        _ => match_step_ids(faces, keyed),
    };
    let mut label_of_face: Vec<Option<&RawLabel>> = vec![None; faces.len()];
    let mut unused = Vec::new();
    for ((key, label), places) in keyed.iter().zip(found) {
        if places.is_empty() {
            unused.push(key.clone());
        }
        if by == JoinBy::Name && places.len() > 1 {
            return Err(refused(format!(
                "{} faces have the name `{key}`, so that its label may belong to any of them",
                places.len()
            )));
        }
        // A face that occurs several times in the assembly has one STEP id and one label.
        for face in places {
            if label_of_face[face].is_some_and(|former| former != label) {
                return Err(refused(format!("`{key}` has two labels")));
            }
            label_of_face[face] = Some(label);
        }
    }
    Ok(JoinedFaces {
        by: by.name(),
        label_of_face: label_of_face
            .into_iter()
            .map(|label| label.cloned().flatten())
            .collect(),
        unused,
    })
}

/// Keys that number the faces from 0, each face once.
fn by_index(faces: &[Face], keyed: &KeyedLabels) -> Result<JoinedFaces, JoinProblem> {
    let mut labels: Vec<Option<RawLabel>> = vec![None; faces.len()];
    for (key, label) in keyed {
        let slot = key.parse().ok().and_then(|idx: usize| labels.get_mut(idx));
        let slot = slot.filter(|slot| slot.is_none()).ok_or_else(|| {
            refused(format!(
                "`{key}` is not one of {} faces in order, or it is there twice",
                faces.len()
            ))
        })?;
        *slot = Some(label.clone());
    }
    let labels: Vec<RawLabel> = labels.into_iter().flatten().collect();
    in_order(faces, &labels)
}

/// The faces of each key.
fn match_step_ids(faces: &[Face], keyed: &KeyedLabels) -> Vec<Vec<usize>> {
    let mut by_id: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    for (idx, face) in faces.iter().enumerate() {
        by_id.entry(face.step_id).or_default().push(idx);
    }
    let faces_of = |key: &str| key.parse().ok().and_then(|id: u64| by_id.get(&id).cloned());
    keyed
        .iter()
        .map(|(key, _)| faces_of(key).unwrap_or_default())
        .collect()
}

fn match_names(faces: &[Face], keyed: &KeyedLabels) -> Vec<Vec<usize>> {
    let mut by_name: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (idx, face) in faces.iter().enumerate() {
        if let Some(name) = &face.name {
            by_name.entry(name.trim()).or_default().push(idx);
        }
    }
    let faces_of = |key: &str| by_name.get(key.trim()).cloned();
    keyed
        .iter()
        .map(|(key, _)| faces_of(key).unwrap_or_default())
        .collect()
}

impl JoinedFaces {
    /// The number of faces with a label.
    fn n_matched(&self) -> usize {
        self.label_of_face.iter().flatten().count()
    }

    /// The number of keys that found a face, with or without a label.
    fn n_found(&self, keyed: &KeyedLabels) -> usize {
        keyed.len() - self.unused.len()
    }

    fn ensure_matched(self) -> Result<Self, JoinProblem> {
        if self.n_matched() > 0 {
            return Ok(self);
        }
        Err(match self.unused.as_slice() {
            [] => refused("no face has a label that is not negative".to_owned()),
            unused => refused(format!(
                "no face is found by {}; the labels have {}",
                self.by,
                named(unused)
            )),
        })
    }
}

/// Numbers labels from 0: first the numeric labels in their order, then the words in alphabetical order. A face without a label
/// gets a negative label.
pub(super) fn numbered(labels: &[RawLabel]) -> Vec<i32> {
    let order = |label: &&String| {
        let number: Option<u64> = label.parse().ok();
        (number.is_none(), number, (*label).clone())
    };
    let mut distinct: Vec<&String> = labels.iter().flatten().collect();
    distinct.sort_by_cached_key(order);
    distinct.dedup();
    let numbers: BTreeMap<&String, i32> = distinct.into_iter().zip(0..).collect();
    let number = |label: &RawLabel| {
        label
            .as_ref()
            .map_or(partprobe_carrier::IGNORE, |label| numbers[label])
    };
    labels.iter().map(number).collect()
}

#[cfg(test)]
mod tests;
