//! Defines the index of a folder of embeddings: one line per shape, with its file or the reason why it has none.

use anyhow::{Context, Result};
use partprobe_dataset::{json_lines, write_atomically};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::path::Path;

/// The name of the index in its folder.
pub(super) const FILE: &str = "index.jsonl";

/// A shape with its file, or an input that could not be embedded.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub(super) struct IndexLine {
    /// The id of the shape, or the name of an input that could not be read.
    pub(super) id: String,
    /// The file or the shape from which it was read.
    pub(super) source: String,
    /// The absolute path of the file, folder, archive or data set that the user gave. It is `None` for the standard input, and in
    /// indexes of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) given: Option<String>,
    /// The embedding file, relative to the folder, or `None` if it could not be embedded.
    pub(super) file: Option<String>,
    /// Whether it has a file. Indexes of earlier versions do not say it.
    #[serde(skip_deserializing)]
    status: EmbedStatus,
    /// The reason why there is no file.
    reason: Option<String>,
}

/// The outcome for a shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum EmbedStatus {
    #[default]
    Embedded,
    Failed,
}

impl IndexLine {
    /// The line of a shape that has a file.
    pub(super) fn written(id: &str, source: &str, given: Option<&Path>) -> Self {
        Self {
            id: id.to_owned(),
            source: source.to_owned(),
            given: given.map(|path| path.display().to_string()),
            file: Some(format!("{id}.npz")),
            status: EmbedStatus::Embedded,
            reason: None,
        }
    }

    /// The line of an input that could not be embedded.
    pub(super) fn failed(source: &str, given: Option<&Path>, error: &anyhow::Error) -> Self {
        Self {
            id: source.to_owned(),
            source: source.to_owned(),
            given: given.map(|path| path.display().to_string()),
            file: None,
            status: EmbedStatus::Failed,
            reason: Some(format!("{error:#}")),
        }
    }

    /// Whether both are of one input. Two data sets may have sources of the same name.
    fn has_input_of(&self, other: &Self) -> bool {
        let is_given_alike = match (&self.given, &other.given) {
            (Some(one), Some(other)) => one == other,
            _ => true,
        };
        self.source == other.source && is_given_alike
    }

    /// Whether there is no file.
    pub(super) fn is_failed(&self) -> bool {
        self.file.is_none()
    }
}

impl fmt::Display for IndexLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reason = self.reason.as_deref().unwrap_or("embedded");
        write!(f, "{}: {reason}", self.source)
    }
}

/// The lines of a folder, in the order of the ids. A folder without an index has none.
///
/// # Errors
/// If the index cannot be read.
pub(super) fn read_index(folder: &Path) -> Result<Vec<IndexLine>> {
    let path = folder.join(FILE);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))?;
    let read = |(number, line)| {
        let mut line: IndexLine = serde_json::from_str(line).with_context(|| {
            format!(
                "{}, line {number}, is not a line of an index",
                path.display()
            )
        })?;
        if line.is_failed() {
            line.status = EmbedStatus::Failed;
        }
        Ok(line)
    };
    (1..).zip(text.lines()).map(read).collect()
}

/// Writes the index of a folder. Lines of previous calls are kept, unless a line with the same id replaces them, their file was
/// removed, an input that failed was tried again, or their input cannot be embedded any more.
///
/// # Errors
/// If the index cannot be written.
pub(super) fn write_index(folder: &Path, lines: &[IndexLine]) -> Result<()> {
    let kept = current(read_index(folder)?, folder, lines);
    write_lines(folder, kept.iter().chain(lines))
}

/// Removes the lines of previous calls whose inputs cannot be embedded any more from the index, if there is one. `lines` are those
/// of the failed inputs, which are not added.
///
/// # Errors
/// If the index cannot be written.
pub(super) fn drop_outdated(folder: &Path, lines: &[IndexLine]) -> Result<()> {
    let former = read_index(folder)?;
    let n_lines = former.len();
    let kept = current(former, folder, lines);
    if kept.len() < n_lines {
        write_lines(folder, kept.iter())?;
    }
    Ok(())
}

/// The former lines that are still right after a call with these lines.
fn current(mut former: Vec<IndexLine>, folder: &Path, lines: &[IndexLine]) -> Vec<IndexLine> {
    let is_tried_again = |former: &IndexLine| {
        let of_source = lines.iter().filter(|line| line.has_input_of(former));
        let mut of_source = of_source.map(IndexLine::is_failed);
        of_source.any(|has_failed| has_failed || former.is_failed())
    };
    let is_gone = |former: &IndexLine| {
        let file = former.file.as_ref();
        file.is_some_and(|file| !folder.join(file).is_file())
    };
    former.retain(|former| !is_tried_again(former) && !is_gone(former));
    former
}

/// Writes the lines in the order of their ids. Of lines with one id, it writes the last.
fn write_lines<'a>(folder: &Path, lines: impl Iterator<Item = &'a IndexLine>) -> Result<()> {
    let by_id: BTreeMap<&str, &IndexLine> = lines.map(|line| (line.id.as_str(), line)).collect();
    let lines: Vec<&IndexLine> = by_id.into_values().collect();
    Ok(write_atomically(&folder.join(FILE), &json_lines(&lines)?)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_earlier_calls_stay_unless_they_are_replaced_or_gone() {
        let folder = tempfile::tempdir().unwrap();
        let failed = |source: &str| IndexLine::failed(source, None, &anyhow::anyhow!("damaged"));
        let kept = IndexLine::written("b__s0", "b.step", None);
        let removed = IndexLine::written("d__s0", "d.step", None);
        fs::write(folder.path().join("b__s0.npz"), "").unwrap();
        write_index(
            folder.path(),
            &[failed("a.step"), failed("c.step"), kept.clone(), removed],
        )
        .unwrap();

        let embedded = IndexLine::written("a__s0", "a.step", None);
        write_index(folder.path(), std::slice::from_ref(&embedded)).unwrap();
        let lines = read_index(folder.path()).unwrap();
        assert_eq!(lines, [embedded, kept, failed("c.step")]);

        // An input that can no longer be read has no embedding.
        write_index(folder.path(), &[failed("b.step")]).unwrap();
        let lines = read_index(folder.path()).unwrap();
        assert_eq!(lines, [failed("b.step"), failed("c.step")]);
        let text = fs::read_to_string(folder.path().join(FILE)).unwrap();
        assert_eq!(text.matches(r#""status":"failed""#).count(), 2, "{text}");
    }
}
