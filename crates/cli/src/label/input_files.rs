//! Finds STEP files, archives of them, meshes and point clouds from the paths of the command line, each with its id, and makes
//! lines of the index for all other files.

use super::foreign_file::{foreign_by_content, foreign_by_name};
use super::found::{Found, FoundItem};
use super::input_bytes::is_given;
use super::list_file::{ListText, looks_like_list};
use super::shape_id::{Argument, SKIPPED_MARK, argument_name, named, remove_repeated_paths};
use super::step_text::{begins_as_step, special_kind};
use super::walk::{Problem, WalkTarget, walk};
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::IndexEntry;
use partprobe_formats::{ArchiveKind, Packing, step_stem};
use partprobe_imports::is_given_name;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The number of first bytes that distinguish STEP from a list.
const LOOK_BYTES: u64 = 4096;

/// A file to label, or an archive of such files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct InputFile {
    /// Its path.
    pub(crate) path: PathBuf,
    /// `<name of the argument>__<relative path>`, with `__` for `/`, and without the ending unless another file would have the
    /// same id.
    pub(crate) id: String,
    /// `<name of the argument>/<relative path>`.
    pub(crate) name: String,
    /// The kind of archive, if it is one.
    pub(crate) archive: Option<ArchiveKind>,
}

/// All inputs that are found from the arguments.
#[derive(Clone, Debug, Default)]
pub(crate) struct InputList {
    /// The files and archives, in the order of the arguments and sorted below each.
    pub(crate) files: Vec<InputFile>,
    /// Lines of the index for files that are not read, each with the reason.
    pub(crate) unread: Vec<IndexEntry>,
    /// Paths that were given again, once for each repetition. Each is read once.
    pub(crate) repeated: Vec<PathBuf>,
}

impl InputList {
    /// The same sources, unless there is nothing to label among them.
    ///
    /// # Errors
    /// If there is no file. The message gives the first reasons.
    pub(crate) fn not_empty(self) -> Result<Self> {
        let reasons: Vec<String> = self
            .unread
            .iter()
            .take(3)
            .map(|entry| {
                format!(
                    "{}: {}",
                    entry.source,
                    entry.reason.as_deref().unwrap_or_default()
                )
            })
            .collect();
        let why = if reasons.is_empty() {
            String::new()
        } else {
            format!("; {}", reasons.join("; "))
        };
        ensure!(
            !self.files.is_empty(),
            UsageError(format!(
                "there is no .step, .stp or .p21 file, packed or not, no archive, no mesh and no point cloud in what was \
                 given{why}"
            ))
        );
        Ok(self)
    }
}

/// Finds the files: a STEP file or an archive is used directly, a folder is walked in sorted order, a text whose lines look like
/// paths is a list, and `lists` are always lists.
///
/// Meshes and clouds next to STEP files are often the same shapes. So they are read only if the inputs contain no STEP file and
/// no archive.
///
/// # Errors
/// If an argument does not exist, a list cannot be read, or two files cannot be distinguished by name.
pub(crate) fn input_files(paths: &[PathBuf], lists: &[PathBuf]) -> Result<InputList> {
    let lists: Vec<(&PathBuf, ListText)> = lists
        .iter()
        .map(|list| Ok((list, ListText::read(list)?)))
        .collect::<Result<_>>()?;
    let mut of_step = found_in_all(paths, &lists, WalkTarget::Step)?;
    if of_step.found.iter().any(Found::is_of_step) {
        of_step.found.iter_mut().for_each(Found::add_next_to_step);
        return listed(of_step);
    }
    let given = found_in_all(paths, &lists, WalkTarget::Given)?;
    let has_files = given
        .found
        .iter()
        .any(|item| matches!(item.what, FoundItem::File(_)));
    listed(if has_files { given } else { of_step })
}

/// The arguments with all paths that are found from them.
struct FoundInAll {
    arguments: Vec<Argument>,
    found: Vec<Found>,
}

