//! Determines which files are meshes and point clouds, and which file next to them has their labels.
//!
//! | shape | labels next to it, the first that exists |
//! |---|---|
//! | `chair.obj`, `.ply`, `.stl`, `.off`, `.npy`, `.txt`, `.xyz`, `.pts` | `chair_labels.npy`, `chair_labels.txt`, `chair.seg` |
//! | `pts-10000.txt` (PartNet) | `label-10000.txt` |

/// Endings of meshes and clouds.
const ENDINGS: &[&str] = &["obj", "ply", "stl", "off", "npy", "txt", "xyz", "pts"];
/// The endings that replace the ending of a shape's file in the name of its file of labels.
const LABEL_ENDINGS: &[&str] = &["_labels.npy", "_labels.txt", ".seg"];
/// The prefixes of the names of points and of labels in PartNet.
const PARTNET: [&str; 2] = ["pts-", "label-"];

/// The ending of a file in lower case, without its dot. It is empty if there is none.
pub(super) fn ending_of(name: &str) -> String {
    let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
    ending.to_ascii_lowercase()
}

/// The name of a mesh or a cloud without its ending. Returns `None` if the name is not that of a mesh or a cloud.
///
/// Files of labels are not meshes or clouds, although they may have the same endings.
#[must_use]
pub fn given_stem(name: &str) -> Option<&str> {
    let (stem, ending) = name.rsplit_once('.')?;
    let is_known = ENDINGS
        .iter()
        .any(|known| known.eq_ignore_ascii_case(ending));
    (is_known && !stem.is_empty() && !is_label_name(name)).then_some(stem)
}

/// Whether a file is a mesh or a cloud, by its name.
#[must_use]
pub fn is_given_name(name: &str) -> bool {
    given_stem(name).is_some()
}

/// The possible names of the file with the labels of this shape. The preferred one comes first.
#[must_use]
pub fn label_names_of(name: &str) -> Vec<String> {
    let Some(stem) = given_stem(name) else {
        return Vec::new();
    };
    let [points, labels] = PARTNET;
    let of_partnet = stem
        .strip_prefix(points)
        .map(|number| format!("{labels}{number}.txt"));
    let own = LABEL_ENDINGS.iter().map(|ending| format!("{stem}{ending}"));
    own.chain(of_partnet).collect()
}

fn is_label_name(name: &str) -> bool {
    let [_, labels] = PARTNET;
    let is_of_partnet = name.starts_with(labels) && name.ends_with(".txt");
    is_of_partnet || LABEL_ENDINGS.iter().any(|ending| name.ends_with(ending))
}

/// Whether a text begins with a row of at least three numbers, so it may be a cloud.
///
/// `start` is the beginning of the file. It may end inside a row.
#[must_use]
pub fn holds_rows_of_numbers(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let first = text.lines().find(|line| !line.trim().is_empty());
    let words = first.unwrap_or_default().split([' ', '\t', ',', ';', '\r']);
    let mut words = words.filter(|word| !word.is_empty()).peekable();
    let mut n_numbers = 0;
    while let Some(word) = words.next() {
        // The last word may be cut off.
        let is_last = words.peek().is_none();
        if word.parse::<f64>().is_err() && !(is_last && n_numbers >= 3) {
            return false;
        }
        n_numbers += 1;
    }
    n_numbers >= 3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_shapes_and_labels_are_distinguished() {
        for (name, stem) in [
            ("chair.obj", Some("chair")),
            ("a.b.PLY", Some("a.b")),
            ("pts-10000.txt", Some("pts-10000")),
            ("label-10000.txt", None),
            ("chair_labels.npy", None),
            ("chair.seg", None),
            ("chair.step", None),
            (".obj", None),
            ("obj", None),
        ] {
            assert_eq!(given_stem(name), stem, "{name}");
        }
        let own = ["chair_labels.npy", "chair_labels.txt", "chair.seg"];
        assert_eq!(label_names_of("chair.stl"), own);
        let last = label_names_of("pts-10000.txt").pop();
        assert_eq!(last.as_deref(), Some("label-10000.txt"));
        assert_eq!(label_names_of("chair.step"), [""; 0]);
    }

    #[test]
    fn clouds_are_distinguished_from_other_texts() {
        for text in ["0 1 2\n", "\n-1e3,2.5;7 0 0 1 4\r\n", "1 2 3 4.5e"] {
            assert!(holds_rows_of_numbers(text.as_bytes()), "{text}");
        }
        for text in [
            "",
            "1 2\n",
            "x y z\n1 2 3\n",
            "1 2 three\n4 5 6\n",
            "02691156/a.obj\n",
        ] {
            assert!(!holds_rows_of_numbers(text.as_bytes()), "{text}");
        }
    }
}
