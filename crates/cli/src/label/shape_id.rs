//! Makes the names and ids of files, from the argument that names them and the path below it.
//!
//! Names and ids are as short as possible. If several sources would have the same one, all of these get longer ones, and no
//! others. So the result depends neither on the order of the sources nor on the division of a batch.

use super::found::{Found, FoundItem};
use super::path_text::name_text;
use crate::given_path::entry_of;
use crate::usage::UsageError;
use anyhow::{Result, bail};
use partprobe_carrier::hexadecimal;
use partprobe_formats::{ArchiveKind, step_stem};
use partprobe_imports::given_stem;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// File systems allow names of 255 bytes; this leaves room for `__s<n>.npz` and the name of an unfinished file.
const MAX_ID_BYTES: usize = 180;
/// The end of the id of a line whose source is not read.
pub(super) const SKIPPED_MARK: &str = "#unread";

/// A path of the command line, with its names.
#[derive(Clone, Debug)]
pub(super) struct Argument {
    /// Its last component, for a list without the ending.
    name: String,
    /// Every written component.
    written: Vec<String>,
}

impl Argument {
    pub(super) fn new(path: &Path) -> Self {
        Self {
            name: argument_name(path),
            written: written_components(path),
        }
    }

    pub(super) fn list(path: &Path) -> Self {
        let argument = Self::new(path);
        let name = argument
            .name
            .rsplit_once('.')
            .map_or(argument.name.as_str(), |(stem, _)| stem)
            .to_owned();
        Self {
            name: if name == "-" { "list".to_owned() } else { name },
            ..argument
        }
    }
}

/// The last component of an argument, even if it is written as `.` or `..`.
pub(super) fn argument_name(path: &Path) -> String {
    let absolute = || {
        fs::canonicalize(path)
            .ok()
            .and_then(|path| Some(name_text(path.file_name()?)))
    };
    path.file_name()
        .map(name_text)
        .or_else(absolute)
        .unwrap_or_else(|| "root".to_owned())
}

/// The names of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct InputName {
    /// The name in the index.
    pub(super) source: String,
    /// The id in the data set.
    pub(super) id: String,
}

/// Names all found paths, in their order.
///
/// # Errors
/// If two paths cannot be distinguished by their written names.
pub(super) fn named<'a>(
    arguments: &[Argument],
    found: &'a [Found],
) -> Result<Vec<(&'a Found, InputName)>> {
    let components = source_components(arguments, found)?;
    let ids = distinct_ids(&components, found);
    let named = components.iter().zip(ids).map(|(parts, id)| InputName {
        source: parts.join("/"),
        id,
    });
    Ok(found.iter().zip(named).collect())
}

/// Removes repeated paths, and returns the path that is kept, once for each removed one.
///
/// Two paths are equal if they name the same entry of the same folder, even if they are written differently. A link is a separate
/// entry. The path that was found deepest below its argument is kept, and of several such paths the shortest one, so the order of
/// the arguments does not matter.
pub(super) fn remove_repeated_paths(
    arguments: &[Argument],
    found: &mut Vec<Found>,
) -> Vec<PathBuf> {
    let mut folders = BTreeMap::new();
    let mut groups: BTreeMap<PathBuf, Vec<usize>> = BTreeMap::new();
    for (position, item) in found.iter().enumerate() {
        groups
            .entry(entry_of(&item.path, &mut folders))
            .or_default()
            .push(position);
    }

    let depth = |position: usize| depth_of(&found[position].below);
    let length = |position: usize| found[position].below.components().count();
    let mut repeated = Vec::new();
    let mut is_kept = vec![true; found.len()];
    for positions in groups.values().filter(|positions| positions.len() > 1) {
        let name = |position: usize| written_name(arguments, &found[position]);
        let order = |&a: &usize, &b: &usize| {
            (depth(b), length(a), name(a)).cmp(&(depth(a), length(b), name(b)))
        };
        let Some(kept) = positions.iter().copied().min_by(order) else {
            continue;
        };
        for &position in positions.iter().filter(|&&position| position != kept) {
            is_kept[position] = false;
            repeated.push((position, found[kept].path.clone()));
        }
    }

    let mut kept = is_kept.into_iter();
    found.retain(|_| kept.next().unwrap_or(true));
    repeated.sort_unstable();
    repeated.into_iter().map(|(_, path)| path).collect()
}

/// The number of folders in a path. `..` goes up again.
fn depth_of(path: &Path) -> isize {
    path.components()
        .map(|component| match component {
            Component::Normal(_) => 1,
            Component::ParentDir => -1,
            _ => 0,
        })
        .sum()
}

/// The long name of a source: every written component.
fn written_name(arguments: &[Argument], item: &Found) -> Vec<String> {
    arguments[item.argument]
        .written
        .iter()
        .cloned()
        .chain(written_components(&item.below))
        .collect()
}

