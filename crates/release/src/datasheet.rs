//! Writes `DATASHEET.md`: the content, the making, the purpose and the limits of a package.

use crate::manifest::Manifest;
use std::fmt::Write;

/// A reason why files or solids have no labels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unlabeled {
    /// The status of labeling, as in the index of a data set.
    pub status: String,
    /// The reason. The datasheet shows it without numbers and quoted texts.
    pub reason: String,
    /// The number of files or solids with this reason.
    pub n: u64,
}

/// The facts of a datasheet in addition to the manifest.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DatasheetFacts {
    /// Files and solids without labels, by reason, the most frequent first.
    pub unlabeled: Vec<Unlabeled>,
    /// Faces, loops and entities of labeled files that could not be read.
    pub n_lost: u64,
}

/// The text of the datasheet. It depends only on the arguments.
#[must_use]
pub fn datasheet(manifest: &Manifest, facts: &DatasheetFacts) -> String {
    [
        head(manifest),
        numbers(manifest, facts),
        unlabeled(manifest, facts),
        settings(manifest),
        uses(),
        content(manifest),
    ]
    .join("\n")
}

fn head(manifest: &Manifest) -> String {
    let commit = match &manifest.commit {
        Some(commit) => format!(" The package was made by commit {commit}."),
        None => String::new(),
    };
    format!(
        "# Datasheet\n\n\
         Part labels of {} STEP files, without their geometry. Labeled by partprobe {}.{commit}\n",
        manifest.counts.n_files, manifest.program_version
    )
}

fn numbers(manifest: &Manifest, facts: &DatasheetFacts) -> String {
    let counts = &manifest.counts;
    let mut text = "## Numbers\n\n| what | number |\n|---|---:|\n".to_owned();
    let rows = [
        ("files with labels", counts.n_files),
        ("shapes with labels", counts.n_shapes),
        ("faces", counts.n_faces),
        ("shared edges", counts.n_edges),
        (
            "shared edges without a defined angle",
            counts.n_undefined_angles,
        ),
        ("parts", counts.n_parts),
        ("parts after small ones were absorbed", counts.n_labels),
        (
            "faces, loops and entities of these files that could not be read",
            facts.n_lost,
        ),
    ];
    for (name, n) in rows {
        // Writing to a string does not fail.
        let _ = writeln!(text, "| {name} | {n} |");
    }
    text.push_str("\n| primitive type | faces |\n|---|---:|\n");
    for (name, n) in &counts.faces_by_type {
        let _ = writeln!(text, "| {name} | {n} |");
    }
    text
}

fn unlabeled(manifest: &Manifest, facts: &DatasheetFacts) -> String {
    let mut text = "## Files and solids without labels\n\n".to_owned();
    if facts.unlabeled.is_empty() {
        if manifest.counts.left_out.is_empty() {
            text.push_str("Every file that was given has labels.\n");
        }
    } else {
        text.push_str("| status | reason | number |\n|---|---|---:|\n");
        for Unlabeled { status, reason, n } in &facts.unlabeled {
            let reason = without_values(reason).replace('|', "\\|");
            let _ = writeln!(text, "| {status} | {reason} | {n} |");
        }
    }
    for (reason, n) in &manifest.counts.left_out {
        let _ = writeln!(text, "\nNot in the package: {n} ({reason}).");
    }
    text
}

/// The reason with `…` instead of each number and quoted text, so that no coordinate and no name is released.
fn without_values(reason: &str) -> String {
    let mut text = String::new();
    for (position, piece) in reason.split('`').enumerate() {
        if position % 2 == 1 {
            text.push_str("`…`");
            continue;
        }
        let mut is_in_number = false;
        for c in piece.chars() {
            let is_digit = c.is_ascii_digit();
            match (is_digit, is_in_number) {
                (true, false) => text.push('…'),
                (true, true) => {}
                (false, _) => text.push(c),
            }
            is_in_number = is_digit;
        }
    }
    text
}

fn settings(manifest: &Manifest) -> String {
    let json = serde_json::to_string_pretty(&manifest.settings).unwrap_or_default();
    format!(
        "## Settings\n\nThe SHA-256 of the settings that decide the labels is `{}`.\n\n```json\n{json}\n```\n",
        manifest.settings_sha256
    )
}