fn found_in_all(
    paths: &[PathBuf],
    lists: &[(&PathBuf, ListText)],
    wanted: WalkTarget,
) -> Result<FoundInAll> {
    let mut arguments = Vec::new();
    let mut found = Vec::new();
    for path in paths {
        arguments.push(Argument::new(path));
        let argument = arguments.len() - 1;
        found.extend(found_in_argument(path, argument, &mut arguments, wanted)?);
    }
    for (list, text) in lists {
        arguments.push(Argument::list(list));
        found.extend(found_in_list(list, arguments.len() - 1, text, wanted));
    }
    Ok(FoundInAll { arguments, found })
}

/// Names all found paths, each once.
fn listed(
    FoundInAll {
        arguments,
        mut found,
    }: FoundInAll,
) -> Result<InputList> {
    let repeated = remove_repeated_paths(&arguments, &mut found);
    let mut sources = InputList {
        repeated,
        ..InputList::default()
    };
    for (item, named) in named(&arguments, &found)? {
        match &item.what {
            FoundItem::File(archive) => {
                let path = item.path.clone();
                sources.files.push(InputFile {
                    path,
                    id: named.id,
                    name: named.source,
                    archive: *archive,
                });
            }
            FoundItem::Unread(problem) => {
                let id = format!("{}{SKIPPED_MARK}", named.id);
                let entry = IndexEntry::without_carrier(
                    &id,
                    &named.source,
                    problem.status,
                    problem.reason.clone(),
                );
                sources.unread.push(IndexEntry {
                    n_skipped: item.n_files,
                    ..entry
                });
            }
        }
    }
    Ok(sources)
}

fn found_in_argument(
    path: &Path,
    argument: usize,
    arguments: &mut [Argument],
    wanted: WalkTarget,
) -> Result<Vec<Found>> {
    let metadata = match fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) => return Err(UsageError(missing_path_message(path, &error)).into()),
    };
    if metadata.is_dir() {
        return Ok(found_in_folder(path, argument, Path::new(""), wanted));
    }
    let what = match classified(path, wanted)? {
        ArgumentKind::List(text) => {
            arguments[argument] = Argument::list(path);
            return Ok(found_in_list(path, argument, &text, wanted));
        }
        ArgumentKind::Item(what) => what,
    };
    Ok(vec![Found {
        argument,
        path: path.to_owned(),
        below: PathBuf::new(),
        what,
        n_files: None,
    }])
}

fn missing_path_message(path: &Path, error: &io::Error) -> String {
    let path_text = path.display();
    match error.kind() {
        io::ErrorKind::NotFound if path.is_symlink() => {
            format!("{path_text} is a link to a file that does not exist")
        }
        io::ErrorKind::NotFound if path == Path::new("-") => {
            "`-` is the standard input, and this command reads files only; store it in a file first"
                .to_owned()
        }
        io::ErrorKind::NotFound => format!("{path_text} does not exist"),
        _ => format!("{path_text}: {error}"),
    }
}

/// The paths that a walk finds. `below` is the name of the folder in its list.
fn found_in_folder(folder: &Path, argument: usize, below: &Path, wanted: WalkTarget) -> Vec<Found> {
    let walked = walk(folder, wanted);
    let mut found = Vec::new();
    for item in walked.found {
        let below = below.join(item.path.strip_prefix(folder).unwrap_or(&item.path));
        let what = item
            .problem
            .map_or_else(|| kind_by_name(&item.path), FoundItem::Unread);
        found.push(Found {
            argument,
            path: item.path,
            below,
            what,
            n_files: None,
        });
    }
    for (pattern, line) in walked.other_endings.into_lines() {
        let what = FoundItem::Unread(Problem::skipped(line.reason));
        found.push(Found {
            argument,
            path: folder.join(&pattern),
            below: below.join(pattern),
            what,
            n_files: Some(line.n_files),
        });
    }
    found
}

/// The kind of a file whose name is that of STEP or an archive. The content determines the kind of archive.
fn kind_by_name(path: &Path) -> FoundItem {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let is_archive = ArchiveKind::of_name(&name).is_some();
    if step_stem(&name).is_some() || (is_given_name(&name) && !is_archive) {
        return FoundItem::File(None);
    }
    let by_name = ArchiveKind::of_name(&name).map(|(kind, _)| kind);
    match File::open(path).and_then(Packing::of_content) {
        Ok(Packing::Archive(kind)) => FoundItem::File(Some(kind)),
        // One packed file, or STEP text, with the name of an archive. The worker reads it.
        Ok(Packing::OneFile) => FoundItem::File(None),
        Ok(Packing::Nothing) if begins_as_step(&start_of(path).unwrap_or_default()) => {
            FoundItem::File(None)
        }
        // A damaged archive is reported when it is walked.
        Ok(Packing::Nothing) => FoundItem::File(by_name),
        Err(error) => FoundItem::Unread(Problem::failed(format!("opening the archive: {error}"))),
    }
}