/// The components of each source's name. They are long if the short ones are not distinct.
fn source_components(arguments: &[Argument], found: &[Found]) -> Result<Vec<Vec<String>>> {
    let short = |item: &Found| {
        let plain = |component| match component {
            Component::Normal(name) => Some(name_text(name)),
            _ => None,
        };
        let argument = std::iter::once(arguments[item.argument].name.clone());
        argument
            .chain(item.below.components().filter_map(plain))
            .collect::<Vec<_>>()
    };
    let mut components: Vec<Vec<String>> = found.iter().map(short).collect();
    for item in shared(components.iter().map(|parts| parts.join("/"))) {
        components[item] = written_name(arguments, &found[item]);
    }
    if let [first, second, ..] = shared(components.iter().map(|parts| parts.join("/"))).as_slice() {
        let (first, second) = (found[*first].path.display(), found[*second].path.display());
        bail!(UsageError(format!(
            "{first} and {second} would have one name; label them into two data sets"
        )));
    }
    Ok(components)
}

/// Every written component, except `.` and the root.
fn written_components(path: &Path) -> Vec<String> {
    let text = |component| match component {
        Component::Normal(name) => Some(name_text(name)),
        Component::ParentDir => Some("..".to_owned()),
        Component::Prefix(prefix) => Some(name_text(prefix.as_os_str())),
        Component::CurDir | Component::RootDir => None,
    };
    path.components().filter_map(text).collect()
}

/// The positions of all texts that occur more than once, in the order of the texts' first positions.
fn shared(texts: impl Iterator<Item = String>) -> Vec<usize> {
    let mut positions: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (position, text) in texts.enumerate() {
        positions.entry(text).or_default().push(position);
    }
    let mut shared: Vec<Vec<usize>> = positions
        .into_values()
        .filter(|positions| positions.len() > 1)
        .collect();
    shared.sort();
    shared.concat()
}

/// The part of a source's name that is in its id.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum IdForm {
    /// All except the ending.
    Stem,
    /// All of it.
    Whole,
    /// All of it and a hash, because different folders and names may give the same text.
    Hashed,
}

/// The id of a source by the components of its name.
pub(super) fn id_of(components: &[String], form: IdForm) -> String {
    let joined = components.join("__");
    match form {
        IdForm::Stem => shortened(stem(&joined)),
        IdForm::Whole => shortened(&joined),
        IdForm::Hashed => shortened(&format!("{joined}--{}", hash_of(&components.join("/")))),
    }
}

/// The shortest distinct ids, separately for files and for archives, because an archive's id is only the beginning of its files'
/// ids.
fn distinct_ids(components: &[Vec<String>], found: &[Found]) -> Vec<String> {
    let space = |position: usize| match found[position].what {
        FoundItem::File(archive) => u8::from(archive.is_some()),
        FoundItem::Unread(_) => 2,
    };
    let first = |position| {
        if space(position) == 2 {
            IdForm::Whole
        } else {
            IdForm::Stem
        }
    };
    let forms = distinct_forms(components, (0..found.len()).map(first).collect(), space);
    components
        .iter()
        .zip(forms)
        .map(|(parts, form)| id_of(parts, form))
        .collect()
}

/// The forms of ids for which all ids of one space are distinct. Equal ids get longer together.
pub(super) fn distinct_forms(
    components: &[Vec<String>],
    mut forms: Vec<IdForm>,
    space: impl Fn(usize) -> u8,
) -> Vec<IdForm> {
    loop {
        let ids = components
            .iter()
            .zip(&forms)
            .map(|(parts, &form)| id_of(parts, form));
        let in_space = ids
            .enumerate()
            .map(|(position, id)| format!("{} {id}", space(position)));
        let mut equal = shared(in_space);
        equal.retain(|&position| forms[position] < IdForm::Hashed);
        if equal.is_empty() {
            return forms;
        }
        for position in equal {
            forms[position] = if forms[position] == IdForm::Stem {
                IdForm::Whole
            } else {
                IdForm::Hashed
            };
        }
    }
}

/// The id of an argument that is a file.
pub(super) fn id_of_argument(argument: &str) -> String {
    shortened(stem(argument))
}

/// The name without the ending of a STEP file, an archive, a mesh or a cloud.
fn stem(name: &str) -> &str {
    ArchiveKind::of_name(name)
        .map(|(_, stem)| stem)
        .or_else(|| step_stem(name))
        .or_else(|| given_stem(name))
        .unwrap_or(name)
}

/// The id itself, or its beginning and a hash of the whole id if it is too long for file systems.
fn shortened(id: &str) -> String {
    if id.len() <= MAX_ID_BYTES {
        return id.to_owned();
    }
    let hash = hash_of(id);
    let end = (0..=MAX_ID_BYTES - 18)
        .rev()
        .find(|&end| id.is_char_boundary(end))
        .unwrap_or(0);
    format!("{}--{hash}", &id[..end])
}

fn hash_of(text: &str) -> String {
    hexadecimal(&Sha256::digest(text)[..8])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_ids_are_cut_and_stay_different() {
        let (a, b) = ("ä".repeat(200), format!("{}x", "ä".repeat(200)));
        assert!(shortened(&a).len() <= MAX_ID_BYTES && shortened(&a) != shortened(&b));
        assert_eq!(shortened("short"), "short");
    }

    #[test]
    fn endings_are_removed() {
        for (name, id) in [
            ("a.step", "a"),
            ("a.tar.gz", "a"),
            ("a.7Z", "a"),
            ("a.stpZ", "a"),
            ("a.step.gz", "a"),
            ("a.obj", "a"),
            ("a.doc", "a.doc"),
            (".stp", ".stp"),
        ] {
            assert_eq!(id_of_argument(name), id);
        }
    }
}
