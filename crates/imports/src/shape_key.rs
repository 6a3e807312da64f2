//! Assigns labels to shapes by their names.
//!
//! The id of a shape is the path of its file without the ending, with `__` for `/`, and followed by `__s<n>` if solids are the
//! unit. Labels also have a path: that of their own file, or one that they contain. The two belong together if the shorter one is
//! the end of the longer one, part by part. The folders of a label file may differ from those of its STEP file, so its own name
//! is enough: `step__100` and `seg/100.seg` belong together, and `step__1100` does not.

use partprobe_formats::step_stem;
use std::collections::BTreeMap;

/// The name by which labels are assigned.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ShapeKey {
    /// The path, part by part.
    parts: Vec<String>,
    /// The number of last parts that a longer path must have at its end.
    n_decisive: usize,
}

/// Endings of label files that hide another ending.
const PACKED: &str = ".zst";

impl ShapeKey {
    /// The key of the path of a STEP file in a label file.
    pub(crate) fn of_step_path(path: &str) -> Self {
        Self::of_text(step_stem(path).unwrap_or(path))
    }

    /// The key of a label file: its path without its ending, and without the suffix that a tool appends to each name.
    pub(crate) fn of_label_path(path: &str, suffixes: &[&str]) -> Self {
        let path = path.strip_suffix(PACKED).unwrap_or(path);
        let (folder, name) = path.rsplit_once('/').unwrap_or(("", path));
        let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
        let stem = suffixes
            .iter()
            .find_map(|suffix| stem.strip_suffix(suffix))
            .unwrap_or(stem);
        // A label file may keep the ending of the STEP file: `part.step.csv`.
        let stem = step_stem(stem).unwrap_or(stem);
        let n_decisive = parts_of(stem).len();
        Self {
            n_decisive,
            ..Self::of_text(&format!("{folder}/{stem}"))
        }
    }

    /// The key of a shape, by its id.
    fn of_id(id: &str) -> Self {
        Self::of_text(without_solid(id))
    }

    fn of_text(text: &str) -> Self {
        let parts = parts_of(text);
        Self {
            n_decisive: parts.len(),
            parts,
        }
    }

    /// Whether it names nothing.
    pub(crate) fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// The last part of the path, which is the name of the shape.
    pub(crate) fn last(&self) -> Option<&str> {
        self.parts.last().map(String::as_str)
    }

    /// The number of parts that this key and that of a shape have in common at their ends. Returns `None` if this is not enough.
    fn common_end(&self, shape: &Self) -> Option<usize> {
        let pairs = self.parts.iter().rev().zip(shape.parts.iter().rev());
        let n_common = pairs.take_while(|(own, other)| own == other).count();
        let n_needed = self.n_decisive.min(shape.parts.len());
        (n_common >= n_needed && n_common > 0).then_some(n_common)
    }
}

fn parts_of(text: &str) -> Vec<String> {
    let text = text.replace('\\', "/").replace("__", "/");
    let parts = text
        .split('/')
        .filter(|part| !part.is_empty() && *part != ".");
    parts.map(str::to_owned).collect()
}

/// Whether a shape is one solid of its file.
pub(crate) fn is_solid(id: &str) -> bool {
    without_solid(id) != id
}

/// The id of the file, if this is the id of one of its solids.
fn without_solid(id: &str) -> &str {
    match id.rsplit_once("__s") {
        Some((file, number))
            if !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()) =>
        {
            file
        }
        _ => id,
    }
}

/// Finds labels by the id of their shape.
#[derive(Clone, Debug, Default)]
pub(crate) struct ShapeKeys {
    by_last: BTreeMap<String, Vec<(ShapeKey, usize)>>,
}

/// The labels of a shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    /// No labels are named after it.
    Nothing,
    /// These labels, which all have the same key.
    These(Vec<usize>),
    /// Labels with different keys that fit equally well.
    Ambiguous(Vec<usize>),
}

impl ShapeKeys {
    /// Finds labels by these keys. An answer is their index.
    pub(crate) fn new(keys: impl Iterator<Item = ShapeKey>) -> Self {
        let mut by_last: BTreeMap<String, Vec<(ShapeKey, usize)>> = BTreeMap::new();
        for (idx, key) in keys.enumerate() {
            let last = key.last().unwrap_or_default().to_owned();
            by_last.entry(last).or_default().push((key, idx));
        }
        Self { by_last }
    }

    /// The labels that are named after a shape. Of several keys, it uses the one with the longest common end.
    pub(crate) fn of_shape(&self, id: &str) -> Found {
        let shape = ShapeKey::of_id(id);
        let candidates = shape.last().and_then(|last| self.by_last.get(last));
        let fits = candidates.into_iter().flatten().filter_map(|(key, idx)| {
            let n_common = key.common_end(&shape)?;
            Some((n_common, key, *idx))
        });
        let fits: Vec<(usize, &ShapeKey, usize)> = fits.collect();
        let Some(longest) = fits.iter().map(|&(n_common, ..)| n_common).max() else {
            return Found::Nothing;
        };

        let best: Vec<_> = fits
            .into_iter()
            .filter(|&(n_common, ..)| n_common == longest)
            .collect();
        let is_one_key = best.iter().all(|(_, key, _)| *key == best[0].1);
        let indices = best.iter().map(|&(.., idx)| idx).collect();
        if is_one_key {
            Found::These(indices)
        } else {
            Found::Ambiguous(indices)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(id: &str, paths: &[&str], expected: &Found) {
        let keys = paths
            .iter()
            .map(|path| ShapeKey::of_label_path(path, &["_color_ids"]));
        assert_eq!(&ShapeKeys::new(keys).of_shape(id), expected);
    }

    #[test]
    fn the_shorter_name_is_the_end_of_the_longer() {
        let these = |indices: &[usize]| Found::These(indices.to_vec());
        check("fusion__100", &["breps/seg/100.seg"], &these(&[0]));
        check("fusion__1100", &["breps/seg/100.seg"], &Found::Nothing);
        check("abc__you__bolt", &["me__bolt.csv"], &Found::Nothing);
        check(
            "100",
            &["breps/seg/100.seg", "breps/seg/1100.seg"],
            &these(&[0]),
        );
        check("fusion__100", &["100.seg", "fusion/100.seg"], &these(&[1]));
        check("fusion__100__s12", &["fusion/100.seg"], &these(&[0]));
        check("abc__me+tools__bolt", &["me+tools__bolt.csv"], &these(&[0]));
        check("a__b.v2", &["b.v2.json", "b.json"], &these(&[0]));
        check("a__b", &["b.step.csv.zst"], &these(&[0]));
        check("0-0-0", &["0-0-0_color_ids.json"], &these(&[0]));
        check("y__b", &["x/b.csv", "y/b.csv"], &these(&[1]));
        check("b", &["x/b.csv", "y/b.csv"], &Found::Ambiguous(vec![0, 1]));
    }

    #[test]
    fn lines_of_one_file_share_a_key() {
        let keys = ["abc/a.step", "abc/b.step", "abc/a.step"].map(ShapeKey::of_step_path);
        let keys = ShapeKeys::new(keys.into_iter());
        assert_eq!(keys.of_shape("abc__a__s4"), Found::These(vec![0, 2]));
        assert_eq!(keys.of_shape("a"), Found::These(vec![0, 2]));
        assert_eq!(keys.of_shape("mfcad__a"), Found::Nothing);
    }
}
