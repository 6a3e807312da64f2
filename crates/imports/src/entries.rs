//! Finds the files with labels, and assigns them to shapes.
//!
//! A folder has one file per shape. A single file may have many shapes: one per line of JSON, or one per group of CSV rows. It is
//! read once. The files of a folder are read when their shape is requested.

use crate::import::{ImportError, JoinProblem, named};
use crate::shape_key::{Found, ShapeKey, ShapeKeys};
use partprobe_formats::ZstdReader;
use partprobe_sources::{PathKind, SourceFiles};
use std::collections::BTreeSet;
use std::io::Read;
use std::sync::Arc;

/// The labels of one shape, or their file.
#[derive(Clone, Debug)]
pub(crate) struct Entry<T> {
    /// A name for messages: a path, possibly with a line number.
    pub(crate) name: String,
    pub(crate) key: ShapeKey,
    pub(crate) content: Content<T>,
}

/// The place of the labels of an entry.
#[derive(Clone, Debug)]
pub(crate) enum Content<T> {
    /// In a file, which is read when its shape is requested.
    File(String),
    /// In memory: they were in a file with those of other shapes.
    Read(T),
    /// Not available: they were in a file with those of other shapes, and cannot be read for this reason.
    Damaged(String),
}

/// All entries of an import.
#[derive(Debug)]
pub(crate) struct Entries<T> {
    files: Arc<dyn SourceFiles>,
    entries: Vec<Entry<T>>,
    keys: ShapeKeys,
}

impl<T> Entries<T> {
    /// The entries at a path. `key_of` gives the shape of a file in a folder, or `None` if the file has no labels. `read_all`
    /// gives the entries of a single file.
    ///
    /// # Errors
    /// If the path does not exist, cannot be read, or has no labels.
    pub(crate) fn at(
        path: &str,
        files: Arc<dyn SourceFiles>,
        key_of: impl Fn(&str) -> Option<ShapeKey>,
        read_all: impl Fn(&str, Vec<u8>) -> Result<Vec<Entry<T>>, String>,
    ) -> Result<Self, ImportError> {
        let unreadable = |reason: String| ImportError::Unreadable(reason);
        let entries = match files.kind(path) {
            PathKind::Missing => {
                return Err(unreadable(format!(
                    "{path} does not exist; give an existing folder or file"
                )));
            }
            PathKind::File => {
                let bytes = unpacked(path, files.as_ref())?;
                read_all(path, bytes).map_err(|reason| unreadable(format!("{path}: {reason}")))?
            }
            PathKind::Folder => {
                let listed = files
                    .list(path)
                    .map_err(|error| unreadable(error.to_string()))?;
                let Some(first) = listed.first().cloned() else {
                    return Err(unreadable(format!(
                        "the folder {path} is empty; put a label file for each shape into it"
                    )));
                };
                let n_files = listed.len();
                let root = path.trim_end_matches('/');
                let entry = |below: String| {
                    Some(Entry {
                        key: key_of(&below)?,
                        content: Content::File(format!("{root}/{below}")),
                        name: below,
                    })
                };
                let entries: Vec<Entry<T>> = listed.into_iter().filter_map(entry).collect();
                if entries.is_empty() {
                    let which = match n_files {
                        1 => {
                            format!("the file {first} in {path} does not hold labels of this type")
                        }
                        n => format!(
                            "none of the {n} files in {path} holds labels of this type, for example {first}"
                        ),
                    };
                    return Err(unreadable(format!("{which}; give another type or folder")));
                }
                entries
            }
        };
        if entries.is_empty() {
            return Err(unreadable(format!("{path} holds no labels of this type")));
        }
        Ok(Self {
            files,
            keys: ShapeKeys::new(entries.iter().map(|entry| entry.key.clone())),
            entries,
        })
    }

    /// The entries without those that are weak by their names and have the same shape name as another entry.
    pub(crate) fn without_replaced(mut self, is_weak: impl Fn(&str) -> bool) -> Self {
        let strong = self.entries.iter().filter(|entry| !is_weak(&entry.name));
        let names: BTreeSet<String> = strong
            .filter_map(|entry| entry.key.last().map(str::to_owned))
            .collect();
        let is_replaced = |entry: &Entry<T>| {
            is_weak(&entry.name) && entry.key.last().is_some_and(|name| names.contains(name))
        };
        self.entries.retain(|entry| !is_replaced(entry));
        self.keys = ShapeKeys::new(self.entries.iter().map(|entry| entry.key.clone()));
        self
    }

