//! Tests the list of label sources, and that every name on it labels a part.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot run the program has failed"
)]

mod program;

use program::check;
use std::fs;

#[test]
fn every_source_is_listed_with_its_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let table = check(folder.path(), &["sources"], 0, "");
    let rows: Vec<serde_json::Value> =
        serde_json::from_str(&check(folder.path(), &["sources", "--json"], 0, "")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), rows.len() + 2, "{table}");
    assert_eq!(lines[0], "| source | number | labels |");

    for (line, row) in lines[2..].iter().zip(&rows) {
        let [name, description] = ["name", "description"].map(|key| row[key].as_str().unwrap());
        assert!(
            line.starts_with(&format!("| {name} |"))
                && line.ends_with(&format!("| {description} |")),
            "{line}"
        );
        let has_number = name.ends_with('>') && !name.ends_with("<SOURCE>");
        assert_eq!(has_number, row["numbers"].is_array(), "{row}");
    }
    assert!(
        rows.iter().any(|row| row["name"] == "normal-kmeans-<K>"
            && row["numbers"] == serde_json::json!([1, 1000]))
    );
    assert_eq!(rows[0]["name"], "step-parts");
    let of_faces =
        |name: &str| rows.iter().find(|row| row["name"] == name).unwrap()["labels_faces"].clone();
    assert_eq!([of_faces("color"), of_faces("ward-<K>")], [true, false]);
}

#[test]
fn every_listed_source_labels_a_part_or_says_why_not() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(
        folder.path().join("block.step"),
        partprobe_synth::fixtures::filleted_block([4.0, 3.0, 2.0], 0.5, 0.2),
    )
    .unwrap();
    check(
        folder.path(),
        &["label", "block.step", "--out", "data"],
        0,
        "",
    );
    let rows: Vec<serde_json::Value> =
        serde_json::from_str(&check(folder.path(), &["sources", "--json"], 0, "")).unwrap();
    for row in rows {
        let pattern = row["name"].as_str().unwrap();
        let number = match pattern {
            _ if row["numbers"].is_array() => "20",
            _ if pattern.ends_with("<SOURCE>") => "brep-face",
            _ => "",
        };
        let name = format!("{}{number}", pattern.split('<').next().unwrap());
        let arguments = [
            "sample",
            "data",
            "--out",
            &name,
            "--format",
            "npz",
            "--n-points",
            "100",
            "--source",
            &name,
        ];
        // The fixture has neither colors nor names.
        let (code, reason) = match pattern {
            "color" | "name" => (1, "no face has a"),
            "given" => (1, "a STEP file gives no labels"),
            _ => (0, ""),
        };
        check(folder.path(), &arguments, code, reason);
    }
}
