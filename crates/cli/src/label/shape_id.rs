//! The ids of files, by the argument that names them and the path below it.

use super::source_files::{SourceFile, is_step_extension};
use formats::ArchiveKind;
use sha2::{Digest, Sha256};
use std::path::{Component, Path};

/// File systems allow names of 255 bytes; this leaves room for `__s<n>.npz` and the name of an unfinished file.
const MAX_ID_BYTES: usize = 180;

/// A file below an argument: its id, and its name in the index.
pub(super) fn named(argument: &str, relative: &Path, file: &Path) -> SourceFile {
    let components: Vec<String> = relative
        .components()
        .filter_map(|component| match component {
            Component::Normal(name) => Some(name.to_string_lossy().into_owned()),
            _ => None,
        })
        .collect();
    let id = id_of(argument, &components);
    SourceFile { path: file.to_owned(), id, name: format!("{argument}/{}", components.join("/")) }
}

/// `<argument>__<components>`, without the ending.
pub(super) fn id_of(argument: &str, components: &[String]) -> String {
    shortened(stem(&format!("{argument}__{}", components.join("__"))))
}

/// The id of an argument that is a file itself.
pub(super) fn id_of_argument(argument: &str) -> String {
    shortened(stem(argument))
}

/// The name without the ending of a STEP file or an archive.
fn stem(name: &str) -> &str {
    if let Some((_, stem)) = ArchiveKind::of_name(name) {
        return stem;
    }
    match name.rsplit_once('.') {
        Some((stem, extension)) if !stem.is_empty() && is_step_extension(extension) => stem,
        _ => name,
    }
}

/// The id itself, or its beginning and a hash of the whole where file systems would refuse it.
fn shortened(id: &str) -> String {
    if id.len() <= MAX_ID_BYTES {
        return id.to_owned();
    }
    let hash: String = Sha256::digest(id).iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    let end = (0..=MAX_ID_BYTES - 18).rev().find(|&end| id.is_char_boundary(end)).unwrap_or(0);
    format!("{}--{hash}", &id[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_ids_are_cut_and_stay_apart() {
        let (a, b) = ("ä".repeat(200), format!("{}x", "ä".repeat(200)));
        assert!(shortened(&a).len() <= MAX_ID_BYTES && shortened(&a) != shortened(&b));
        assert_eq!(shortened("short"), "short");
    }

    #[test]
    fn endings_go() {
        for (name, id) in [("a.step", "a"), ("a.tar.gz", "a"), ("a.7Z", "a"), ("a.txt", "a.txt"), (".stp", ".stp")] {
            assert_eq!(id_of_argument(name), id);
        }
    }
}
