//! Finds inputs that are new, and inputs that are no longer given, by comparing names with the records of a batch.
//!
//! An archive covers the records of its members. Contents are not compared here, but in `changed_inputs`.

use super::input_files::InputFile;
use partprobe_dataset::{FileRecord, Status};
use std::collections::BTreeSet;

/// The largest number of files that are named. Further ones are only counted.
const MAX_NAMED: usize = 10;

/// The names in which the inputs of a batch differ from those that were given before.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct RenamedInputs {
    /// Inputs that have no record.
    new: BTreeSet<String>,
    /// Sources of records that none of the inputs has.
    missing: BTreeSet<String>,
}

impl RenamedInputs {
    /// Compares the inputs with the records. An unfinished batch has no records of its later inputs, so none of them is
    /// considered new.
    pub(super) fn find(records: &[FileRecord], files: &[InputFile], is_finished: bool) -> Self {
        let is_read = |record: &&FileRecord| {
            record
                .entries
                .iter()
                .any(|entry| entry.status != Status::Skipped)
        };
        let sources: BTreeSet<&str> = records
            .iter()
            .filter(is_read)
            .map(|record| record.source.as_str())
            .collect();
        let names: BTreeSet<&str> = files.iter().map(|file| file.name.as_str()).collect();
        let covered: BTreeSet<&str> = sources
            .iter()
            .copied()
            .flat_map(with_folders_above)
            .collect();

        let is_given = |source: &&&str| with_folders_above(source).any(|name| names.contains(name));
        let is_new = |name: &&&str| is_finished && !covered.contains(**name);
        Self {
            new: owned(names.iter().filter(is_new)),
            missing: owned(sources.iter().filter(|source| !is_given(source))),
        }
    }

    /// The differences for a message: one text per kind of difference.
    pub(super) fn named(&self) -> Vec<String> {
        [("new", &self.new), ("missing", &self.missing)]
            .into_iter()
            .filter(|(_, names)| !names.is_empty())
            .map(|(kind, names)| format!("{kind}: {}", first_of(names)))
            .collect()
    }
}

/// A source and the folders and archives that it may be in: `s/a.zip/b.step`, `s/a.zip`, `s`.
fn with_folders_above(source: &str) -> impl Iterator<Item = &str> {
    let ends = source.match_indices('/').map(|(end, _)| end);
    ends.chain([source.len()]).map(|end| &source[..end])
}

fn owned<'a>(names: impl Iterator<Item = &'a &'a str>) -> BTreeSet<String> {
    names.map(|&name| name.to_owned()).collect()
}

/// The first names, and the number of further ones.
pub(super) fn first_of(names: &BTreeSet<String>) -> String {
    let first: Vec<&str> = names.iter().take(MAX_NAMED).map(String::as_str).collect();
    let n_more = names.len() - first.len();
    match n_more {
        0 => first.join(", "),
        _ => format!("{} and {n_more} more", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_dataset::IndexEntry;
    use std::path::PathBuf;

    fn record(source: &str) -> FileRecord {
        let entry = IndexEntry::without_carrier("a", source, Status::Failed, String::new());
        FileRecord {
            source: source.to_owned(),
            position: 0,
            entries: vec![entry],
            written: Vec::new(),
            seconds: None,
            ended: 0.0,
        }
    }

    #[track_caller]
    fn check(sources: &[&str], names: &[&str], is_finished: bool, expected: &[&str]) {
        let records: Vec<FileRecord> = sources.iter().map(|source| record(source)).collect();
        let file = |name: &&str| InputFile {
            path: PathBuf::from(name),
            id: (*name).to_owned(),
            name: (*name).to_owned(),
            archive: None,
        };
        let files: Vec<InputFile> = names.iter().map(file).collect();
        let renamed = RenamedInputs::find(&records, &files, is_finished);
        assert_eq!(renamed.named(), expected);
    }

    #[test]
    fn new_and_missing_names_are_listed_and_members_belong_to_their_archive() {
        check(&["s/a", "s/b"], &["s/a", "s/b"], true, &[]);
        check(&["s/a"], &["s/b"], true, &["new: s/b", "missing: s/a"]);
        check(&["s/a"], &["s/b"], false, &["missing: s/a"]);
        check(&["s/z.zip/d/a"], &["s/z.zip"], true, &[]);
        check(
            &["s/z.zip/a"],
            &["s/z"],
            true,
            &["new: s/z", "missing: s/z.zip/a"],
        );
    }
}
