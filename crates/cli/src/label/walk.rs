//! Walks a folder: finds files to label and paths that cannot be read, and counts files with other endings.
//!
//! Only folders are opened and, for meshes and clouds, plain text files. Opening a pipe could wait forever.

use super::foreign_file::foreign_by_name;
use super::input_bytes::is_given;
use super::other_endings::OtherEndings;
use super::path_text::name_text;
use super::step_text::special_kind;
use partprobe_dataset::Status;
use partprobe_formats::{ArchiveKind, is_step_xml_name, step_stem};
use partprobe_imports::{is_given_name, label_names_of};
use std::collections::BTreeSet;
use std::fs::{self, DirEntry, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The kind of files that a walk finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WalkTarget {
    /// STEP files and archives of them.
    Step,
    /// Meshes and point clouds.
    Given,
}

impl WalkTarget {
    fn accepts(self, path: &Path, name: &str) -> bool {
        match self {
            Self::Step => is_step_or_archive(name),
            Self::Given => is_given_name(name) && is_given(name, &start_of(path)),
        }
    }
}

/// The beginning of a plain file. It is empty if the file cannot be read.
fn start_of(path: &Path) -> Vec<u8> {
    let mut start = Vec::new();
    if path.is_file()
        && let Ok(file) = File::open(path)
    {
        // A file that cannot be read is reported by the worker that reads it.
        let _ = file.take(LOOK_BYTES).read_to_end(&mut start);
    }
    start
}

/// The number of bytes of a text that are checked.
const LOOK_BYTES: u64 = 4096;

/// The result of a walk.
#[derive(Debug, Default)]
pub(super) struct FolderContent {
    /// The wanted files, and paths that become lines of the index without being read.
    pub(super) found: Vec<WalkedPath>,
    /// The other files.
    pub(super) other_endings: OtherEndings,
}

/// A path below the folder.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct WalkedPath {
    pub(super) path: PathBuf,
    /// The reason why it is not read, if it is not.
    pub(super) problem: Option<Problem>,
}

/// A problem of a path that is not read: the outcome and the reason of its line in the index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Problem {
    pub(super) status: Status,
    pub(super) reason: String,
}

impl Problem {
    /// The path is not of a kind that `label` reads.
    pub(super) fn skipped(reason: impl Into<String>) -> Self {
        Self {
            status: Status::Skipped,
            reason: reason.into(),
        }
    }

    /// The path should be read, but cannot be.
    pub(super) fn failed(reason: impl Into<String>) -> Self {
        Self {
            status: Status::Failed,
            reason: reason.into(),
        }
    }
}

/// Walks a folder, sorted by path. Links to folders are not followed, because they may form cycles.
pub(super) fn walk(root: &Path, wanted: WalkTarget) -> FolderContent {
    let mut walked = FolderContent::default();
    let mut others = Vec::new();
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
                Ok(entry) => others.extend(walked.add(wanted, &entry)),
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
    walked.count_others(root, others);
    walked
}

impl FolderContent {
    /// Counts the files that are not wanted, except for the labels of meshes and clouds.
    fn count_others(&mut self, root: &Path, others: Vec<PathBuf>) {
        let mut labels = BTreeSet::new();
        for found in self.found.iter().filter(|found| found.problem.is_none()) {
            let name = name_text(found.path.file_name().unwrap_or_default());
            let names = label_names_of(&name).into_iter();
            let mut paths = names.map(|name| found.path.with_file_name(name));
            labels.extend(paths.find(|path| path.is_file()));
        }
        for path in others.iter().filter(|path| !labels.contains(*path)) {
            let below = path.strip_prefix(root).unwrap_or(path);
            let below: Vec<String> = below.iter().map(name_text).collect();
            self.other_endings.add(&below.join("/"));
        }
    }

    /// Adds an entry that is not a folder, or returns the path of a file that is not wanted.
    fn add(&mut self, wanted: WalkTarget, entry: &DirEntry) -> Option<PathBuf> {
        let path = entry.path();
        let name = name_text(&entry.file_name());
        let problem = match entry.file_type() {
            Ok(kind) if kind.is_file() => None,
            Ok(kind) if kind.is_symlink() => link_problem(&path, wanted.accepts(&path, &name)),
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
        if problem.is_some() || wanted.accepts(&path, &name) {
            self.found.push(WalkedPath { path, problem });
            return None;
        }
        Some(path)
    }
}

/// Whether the name has an ending of STEP or of an archive.
pub(super) fn is_step_or_archive(name: &str) -> bool {
    step_stem(name).is_some() || ArchiveKind::of_name(name).is_some()
}

fn not_a_file(kind: &str) -> Problem {
    Problem::skipped(format!("it is {kind}, not a file"))
}

/// The reason why the target of a link is not read. Returns `None` if it is a file.
fn link_problem(path: &Path, is_target: bool) -> Option<Problem> {
    let cannot = |reason: String| {
        if is_target {
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
