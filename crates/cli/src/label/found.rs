//! Defines the paths that are found from the arguments, and their use.

use super::walk::Problem;
use partprobe_formats::ArchiveKind;
use partprobe_imports::is_given_name;
use std::path::PathBuf;

/// A path that is found from one of the arguments.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// The index of the argument.
    pub(super) argument: usize,
    pub(super) path: PathBuf,
    /// The path below the argument. It is empty for an argument that is a file.
    pub(super) below: PathBuf,
    pub(super) what: FoundItem,
    /// The number of files, if the line counts several.
    pub(super) n_files: Option<u64>,
}

/// The ending of rows of numbers, but also of any other text. Such a file is seldom a cloud.
const TEXT: &str = ".txt";

impl Found {
    /// Whether it is a STEP file or an archive. A name of a mesh or a cloud is neither.
    pub(super) fn is_of_step(&self) -> bool {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        match self.what {
            FoundItem::File(Some(_)) => true,
            FoundItem::File(None) => !is_given_name(&name),
            FoundItem::Unread(_) => false,
        }
    }

    /// Adds the reason why meshes and clouds are not read, if the line counts files with one of their endings. It is called if
    /// the arguments contain a STEP file or an archive.
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

/// The use of a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum FoundItem {
    /// It is read, as an archive, as STEP, or as a mesh or a cloud.
    File(Option<ArchiveKind>),
    /// It becomes a line of the index.
    Unread(Problem),
}
