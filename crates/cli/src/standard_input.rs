//! Copies the standard input to a temporary file, for verbs that read files: `cat part.step | partprobe inspect -`.
//!
//! The bytes of the standard input go in, and a file in a temporary folder comes out. The first bytes determine the ending of its
//! name, so that it is read like any other file. The content of the file is not checked here.

use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use partprobe_formats::{ArchiveKind, Packing, step_stem};
use partprobe_imports::{holds_rows_of_numbers, is_given_name};
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use tempfile::TempDir;

/// The path that means the standard input.
const DASH: &str = "-";
/// The name of the standard input's file, without an ending.
pub(crate) const STDIN_NAME: &str = "stdin";
/// The number of first bytes by which the input is recognized.
const LOOK_BYTES: u64 = 4096;
/// The bytes of a binary STL without its triangles, and the bytes of each triangle.
const STL_BYTES: [u64; 2] = [84, 50];
/// The first words of lines in an OBJ file.
const OBJ_WORDS: [&str; 9] = ["v", "vn", "vt", "f", "o", "g", "s", "mtllib", "usemtl"];

/// Whether a path of the command line means the standard input.
#[must_use]
pub(crate) fn is_standard_input(path: &Path) -> bool {
    path == Path::new(DASH)
}

/// The standard input as a file, which is removed when this value is dropped.
#[derive(Debug)]
pub(crate) struct StandardInput {
    /// The new folder of the file, which is removed with the value.
    folder: TempDir,
    file: PathBuf,
}

impl StandardInput {
    /// Reads the standard input to its end, or until it is larger than `max_bytes`. Then the reader of the file reports this.
    ///
    /// `name` is the name of the file. It gets an ending if it has none that partprobe knows.
    ///
    /// # Errors
    /// If the standard input is empty, it cannot be read or stored, or the name has several components.
    pub(crate) fn read(name: &str, max_bytes: u64) -> Result<Self> {
        check_name(name)?;
        let folder = TempDir::with_prefix("partprobe-stdin-")
            .context("making a folder for the standard input")?;
        let mut input = Self {
            file: folder.path().join("unnamed"),
            folder,
        };
        let storing = || {
            let folder = input.folder.path().display();
            format!("storing the standard input in {folder}")
        };
        let mut file = File::create(&input.file).with_context(storing)?;
        let n_bytes = io::copy(
            &mut io::stdin().lock().take(max_bytes.saturating_add(1)),
            &mut file,
        )
        .with_context(storing)?;
        drop(file);
        ensure!(n_bytes > 0, "the standard input is empty");
        let named = input.folder.path().join(input.named(name, n_bytes)?);
        fs::rename(&input.file, &named).with_context(storing)?;
        input.file = named;
        Ok(input)
    }

    /// The path of the file.
    #[must_use]
    pub(crate) fn path(&self) -> &Path {
        &self.file
    }

    /// The name with an ending.
    fn named(&self, name: &str, n_bytes: u64) -> io::Result<String> {
        if has_known_ending(name) {
            return Ok(name.to_owned());
        }
        let mut start = Vec::new();
        File::open(&self.file)?
            .take(LOOK_BYTES)
            .read_to_end(&mut start)?;
        let ending = match File::open(&self.file).and_then(Packing::of_content)? {
            Packing::Archive(_) if begins_as_npz(&start) => ".npz",
            Packing::Archive(kind) => kind.ending(),
            Packing::OneFile => ".step",
            Packing::Nothing => ending_of_content(&start, n_bytes),
        };
        Ok(format!("{name}{ending}"))
    }
}

/// Replaces `-` among the paths by the file of the standard input. The file exists as long as the second value.
///
/// # Errors
/// If `-` is given twice, or as for [`StandardInput::read`].
pub(crate) fn with_standard_input(
    paths: &[PathBuf],
    name: &str,
    max_bytes: u64,
) -> Result<(Vec<PathBuf>, Option<StandardInput>)> {
    let is_dash = |path: &&PathBuf| is_standard_input(path);
    match paths.iter().filter(is_dash).count() {
        0 => return Ok((paths.to_vec(), None)),
        1 => {}
        _ => bail!(UsageError(
            "`-` is given twice, and the standard input can be read only once".to_owned()
        )),
    }
    let input = StandardInput::read(name, max_bytes)?;
    let replaced = |path: &PathBuf| {
        if is_standard_input(path) {
            input.path().to_owned()
        } else {
            path.clone()
        }
    };
    Ok((paths.iter().map(replaced).collect(), Some(input)))
}

