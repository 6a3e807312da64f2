//! From the paths of the command line to STEP files and archives of them, each with the id that it gets.

use super::shape_id::{id_of_argument, named};
use crate::usage::UsageError;
use anyhow::{Context, Result};
use formats::ArchiveKind;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// File names that count as STEP, in any case.
const EXTENSIONS: [&str; 3] = ["step", "stp", "p21"];
/// What a STEP file begins with.
const STEP_HEADER: &[u8] = b"ISO-10303-21";
/// How much of a file is looked at to tell STEP from a list.
const LOOK_BYTES: u64 = 4096;

/// A file to label, or an archive of such files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceFile {
    /// Where it is.
    pub path: PathBuf,
    /// `<name of the argument>__<relative path>`, `/` as `__`, without extension.
    pub id: String,
    /// `<name of the argument>/<relative path>`.
    pub name: String,
}

impl SourceFile {
    /// Which archive the file is, by its name; none where it is a STEP file.
    #[must_use]
    pub fn archive_kind(&self) -> Option<ArchiveKind> {
        ArchiveKind::of_name(&self.path.file_name()?.to_string_lossy()).map(|(kind, _)| kind)
    }
}

/// Finds the files: a STEP file or an archive is itself, a folder is walked in sorted order, any other text is a list
/// of paths.
///
/// # Errors
/// If an argument does not exist, a folder cannot be read, or two files would get the same id.
pub fn source_files(paths: &[PathBuf]) -> Result<Vec<SourceFile>> {
    let mut files = Vec::new();
    for path in paths {
        if !path.exists() {
            return Err(UsageError(format!("{} does not exist", path.display())).into());
        }
        let argument = argument_name(path);
        if path.is_dir() {
            files.extend(
                walk(path)?.into_iter().map(|file| named(&argument, file.strip_prefix(path).unwrap_or(&file), &file)),
            );
        } else if let Some(text) = list_text(path)? {
            files.extend(listed(&argument, path, &text)?);
        } else {
            files.push(SourceFile { path: path.clone(), id: id_of_argument(&argument), name: argument });
        }
    }
    refuse_collisions(&files)?;
    Ok(files)
}

/// The last component of an argument, also where it is written as `.` or `..`.
fn argument_name(path: &Path) -> String {
    let absolute =
        || fs::canonicalize(path).ok().and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
    path.file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .or_else(absolute)
        .unwrap_or_else(|| "root".to_owned())
}

/// Whether an extension says STEP.
pub(super) fn is_step_extension(extension: &str) -> bool {
    EXTENSIONS.iter().any(|known| extension.eq_ignore_ascii_case(known))
}

/// Whether a file name says STEP.
pub(super) fn has_step_extension(path: &Path) -> bool {
    path.extension().is_some_and(|extension| is_step_extension(&extension.to_string_lossy()))
}

fn is_archive(path: &Path) -> bool {
    path.file_name().is_some_and(|name| ArchiveKind::of_name(&name.to_string_lossy()).is_some())
}