    /// The entries that are named after a shape.
    ///
    /// # Errors
    /// If there is no such entry, or it is not certain which one is meant.
    pub(crate) fn of_shape(&self, id: &str) -> Result<Vec<&Entry<T>>, JoinProblem> {
        let entries = |indices: Vec<usize>| indices.into_iter().map(|idx| &self.entries[idx]);
        match self.keys.of_shape(id) {
            Found::Nothing => Err(self.without_labels()),
            Found::These(indices) => Ok(entries(indices).collect()),
            Found::Ambiguous(indices) => {
                let names: Vec<String> = entries(indices).map(|entry| entry.name.clone()).collect();
                Err(JoinProblem::Refused(format!(
                    "several label files are named after it: {}; give a folder that holds one of them as `path`",
                    named(&names)
                )))
            }
        }
    }

    /// The names of the entries that are named after a shape, also if it is not certain which one is meant.
    pub(crate) fn names_of_shape(&self, id: &str) -> Vec<String> {
        let indices = match self.keys.of_shape(id) {
            Found::Nothing => Vec::new(),
            Found::These(indices) | Found::Ambiguous(indices) => indices,
        };
        let name = |idx: usize| self.entries[idx].name.clone();
        indices.into_iter().map(name).collect()
    }

    /// The reason why a shape without an entry has no labels. Its entry may be damaged, so that it names no shape.
    fn without_labels(&self) -> JoinProblem {
        let damaged = self
            .entries
            .iter()
            .filter_map(|entry| match &entry.content {
                Content::Damaged(reason) if entry.key.is_empty() => Some((&entry.name, reason)),
                _ => None,
            });
        let damaged: Vec<(&String, &String)> = damaged.collect();
        let Some((name, reason)) = damaged.first() else {
            return JoinProblem::NoLabels;
        };
        let n_more = damaged.len() - 1;
        let more = match n_more {
            0 => String::new(),
            _ => format!(", or in {n_more} more lines that cannot be read"),
        };
        JoinProblem::Unreadable(format!(
            "no labels are named after this shape; they may be in {name}, which cannot be read: {reason}{more}"
        ))
    }

    /// Whether a path leads to a file.
    pub(crate) fn is_file(&self, path: &str) -> bool {
        self.files.kind(path) == PathKind::File
    }

    /// The bytes of a file, unpacked.
    ///
    /// # Errors
    /// If it cannot be read.
    pub(crate) fn read(&self, path: &str) -> Result<Vec<u8>, JoinProblem> {
        let unreadable = |error: ImportError| JoinProblem::Unreadable(error.to_string());
        unpacked(path, self.files.as_ref()).map_err(unreadable)
    }

    /// The name of each entry.
    pub(crate) fn names(&self) -> Vec<String> {
        self.entries
            .iter()
            .map(|entry| entry.name.clone())
            .collect()
    }
}

/// The only entry.
///
/// # Errors
/// If there are several.
pub(crate) fn only_one<'a, T>(entries: &[&'a Entry<T>]) -> Result<&'a Entry<T>, JoinProblem> {
    match entries {
        [entry] => Ok(entry),
        several => {
            let names: Vec<&str> = several.iter().map(|entry| entry.name.as_str()).collect();
            Err(JoinProblem::Refused(format!(
                "several files are named after this shape: {}; give a folder that holds one of them",
                names.join(", ")
            )))
        }
    }
}

/// The file of the only entry.
///
/// # Errors
/// If there are several.
pub(crate) fn one_path(entries: &[&Entry<()>]) -> Result<String, JoinProblem> {
    let entry = only_one(entries)?;
    match &entry.content {
        Content::File(path) => Ok(path.clone()),
        Content::Read(()) | Content::Damaged(_) => Ok(entry.name.clone()),
    }
}

/// The bytes of a file. Those of a `.zst` file are unpacked.
fn unpacked(path: &str, files: &dyn SourceFiles) -> Result<Vec<u8>, ImportError> {
    let unreadable = |reason: String| ImportError::Unreadable(reason);
    let bytes = files
        .read(path)
        .map_err(|error| unreadable(error.to_string()))?;
    if !path.ends_with(".zst") {
        return Ok(bytes);
    }
    let mut plain = Vec::new();
    ZstdReader::new(bytes.as_slice())
        .read_to_end(&mut plain)
        .map_err(|error| unreadable(format!("{path}: not a whole zstd file: {error}")))?;
    Ok(plain)
}

/// The name without `.zst`.
pub(crate) fn plain_name(path: &str) -> &str {
    path.strip_suffix(".zst").unwrap_or(path)
}
