//! Counts files whose endings are neither of STEP nor of archives, by ending, with one or two examples of each.

use partprobe_dataset::{IndexEntry, Status};
use std::collections::BTreeMap;

/// The largest number of endings. Further endings are counted together.
const MAX_ENDINGS: usize = 30;
/// The number of named files per ending.
const MAX_EXAMPLES: usize = 2;
/// Longer endings are parts of names.
const MAX_ENDING_BYTES: usize = 16;

/// The files of one folder or archive that are not read, by their endings.
#[derive(Clone, Debug, Default)]
pub(super) struct OtherEndings {
    of_ending: BTreeMap<String, EndingCount>,
}

#[derive(Clone, Debug, Default)]
struct EndingCount {
    n_files: u64,
    examples: Vec<String>,
}

impl EndingCount {
    fn add(&mut self, n_files: u64, examples: &[String]) {
        self.n_files += n_files;
        self.examples.extend_from_slice(examples);
        // The examples are the first ones by name, for any order of the files.
        self.examples.sort();
        self.examples.truncate(MAX_EXAMPLES);
    }
}

impl OtherEndings {
    /// Counts a file by its name below the folder or archive.
    pub(super) fn add(&mut self, name: &str) {
        self.of_ending
            .entry(ending_of(name))
            .or_default()
            .add(1, &[name.to_owned()]);
    }

    /// One pattern per ending, such as `*.txt`, and the line of the index that counts its files.
    pub(super) fn into_lines(self) -> Vec<(String, OtherEnding)> {
        let mut endings: Vec<(String, EndingCount)> = self.of_ending.into_iter().collect();
        endings.sort_by(|(a, first), (b, second)| {
            second.n_files.cmp(&first.n_files).then_with(|| a.cmp(b))
        });
        let rest = endings.split_off(endings.len().min(MAX_ENDINGS));
        if !rest.is_empty() {
            let mut others = EndingCount::default();
            rest.iter()
                .for_each(|(_, counted)| others.add(counted.n_files, &counted.examples));
            endings.push(("*.*".to_owned(), others));
        }
        let line = |(pattern, counted): (String, EndingCount)| {
            let examples = counted.examples.join(", ");
            let reason = match pattern.as_str() {
                "*" => format!("files without an ending are not read, for example {examples}"),
                "*.*" => format!("files with further endings are not read, for example {examples}"),
                _ => format!(
                    "files with the ending {} are not read, for example {examples}",
                    &pattern[1..]
                ),
            };
            (
                pattern,
                OtherEnding {
                    n_files: counted.n_files,
                    reason,
                },
            )
        };
        endings.into_iter().map(line).collect()
    }
}

/// The files of one ending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct OtherEnding {
    pub(super) n_files: u64,
    pub(super) reason: String,
}

impl OtherEnding {
    /// The line of the index.
    pub(super) fn entry(self, id: &str, source: &str) -> IndexEntry {
        let entry = IndexEntry::without_carrier(id, source, Status::Skipped, self.reason);
        IndexEntry {
            n_skipped: Some(self.n_files),
            ..entry
        }
    }
}

/// `*.txt`, or `*` for a name without an ending.
fn ending_of(name: &str) -> String {
    let last = name.rsplit('/').next().unwrap_or(name);
    match last.rsplit_once('.') {
        Some((stem, ending))
            if !stem.is_empty() && !ending.is_empty() && ending.len() <= MAX_ENDING_BYTES =>
        {
            format!("*.{}", ending.to_lowercase())
        }
        _ => "*".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings_are_counted_with_the_first_names() {
        let mut endings = OtherEndings::default();
        ["d/c.TXT", "b.txt", "a.txt", "makefile", ".hidden", "x.pdf"]
            .into_iter()
            .for_each(|name| endings.add(name));
        let lines: Vec<_> = endings
            .into_lines()
            .into_iter()
            .map(|(ending, line)| (ending, line.n_files))
            .collect();
        assert_eq!(
            lines,
            [
                ("*.txt".to_owned(), 3),
                ("*".to_owned(), 2),
                ("*.pdf".to_owned(), 1)
            ]
        );
        let mut endings = OtherEndings::default();
        (0..100).for_each(|number| endings.add(&format!("a.{number}")));
        let lines = endings.into_lines();
        assert_eq!(
            (lines.len(), lines[MAX_ENDINGS].1.n_files),
            (MAX_ENDINGS + 1, 100 - MAX_ENDINGS as u64)
        );
        assert!(
            lines[0]
                .1
                .reason
                .contains("the ending .0 are not read, for example a.0"),
            "{}",
            lines[0].1.reason
        );
    }
}