/// The STEP files and archives below a folder, sorted by path; links to folders are not followed, as they may lead in circles.
fn walk(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).with_context(|| format!("reading {}", folder.display()))? {
            let path = entry.with_context(|| format!("reading {}", folder.display()))?.path();
            if path.is_dir() && !path.is_symlink() {
                open.push(path);
            } else if (has_step_extension(&path) || is_archive(&path)) && path.is_file() {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// The text of a list; none for STEP files and whatever else is no text.
fn list_text(path: &Path) -> Result<Option<String>> {
    if has_step_extension(path) || is_archive(path) {
        return Ok(None);
    }
    let context = || format!("reading {}", path.display());
    let mut start = Vec::new();
    File::open(path).with_context(context)?.take(LOOK_BYTES).read_to_end(&mut start).with_context(context)?;
    let is_step = start.windows(STEP_HEADER.len()).any(|window| window.eq_ignore_ascii_case(STEP_HEADER));
    if start.is_empty() || is_step || start.contains(&0) {
        return Ok(None);
    }
    Ok(String::from_utf8(fs::read(path).with_context(context)?).ok())
}

/// The files of a list: one path a line, from the current folder or else from the list's; `#` begins a comment line.
fn listed(argument: &str, list: &Path, text: &str) -> Result<Vec<SourceFile>> {
    let argument = argument.rsplit_once('.').map_or(argument, |(stem, _)| stem);
    let mut files = Vec::new();
    for line in text
        .trim_start_matches('\u{feff}')
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
    {
        let line = Path::new(line);
        let beside = list.parent().unwrap_or(Path::new("")).join(line);
        let path = if !line.exists() && beside.exists() { beside } else { line.to_owned() };
        if path.is_dir() {
            let found = walk(&path)?;
            files.extend(
                found.iter().map(|file| named(argument, &line.join(file.strip_prefix(&path).unwrap_or(file)), file)),
            );
        } else {
            // A path that does not exist stays in the list: its line in the index says so.
            files.push(named(argument, line, &path));
        }
    }
    Ok(files)
}

fn refuse_collisions(files: &[SourceFile]) -> Result<()> {
    let mut first_of: BTreeMap<&str, &Path> = BTreeMap::new();
    for file in files {
        if let Some(first) = first_of.insert(&file.id, &file.path) {
            let (first, second) = (first.display(), file.path.display());
            return Err(UsageError(format!(
                "{first} and {second} would both be `{}`; label them into two data sets",
                file.id
            ))
            .into());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Makes these files with this text in a new folder, and lists what the arguments find as `id = name`.
    #[track_caller]
    fn check(files: &[(&str, &str)], arguments: &[&str], expected: Result<&[&str], &str>) {
        let folder = tempfile::tempdir().unwrap();
        for (file, text) in files {
            let path = folder.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let arguments: Vec<PathBuf> = arguments.iter().map(|argument| folder.path().join(argument)).collect();
        match (source_files(&arguments), expected) {
            (Ok(found), Ok(expected)) => {
                let found: Vec<String> = found.iter().map(|file| format!("{} = {}", file.id, file.name)).collect();
                assert_eq!(found, expected);
            }
            (Err(error), Err(expected)) => assert!(error.to_string().contains(expected), "{error}"),
            (found, expected) => panic!("found {found:?}, expected {expected:?}"),
        }
    }

    #[test]
    fn folders_files_and_lists_give_ids() {
        let files = [
            ("d/b.STP", ""),
            ("d/sub/a.step", ""),
            ("d/note.txt", ""),
            ("one.step", "no STEP"),
            ("l.txt", "# two\nd/b.STP\n\nlost.p21\n"),
        ];
        check(&files, &["d"], Ok(&["d__b = d/b.STP", "d__sub__a = d/sub/a.step"]));
        check(&files, &["one.step"], Ok(&["one = one.step"]));
        check(&files, &["l.txt"], Ok(&["l__d__b = l/d/b.STP", "l__lost = l/lost.p21"]));
        check(&files, &["one.step", "one.step"], Err("would both be `one`"));
        check(&files, &["nothing"], Err("does not exist"));
        check(&[("d/a.step", ""), ("d/a.stp", "")], &["d"], Err("would both be `d__a`"));
        check(&[("d/a.zip", ""), ("d/a.stp", "")], &["d"], Err("would both be `d__a`"));
        check(&[("d/x/a.tar.gz", "")], &["d"], Ok(&["d__x__a = d/x/a.tar.gz"]));
        check(&[("abc.7z", "text")], &["abc.7z"], Ok(&["abc = abc.7z"]));
    }

    #[test]
    fn content_tells_lists_from_step() {
        check(&[("part.dat", "/* by hand */ ISO-10303-21;")], &["part.dat"], Ok(&["part.dat = part.dat"]));
        check(&[("part.dat", "a\0b")], &["part.dat"], Ok(&["part.dat = part.dat"]));
        check(&[("empty.txt", "")], &["empty.txt"], Ok(&["empty.txt = empty.txt"]));
        check(&[("d/x.step", ""), ("l.txt", "d")], &["l.txt"], Ok(&["l__d__x = l/d/x.step"]));
    }
}
