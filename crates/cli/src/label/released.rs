//! Restricts a batch to the labels of a package: it chooses the files and their ids, and checks that the labels are the same.

use super::protocol::EmittedFile;
use crate::config::Emit;
use crate::label_package::{LabelPackage, PackagedShape};
use anyhow::Result;
use partprobe_dataset::{IndexEntry, Status};
use partprobe_formats::carrier_from_npz;
use partprobe_release::{first_difference, labels_sha256};
use partprobe_tables::ShapeLabels;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, PoisonError};

/// A shape in the answer of a worker: its line, and the files that are written for it.
pub(super) type EmittedShape = (IndexEntry, Vec<EmittedFile>);

/// The released labels that the files of a batch must have.
#[derive(Debug)]
pub(crate) struct ReleasedLabels {
    package: LabelPackage,
    /// The shapes by id.
    shapes: BTreeMap<String, PackagedShape>,
    /// The files of each STEP text, which are used one by one.
    files: Mutex<BTreeMap<String, Vec<ReleasedFile>>>,
}

/// A file of the package.
#[derive(Clone, Debug, PartialEq, Eq)]
struct ReleasedFile {
    id: String,
    /// Its name without folders.
    name: Option<String>,
    is_taken: bool,
}

/// The reason why a file is not labeled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NotReleased {
    /// The package has no file with this hash.
    Unknown,
    /// All files of the package with this hash were already given.
    Repeated,
}

impl ReleasedLabels {
    /// The labels of a package.
    ///
    /// # Errors
    /// If a file of the package is missing, damaged or changed.
    pub(crate) fn open(package: LabelPackage) -> Result<Self> {
        let shapes = package.shapes()?;
        let mut files: BTreeMap<String, Vec<ReleasedFile>> = BTreeMap::new();
        let mut known = BTreeSet::new();
        for PackagedShape { shape, .. } in &shapes {
            if known.insert(&shape.file_id) {
                let of_text = files.entry(shape.source_sha256.clone()).or_default();
                of_text.push(ReleasedFile {
                    id: shape.file_id.clone(),
                    name: shape.source.clone(),
                    is_taken: false,
                });
            }
        }
        let by_id = |shape: &PackagedShape| (shape.shape.id.clone(), shape.clone());
        Ok(Self {
            shapes: shapes.iter().map(by_id).collect(),
            files: Mutex::new(files),
            package,
        })
    }

    /// The package.
    #[must_use]
    pub(crate) fn package(&self) -> &LabelPackage {
        &self.package
    }

    /// A shape of the package by its id.
    #[must_use]
    pub(crate) fn shape(&self, id: &str) -> Option<&PackagedShape> {
        self.shapes.get(id)
    }

    /// All shapes of the package, in the order of their ids.
    pub(crate) fn shapes(&self) -> impl Iterator<Item = &PackagedShape> {
        self.shapes.values()
    }

    /// The id in the package of a file with this hash. The id is marked as taken. Of several files with the same text, the one
    /// with this name comes first.
    pub(super) fn take(&self, sha256: &str, source: &str) -> Result<String, NotReleased> {
        let base_name = source.rsplit('/').next();
        let mut files = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        let files = files.get_mut(sha256).ok_or(NotReleased::Unknown)?;
        let free = |file: &ReleasedFile| !file.is_taken;
        let position = files
            .iter()
            .position(|file| free(file) && file.name.as_deref() == base_name)
            .or_else(|| files.iter().position(free))
            .ok_or(NotReleased::Repeated)?;
        files[position].is_taken = true;
        Ok(files[position].id.clone())
    }

    /// The shapes of a file. The files of shapes without the labels of the package are removed.
    ///
    /// # Errors
    /// If the package cannot be read.
    pub(super) fn checked(
        &self,
        file_id: &str,
        source: &str,
        shapes: Vec<EmittedShape>,
    ) -> Result<Vec<EmittedShape>> {
        let mut checked = Vec::with_capacity(shapes.len());
        for (entry, emitted) in shapes {
            checked.push(match self.difference(&entry, &emitted)? {
                Some(reason) => (differing(entry, reason), Vec::new()),
                None => (entry, emitted),
            });
        }
        let given: BTreeSet<String> = checked.iter().map(|(entry, _)| entry.id.clone()).collect();
        let of_file = self.shapes.range(file_id.to_owned()..);
        let missing = of_file
            .take_while(|(id, _)| id.starts_with(file_id))
            .map(|(_, shape)| &shape.shape)
            .filter(|shape| shape.file_id == file_id && shape.labels_sha256.is_some())
            .filter(|shape| !given.contains(&shape.id));
        for shape in missing {
            let reason =
                "the package has labels of it, and labeling gives no such shape".to_owned();
            let mut entry = IndexEntry::without_carrier(&shape.id, source, Status::Differs, reason);
            entry.sha256 = Some(shape.source_sha256.clone());
            checked.push((entry, Vec::new()));
        }
        Ok(checked)
    }

    /// The reason why a labeled shape does not have the labels of the package. Returns `None` if no difference is found.
    fn difference(&self, entry: &IndexEntry, emitted: &[EmittedFile]) -> Result<Option<String>> {
        let Some(carrier) = emitted.iter().find(|file| file.emit == Emit::Carrier) else {
            return Ok(None);
        };
        let Some(released) = self.shapes.get(&entry.id) else {
            return Ok(Some("the package has no such shape".to_owned()));
        };
        if entry.sha256.as_ref() != Some(&released.shape.source_sha256) {
            return Ok(Some("the file was changed while it was read".to_owned()));
        }
        let Some(expected) = &released.shape.labels_sha256 else {
            return Ok(Some(format!(
                "the package has no labels of it: it was {} when it was released",
                released.shape.status
            )));
        };
        let now = ShapeLabels::of(&carrier_from_npz(&carrier.bytes)?);
        if labels_sha256(&now) == *expected {
            return Ok(None);
        }
        let labels = self.package.labels(released)?.unwrap_or_default();
        let reason = first_difference(&labels, &now).map_or_else(
            || "the labels in the package do not have the hash that it names".to_owned(),
            |difference| difference.to_string(),
        );
        Ok(Some(reason))
    }
}

/// The line of a shape whose labels differ. It keeps its hash and has no carrier.
fn differing(entry: IndexEntry, reason: String) -> IndexEntry {
    IndexEntry {
        sha256: entry.sha256,
        solid_step_id: entry.solid_step_id,
        ..IndexEntry::without_carrier(&entry.id, &entry.source, Status::Differs, reason)
    }
}
