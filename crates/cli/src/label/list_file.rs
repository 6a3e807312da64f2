//! Reads lists of paths: one path per line, or each path followed by a zero byte. Lists are bytes, because names need not be
//! UTF-8. `#` begins a comment line.

use super::path_text::{name_text, path_of_bytes};
use super::walk::is_step_or_archive;
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The number of lines that decide whether a text is a list.
const MAX_LOOKED_AT: usize = 100;

/// The bytes of a list.
#[derive(Debug)]
pub(super) struct ListText(Vec<u8>);

impl ListText {
    /// Reads a list; `-` is the standard input.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let mut bytes = Vec::new();
        let read = if path == Path::new("-") {
            std::io::stdin()
                .lock()
                .read_to_end(&mut bytes)
                .map(|_| bytes)
        } else {
            fs::read(path)
        };
        let text = read.with_context(|| format!("reading the list {}", path.display()))?;
        ensure!(
            !text.starts_with(b"\xff\xfe") && !text.starts_with(b"\xfe\xff"),
            UsageError(format!(
                "the list {} is text in UTF-16; save it as UTF-8",
                path.display()
            ))
        );
        Ok(Self(text))
    }

    /// The paths, in their order.
    pub(super) fn paths(&self) -> Vec<PathBuf> {
        lines_of(&self.0).map(path_of_bytes).collect()
    }

    /// The path of a line, relative to the current folder, or otherwise to the folder of the list.
    pub(super) fn resolved(list: &Path, line: &Path) -> PathBuf {
        let sibling = list.parent().unwrap_or(Path::new("")).join(line);
        if !line.exists() && sibling.exists() {
            sibling
        } else {
            line.to_owned()
        }
    }
}

fn lines_of(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    // `find -print0` ends each path with a zero byte, because names may contain line breaks.
    let end = if text.contains(&0) { 0 } else { b'\n' };
    let trimmed = move |line| {
        if end == 0 {
            line
        } else {
            <[u8]>::trim_ascii(line)
        }
    };
    text.split(move |&byte| byte == end)
        .map(trimmed)
        .filter(|line| !line.is_empty() && !line.starts_with(b"#"))
}

/// Whether at least half of the first lines of a file are existing paths, or have the endings of STEP files and archives.
pub(super) fn looks_like_list(list: &Path, start: &[u8]) -> bool {
    if start.contains(&0) {
        return false;
    }
    let is_path = |line: &&[u8]| {
        let path = path_of_bytes(line);
        let has_wanted_name = path
            .file_name()
            .is_some_and(|name| is_step_or_archive(&name_text(name)));
        has_wanted_name || ListText::resolved(list, &path).exists()
    };
    let lines: Vec<&[u8]> = lines_of(start).take(MAX_LOOKED_AT).collect();
    let n_paths = lines.iter().filter(|line| is_path(line)).count();
    n_paths > 0 && 2 * n_paths >= lines.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_distinguished_from_other_texts() {
        let list = Path::new("l.txt");
        for text in [
            "a.step\nb.stp\n",
            "\u{feff}# parts\r\na.zip\r\n",
            "lost.p21",
            ".",
            "a.step\nmistyped\n",
        ] {
            assert!(looks_like_list(list, text.as_bytes()), "{text}");
        }
        for text in [
            "",
            "# nothing",
            "Some words.\nMore words.",
            "See\nthese\na.step",
            "name,size\na.step,3\nb.step,4",
            "a.step\0",
        ] {
            assert!(!looks_like_list(list, text.as_bytes()), "{text}");
        }
        for (text, paths) in [
            (&b" a\xff.step \n\n#x\nb"[..], 2),
            (b"a.step\0 b\nc.step\0", 2),
            (b"a.step\0\0", 1),
            (b"", 0),
        ] {
            assert_eq!(ListText(text.to_vec()).paths().len(), paths, "{text:?}");
        }
        assert_eq!(
            ListText(b"a\0 b\nc\0".to_vec()).paths()[1],
            Path::new(" b\nc")
        );
    }
}
