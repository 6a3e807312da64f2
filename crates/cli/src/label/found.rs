//! Defines what a path that the arguments lead to is, and what is done with it.

use super::walk::Problem;
use partprobe_formats::ArchiveKind;
use partprobe_imports::is_given_name;
use std::path::PathBuf;

/// A path that one of the arguments leads to.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Which argument.
    pub(super) argument: usize,
    pub(super) path: PathBuf,
    /// The path below the argument; empty for an argument that is a file itself.
    pub(super) below: PathBuf,
    pub(super) what: FoundItem,
    /// How many files the line stands for, where it counts some.
    pub(super) n_files: Option<u64>,
}

/// The ending of rows of numbers, and of any other text: such a file is seldom a cloud.
const TEXT: &str = ".txt";

impl Found {
    /// Whether it is a STEP file or an archive. A name that says mesh or cloud is neither.
    pub(super) fn is_of_step(&self) -> bool {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        match self.what {
            FoundItem::File(Some(_)) => true,
            FoundItem::File(None) => !is_given_name(&name),
            FoundItem::Unread(_) => false,
        }
    }

    /// Adds the reason why meshes and clouds are not read, where the line counts files with an ending of theirs. The call
    /// leads to a STEP file or an archive.
    pub(super) fn add_next_to_step(&mut self) {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        if let FoundItem::Unread(problem) = &mut self.what
            && self.n_files.is_some()
            && is_given_name(&name)
            && !name.ends_with(TEXT)
        {
            problem.reason.push_str(
                ": meshes and point clouds are not read next to STEP files; label them in a call of their own",
            );
        }
    }
}

/// What is done with a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum FoundItem {
    /// It is read, as an archive, as STEP, or as a mesh or a cloud.
    File(Option<ArchiveKind>),
    /// It becomes a line of the index.
    Unread(Problem),
}