/// The kind of an argument or of a line of a list.
enum ArgumentKind {
    Item(FoundItem),
    List(ListText),
}

/// Determines the kind of an explicitly named path by its name and content. The path must exist and must not be a folder.
fn classified(path: &Path, wanted: WalkTarget) -> Result<ArgumentKind> {
    let metadata = fs::metadata(path).with_context(|| format!("reading {}", path.display()))?;
    if let Some(kind) = special_kind(&metadata) {
        let advice = if kind == "a named pipe" {
            "; `--list` reads a pipe that gives paths"
        } else {
            ""
        };
        return Ok(ArgumentKind::Item(FoundItem::Unread(Problem::skipped(
            format!("it is {kind}, not a file{advice}"),
        ))));
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if step_stem(&name).is_some() || ArchiveKind::of_name(&name).is_some() {
        return Ok(ArgumentKind::Item(kind_by_name(path)));
    }
    let start = match start_of(path) {
        Ok(start) => start,
        Err(error) => {
            return Ok(ArgumentKind::Item(FoundItem::Unread(Problem::failed(
                format!("opening the file: {error}"),
            ))));
        }
    };
    let skipped = |reason| {
        Ok(ArgumentKind::Item(FoundItem::Unread(Problem::skipped(
            reason,
        ))))
    };
    if begins_as_step(&start) || (wanted == WalkTarget::Given && is_given(&name, &start)) {
        return Ok(ArgumentKind::Item(FoundItem::File(None)));
    }
    if let Some(reason) = foreign_by_name(&name) {
        return skipped(reason);
    }
    match File::open(path).and_then(Packing::of_content) {
        Ok(Packing::Archive(kind)) => return Ok(ArgumentKind::Item(FoundItem::File(Some(kind)))),
        Ok(Packing::OneFile) => return Ok(ArgumentKind::Item(FoundItem::File(None))),
        _ => {}
    }
    let is_cut = start.len() as u64 == LOOK_BYTES;
    let whole_lines = start
        .iter()
        .rposition(|&byte| byte == b'\n')
        .filter(|_| is_cut)
        .unwrap_or(start.len());
    if looks_like_list(path, &start[..whole_lines]) {
        return Ok(ArgumentKind::List(ListText::read(path)?));
    }
    skipped(foreign_by_content(&start))
}

fn start_of(path: &Path) -> io::Result<Vec<u8>> {
    let mut start = Vec::new();
    File::open(path)?.take(LOOK_BYTES).read_to_end(&mut start)?;
    Ok(start)
}

/// The files of a list, relative to the current folder or otherwise to the folder of the list.
fn found_in_list(list: &Path, argument: usize, text: &ListText, wanted: WalkTarget) -> Vec<Found> {
    let mut found = Vec::new();
    for line in text.paths() {
        let path = ListText::resolved(list, &line);
        if path.is_dir() {
            found.extend(found_in_folder(&path, argument, &line, wanted));
            continue;
        }
        // A path that does not exist stays in the list. Its line in the index reports this.
        let what = match fs::metadata(&path)
            .ok()
            .and_then(|_| classified(&path, wanted).ok())
        {
            Some(ArgumentKind::Item(what)) => what,
            Some(ArgumentKind::List(_)) => FoundItem::Unread(Problem::skipped(
                "it is a list, and lists inside lists are not read",
            )),
            None => FoundItem::File(None),
        };
        found.push(Found {
            argument,
            path,
            below: line,
            what,
            n_files: None,
        });
    }
    found
}

/// The id that a file gets by its own name. Verbs that read one file at a time use it.
#[must_use]
pub(crate) fn id_of_path(path: &Path) -> String {
    super::shape_id::id_of_argument(&argument_name(path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// Makes these files with this text in a new folder, and lists what the arguments find as `id = name`.
    #[track_caller]
    fn check(files: &[(&str, &str)], arguments: &[&str], expected: Result<&[&str], &str>) {
        let folder = tempfile::tempdir().unwrap();
        for (file, text) in files {
            let path = folder.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let arguments: Vec<PathBuf> = arguments
            .iter()
            .map(|argument| folder.path().join(argument))
            .collect();
        let lines = |sources: InputList| {
            let files = sources
                .files
                .iter()
                .map(|file| format!("{} = {}", file.id, file.name));
            let unread = sources
                .unread
                .iter()
                .map(|entry| format!("{} ! {}", entry.id, entry.source));
            files.chain(unread).collect::<Vec<_>>()
        };
        match (input_files(&arguments, &[]).map(lines), expected) {
            (Ok(found), Ok(expected)) => assert_eq!(found, expected),
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
        check(
            &files,
            &["d"],
            Ok(&[
                "d__b = d/b.STP",
                "d__sub__a = d/sub/a.step",
                "d__*.txt#unread ! d/*.txt",
            ]),
        );
        check(&files, &["one.step"], Ok(&["one = one.step"]));
        check(
            &files,
            &["l.txt"],
            Ok(&["l__d__b = l/d/b.STP", "l__lost = l/lost.p21"]),
        );
        check(&files, &["one.step", "one.step"], Ok(&["one = one.step"]));
        let all = [
            "d__b = d/b.STP",
            "d__sub__a = d/sub/a.step",
            "d__*.txt#unread ! d/*.txt",
        ];
        for arguments in [
            ["d", "d/b.STP"],
            ["d/b.STP", "d"],
            ["d/sub/../b.STP", "d"],
            ["d", "d/sub/a.step"],
        ] {
            check(&files, &arguments, Ok(&all));
        }
        let again = [
            ("d/a.step", ""),
            ("l.txt", "d\nd/a.step\n./d/../d/a.step\n"),
        ];
        check(&again, &["l.txt"], Ok(&["l__d__a = l/d/a.step"]));
        let twice = [
            ("a.step", ""),
            ("l.txt", "a.step\n./a.step\nlost.stp\na.step\nlost.stp\n"),
        ];
        check(
            &twice,
            &["l.txt"],
            Ok(&["l__a = l/a.step", "l__lost = l/lost.stp"]),
        );
        check(&files, &["nothing"], Err("does not exist"));
        check(
            &[("d/x/a.tar.gz", "")],
            &["d"],
            Ok(&["d__x__a = d/x/a.tar.gz"]),
        );
        check(&[("abc.7z", "text")], &["abc.7z"], Ok(&["abc = abc.7z"]));
        check(
            &[("d/a.stpZ", ""), ("d/b.step.gz", "")],
            &["d"],
            Ok(&["d__a = d/a.stpZ", "d__b = d/b.step.gz"]),
        );
    }

    #[test]
    fn the_ending_joins_ids_that_would_be_equal_and_no_others() {
        let two = [("d/x.step", ""), ("d/x.stp", ""), ("d/y.step", "")];
        check(
            &two,
            &["d"],
            Ok(&[
                "d__x.step = d/x.step",
                "d__x.stp = d/x.stp",
                "d__y = d/y.step",
            ]),
        );
        let case = [("d/b.STEP", ""), ("d/b.step", "")];
        check(
            &case,
            &["d"],
            Ok(&["d__b.STEP = d/b.STEP", "d__b.step = d/b.step"]),
        );
        let three = [("d/x.step", ""), ("d/x.stp", ""), ("d/x.step.step", "")];
        let ids = [
            "d__x.step--933e00d2f5b9c0a2 = d/x.step",
            "d__x.step.step = d/x.step.step",
            "d__x.stp = d/x.stp",
        ];
        check(&three, &["d"], Ok(&ids));
        // An archive and a file do not share ids.
        check(
            &[("d/a.zip", ""), ("d/a.stp", "")],
            &["d"],
            Ok(&["d__a = d/a.stp", "d__a = d/a.zip"]),
        );
    }

    #[test]
    fn arguments_of_one_name_keep_the_folders_that_distinguish_them() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["p/s/x.step", "q/s/x.step", "q/s/y.step"] {
            fs::create_dir_all(folder.path().join(name).parent().unwrap()).unwrap();
            fs::write(folder.path().join(name), "").unwrap();
        }
        let ids = |arguments: [&str; 2]| {
            let paths = arguments.map(|argument| folder.path().join(argument));
            let mut ids: Vec<String> = input_files(&paths, &[])
                .unwrap()
                .files
                .into_iter()
                .map(|file| file.id)
                .collect();
            ids.sort();
            ids
        };
        let found = ids(["p/s", "q/s"]);
        let has = |id: &str| {
            found
                .iter()
                .any(|found| found == id || found.ends_with(&format!("__{id}")))
        };
        assert!(
            found.len() == 3
                && has("p__s__x")
                && has("q__s__x")
                && found.contains(&"s__y".to_owned()),
            "{found:?}"
        );
        assert_eq!(found, ids(["q/s", "p/s"]));
    }

    #[test]
    fn a_flat_name_and_a_folder_with_the_same_id_are_distinguished_by_a_hash() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("d/a")).unwrap();
        fs::write(folder.path().join("d/a/b.step"), "").unwrap();
        fs::write(folder.path().join("d/a__b.step"), "").unwrap();
        let files = input_files(&[folder.path().join("d")], &[]).unwrap().files;
        assert!(
            files
                .iter()
                .all(|file| file.id.starts_with("d__a__b.step--"))
                && files[0].id != files[1].id
        );
    }

    #[test]
    fn files_that_are_skipped_next_to_step_files_are_distinguished_from_unknown_files() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["d/a.step", "d/b.obj", "d/c.pdf"] {
            fs::create_dir_all(folder.path().join(name).parent().unwrap()).unwrap();
            fs::write(folder.path().join(name), "").unwrap();
        }
        let reason = |source: &str| {
            let unread = input_files(&[folder.path().join("d")], &[]).unwrap().unread;
            let entry = unread.into_iter().find(|entry| entry.source == source);
            entry.unwrap().reason.unwrap()
        };
        assert_eq!(
            reason("d/*.obj"),
            "files with the ending .obj are not read, for example b.obj: meshes and point clouds are not read next to \
             STEP files; label them in a call of their own"
        );
        assert_eq!(
            reason("d/*.pdf"),
            "files with the ending .pdf are not read, for example c.pdf"
        );
    }

    #[test]
    fn content_distinguishes_lists_step_files_and_other_files() {
        check(
            &[("part.dat", "/* by hand */ ISO-10303-21;")],
            &["part.dat"],
            Ok(&["part.dat = part.dat"]),
        );
        check(
            &[("part.dat", "a\0b")],
            &["part.dat"],
            Ok(&["part.dat#unread ! part.dat"]),
        );
        check(
            &[("empty.txt", "")],
            &["empty.txt"],
            Ok(&["empty.txt#unread ! empty.txt"]),
        );
        check(
            &[("readme.txt", "Some text.\nMore of it.")],
            &["readme.txt"],
            Ok(&["readme.txt#unread ! readme.txt"]),
        );
        check(&[("m.stl", "solid x")], &["m.stl"], Ok(&["m = m.stl"]));
        let mixed = [
            ("m.stl", "solid x"),
            ("a.step", ""),
            ("d/b.obj", ""),
            ("d/c.txt", "1 2 3"),
            ("d/note.txt", "see"),
        ];
        let meshes = [
            "d__b = d/b.obj",
            "d__c = d/c.txt",
            "d__*.txt#unread ! d/*.txt",
        ];
        check(&mixed, &["d"], Ok(&meshes));
        let step = [
            "a = a.step",
            "m.stl#unread ! m.stl",
            "d__*.txt#unread ! d/*.txt",
            "d__*.obj#unread ! d/*.obj",
        ];
        check(&mixed, &["a.step", "m.stl", "d"], Ok(&step));
        check(
            &[("d/x.step", ""), ("l.txt", "d")],
            &["l.txt"],
            Ok(&["l__d__x = l/d/x.step"]),
        );
        check(
            &[("d/x.zip", "ISO-10303-21;")],
            &["d"],
            Ok(&["d__x = d/x.zip"]),
        );
    }
}
