//! Walks a folder: files to label, what cannot be read, and how many files have other endings.
//!
//! Nothing is opened but folders: a pipe would be waited for without end.

use super::foreign_file::foreign_by_name;
use super::other_endings::OtherEndings;
use super::path_text::name_text;
use super::step_text::special_kind;
use partprobe_dataset::Status;
use partprobe_formats::{ArchiveKind, is_step_xml_name, step_stem};
use std::fs::{self, DirEntry};
use std::io;
use std::path::{Path, PathBuf};

/// What a walk comes to.
#[derive(Debug, Default)]
pub(super) struct FolderContent {
    /// STEP files and archives by their names, and what becomes a line of the index without being read.
    pub(super) found: Vec<WalkedPath>,
    /// The other files.
    pub(super) other_endings: OtherEndings,
}

/// A path below the folder.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct WalkedPath {
    pub(super) path: PathBuf,
    /// Why it is not read, if it is not.
    pub(super) problem: Option<Problem>,
}

/// Why a path is not read: the outcome and the reason of its line in the index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Problem {
    pub(super) status: Status,
    pub(super) reason: String,
}

impl Problem {
    /// The path is not what `label` reads.
    pub(super) fn skipped(reason: impl Into<String>) -> Self {
        Self {
            status: Status::Skipped,
            reason: reason.into(),
        }
    }

    /// The path is meant, and cannot be read.
    pub(super) fn failed(reason: impl Into<String>) -> Self {
        Self {
            status: Status::Failed,
            reason: reason.into(),
        }
    }
}

/// Walks a folder, sorted by path; links to folders are not followed, as they may lead in circles.
pub(super) fn walk(root: &Path) -> FolderContent {
    let mut walked = FolderContent::default();
    let mut open = vec![root.to_owned()];
    while let Some(folder) = open.pop() {
        let entries = match fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(error) => {
                let problem = Problem::failed(format!("the folder cannot be read: {error}"));
                walked.found.push(WalkedPath {
                    path: folder,
                    problem: Some(problem),
                });
                continue;
            }
        };
        for entry in entries {
            match entry {
                Ok(entry) if entry.file_type().is_ok_and(|kind| kind.is_dir()) => {
                    open.push(entry.path())
                }
                Ok(entry) => walked.add(root, &entry),
                Err(error) => {
                    let problem =
                        Problem::failed(format!("the folder cannot be read to its end: {error}"));
                    walked.found.push(WalkedPath {
                        path: folder.clone(),
                        problem: Some(problem),
                    });
                    break;
                }
            }
        }
    }
    walked.found.sort_by(|a, b| a.path.cmp(&b.path));
    walked
}

impl FolderContent {
    /// Adds what is not a folder.
    fn add(&mut self, root: &Path, entry: &DirEntry) {
        let path = entry.path();
        let name = name_text(&entry.file_name());
        let problem = match entry.file_type() {
            Ok(kind) if kind.is_file() => None,
            Ok(kind) if kind.is_symlink() => link_problem(&path, is_wanted(&name)),
            Ok(_) => entry
                .metadata()
                .ok()
                .and_then(|metadata| special_kind(&metadata))
                .map(not_a_file),
            Err(error) => Some(Problem::failed(format!("it cannot be looked at: {error}"))),
        };
        let xml = || {
            is_step_xml_name(&name)
                .then(|| foreign_by_name(&name).map(Problem::skipped))
                .flatten()
        };
        let problem = problem.or_else(xml);
        if problem.is_some() || is_wanted(&name) {
            self.found.push(WalkedPath { path, problem });
        } else {
            let below = path.strip_prefix(root).unwrap_or(&path);
            let below: Vec<String> = below.iter().map(name_text).collect();
            self.other_endings.add(&below.join("/"));
        }
    }
}

/// Whether the name says STEP or archive.
pub(super) fn is_wanted(name: &str) -> bool {
    step_stem(name).is_some() || ArchiveKind::of_name(name).is_some()
}

fn not_a_file(kind: &str) -> Problem {
    Problem::skipped(format!("it is {kind}, not a file"))
}

/// Why what a link leads to is not read; `None` if it is a file.
fn link_problem(path: &Path, is_wanted: bool) -> Option<Problem> {
    let cannot = |reason: String| {
        if is_wanted {
            Problem::failed(reason)
        } else {
            Problem::skipped(reason)
        }
    };
    match fs::metadata(path) {
        Ok(target) if target.is_dir() => Some(Problem::skipped(
            "links to folders are not followed; give that folder to `label` itself",
        )),
        Ok(target) => {
            special_kind(&target).map(|kind| Problem::skipped(format!("the link leads to {kind}")))
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Some(cannot(
            "the link leads to a file that does not exist".to_owned(),
        )),
        Err(error) => Some(cannot(format!("the link cannot be followed: {error}"))),
    }
}