fn uses() -> String {
    "\
## What it is for

- To train and to compare networks on the same labels as others, without publishing the STEP files. `partprobe attach` joins
  the package with the files, and makes the labeled meshes again.
- To compare label sets: `partprobe registry` joins packages by the hash of the STEP text.

## What it is not

- The labels are not made by people. They follow a rule: a part is a connected set of faces of one primitive type that meet at
  a dihedral angle of at most theta. A part is not a functional unit, a machining feature or a product.
- It is not a data set by itself: without the STEP files there is no shape.
- It does not say who made a file, or under which license.
"
    .to_owned()
}

fn content(manifest: &Manifest) -> String {
    let names = if manifest.is_anonymous {
        "- No name of a file: ids are made from the hash of the STEP text."
    } else {
        "- The name of each file without its folders, and the ids of its shapes, which contain its path below the folder that was \
         labeled."
    };
    let layers = match manifest.layers.as_slice() {
        [] => String::new(),
        layers => format!("\n- Per face: the labels of {}.", layers.join(", ")),
    };
    format!(
        "\
## What is inside

- Per file: the SHA-256 of its STEP text, and how labeling ended.
{names}
- Per face: its `#` number in the STEP file, its occurrence, its primitive type, its part.{layers}
- Per shared edge: its two faces and the dihedral angle.

There is no coordinate, no area, no length, no color, and no name of a product or a face inside.
"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manifest::{Counts, PACKAGE_VERSION};
    use std::collections::BTreeMap;

    #[test]
    fn reasons_omit_numbers_and_names() {
        for (reason, expected) in [
            ("no face", "no face"),
            ("#12 is at (1.5, 20)", "#… is at (….…, …)"),
            ("`Housing 3` is empty", "`…` is empty"),
            ("an open ` quote", "an open `…`"),
        ] {
            assert_eq!(without_values(reason), expected);
        }
    }

    #[test]
    fn the_facts_of_the_package_are_in_the_text() {
        let manifest = Manifest {
            format_version: PACKAGE_VERSION,
            program_version: "0.1.0".to_owned(),
            commit: Some("abc123".to_owned()),
            is_anonymous: false,
            license: None,
            settings_sha256: "feed".to_owned(),
            settings: serde_json::json!({ "label": { "theta_deg": 8.0 } }),
            layers: vec!["smooth-12".to_owned()],
            counts: Counts {
                n_files: 17,
                faces_by_type: [("cone".to_owned(), 5)].into(),
                left_out: [("a mesh has no STEP faces".to_owned(), 2)].into(),
                ..Counts::default()
            },
            files: BTreeMap::new(),
        };
        let facts = DatasheetFacts {
            unlabeled: vec![Unlabeled {
                status: "failed".to_owned(),
                reason: "a | b".to_owned(),
                n: 3,
            }],
            n_lost: 41,
        };
        let text = datasheet(&manifest, &facts);
        for expected in [
            "labels of 17 STEP files",
            "Labeled by partprobe 0.1.0. The package was made by commit abc123.",
            "| cone | 5 |",
            "| failed | a \\| b | 3 |",
            "Not in the package: 2 (a mesh has no STEP faces).",
            "\"theta_deg\": 8.0",
            "`feed`",
            "the labels of smooth-12",
            "that could not be read | 41 |",
            "The name of each file",
        ] {
            assert!(text.contains(expected), "`{expected}` is not in {text}");
        }
        let anonymous = Manifest {
            is_anonymous: true,
            ..manifest
        };
        let text = datasheet(&anonymous, &DatasheetFacts::default());
        assert!(text.contains("No name of a file"), "{text}");
        // Two shapes are left out, so not every file has labels.
        assert!(!text.contains("Every file"), "{text}");
        let mut complete = anonymous;
        complete.counts.left_out.clear();
        let text = datasheet(&complete, &DatasheetFacts::default());
        assert!(
            text.contains("Every file that was given has labels"),
            "{text}"
        );
    }
}