fn check_name(name: &str) -> Result<()> {
    let mut components = Path::new(name).components();
    let is_plain = matches!(
        (components.next(), components.next()),
        (Some(Component::Normal(_)), None)
    );
    ensure!(
        is_plain && !name.ends_with('/'),
        UsageError(format!(
            "`{name}` is not the name of a file; give one without folders, for example bracket.step"
        ))
    );
    Ok(())
}

fn has_known_ending(name: &str) -> bool {
    let is_npz = Path::new(name)
        .extension()
        .is_some_and(|ending| ending == "npz");
    is_npz
        || step_stem(name).is_some()
        || ArchiveKind::of_name(name).is_some()
        || is_given_name(name)
}

/// Whether the first member of a ZIP archive is an array of NumPy, as in a carrier.
fn begins_as_npz(start: &[u8]) -> bool {
    let length = |at: usize| {
        Some(usize::from(u16::from_le_bytes(
            *start.get(at..)?.first_chunk()?,
        )))
    };
    let name = length(26).and_then(|length| start.get(30..30 + length));
    start.starts_with(b"PK\x03\x04") && name.is_some_and(|name| name.ends_with(b".npy"))
}

/// The ending of a file that is not packed. A file that is neither a mesh nor a cloud counts as STEP. The reader reports an error
/// if it is not.
fn ending_of_content(start: &[u8], n_bytes: u64) -> &'static str {
    let begins = |mark: &[u8]| start.starts_with(mark);
    if begins(b"ply\n") || begins(b"ply\r") {
        return ".ply";
    }
    if begins(b"\x93NUMPY") {
        return ".npy";
    }
    if begins(b"OFF") || begins(b"COFF") {
        return ".off";
    }
    if is_binary_stl(start, n_bytes) || (begins(b"solid") && contains(start, b"facet")) {
        return ".stl";
    }
    if holds_rows_of_numbers(start) {
        return ".xyz";
    }
    if is_obj(start) { ".obj" } else { ".step" }
}

fn contains(bytes: &[u8], word: &[u8]) -> bool {
    bytes.windows(word.len()).any(|window| window == word)
}

/// Whether the length of the file fits the number of triangles in the header of a binary STL.
fn is_binary_stl(start: &[u8], n_bytes: u64) -> bool {
    let [header, triangle] = STL_BYTES;
    let count = start.get(80..).and_then(|rest| rest.first_chunk());
    count.is_some_and(|&count| header + triangle * u64::from(u32::from_le_bytes(count)) == n_bytes)
}

fn is_obj(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let mut lines = text.lines().map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'));
    let word = first.and_then(|line| line.split_whitespace().next());
    word.is_some_and(|word| OBJ_WORDS.contains(&word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_bytes_decide_the_ending() {
        let binary_stl = [vec![0; 80], 1_u32.to_le_bytes().to_vec(), vec![0; 50]].concat();
        let cases: [(&[u8], &str); 11] = [
            (b"ISO-10303-21;\nHEADER;", ".step"),
            (b"ply\nformat ascii 1.0\n", ".ply"),
            (b"\x93NUMPY\x01\x00", ".npy"),
            (b"OFF\n8 6 0\n", ".off"),
            (b"solid cube\n facet normal 0 0 1\n", ".stl"),
            (&binary_stl, ".stl"),
            (b"0.5 1 2\n0 0 1\n", ".xyz"),
            (b"# made by hand\n\nmtllib a.mtl\nv 0 0 0\n", ".obj"),
            (b"v 0 0 0\nv 1 0 0\n", ".obj"),
            (b"hello", ".step"),
            (b"\0\x01\x02", ".step"),
        ];
        for (start, ending) in cases {
            assert_eq!(
                ending_of_content(start, start.len() as u64),
                ending,
                "{}",
                String::from_utf8_lossy(start)
            );
        }
    }

    #[test]
    fn names_are_those_of_files() {
        for name in ["bracket", "bracket.step", "a b", "..x"] {
            assert!(check_name(name).is_ok(), "{name}");
        }
        for name in ["", "a/b", "..", "/", "a/", "."] {
            assert!(check_name(name).is_err(), "{name}");
        }
    }
}
