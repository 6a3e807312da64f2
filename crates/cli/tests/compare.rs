//! Tests `partprobe compare`, `sources --data` and `tessellation` as a user runs them: values that are known by hand,
//! files that do not depend on the number of threads, and every refusal.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod folder;
mod program;

use folder::contents;
use partprobe_synth::{SynthSettings, fixtures, part};
use program::check;
use std::fs;
use std::path::Path;

/// Six generated parts in the folder `parts`.
fn corpus() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("parts")).unwrap();
    let settings = SynthSettings {
        seed: 3,
        min_parts: 4,
        max_parts: 12,
    };
    for index in 0..6 {
        let part = part(&settings, index);
        fs::write(
            folder.path().join(format!("parts/{}.step", part.name)),
            part.step,
        )
        .unwrap();
    }
    folder
}

/// A block with sides 4, 3 and 2: six planes, each a part.
fn block() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(
        folder.path().join("block.step"),
        fixtures::cuboid([4.0, 3.0, 2.0]),
    )
    .unwrap();
    folder
}

fn run(folder: &Path, arguments: &str, code: i32, error: &str) -> String {
    check(
        folder,
        &arguments.split(' ').collect::<Vec<&str>>(),
        code,
        error,
    )
}

#[test]
fn a_damaged_carrier_is_named_and_ends_in_1_after_everything_else_is_printed() {
    let folder = corpus();
    run(folder.path(), "label parts --out data", 0, "");
    let carrier = program::index(&folder.path().join("data"))[0]["file"].clone();
    let carrier = folder.path().join("data").join(carrier.as_str().unwrap());
    fs::write(carrier, b"PK").unwrap();
    for arguments in [
        "compare step-parts brep-face --data data --points 100",
        "sources step-parts brep-face --data data --points 100",
        "calibrate data",
    ] {
        let message = run(
            folder.path(),
            arguments,
            1,
            "1 carrier cannot be used; everything else is written",
        );
        assert!(message.contains("| "), "{arguments}: no table in {message}");
    }
}

/// The lines of `shapes.jsonl`.
fn rows(folder: &Path) -> Vec<serde_json::Value> {
    let text = fs::read_to_string(folder.join("shapes.jsonl")).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

#[test]
fn a_source_agrees_with_itself_everywhere() {
    let folder = corpus();
    run(
        folder.path(),
        "compare step-parts step-parts --data parts --points 3000 --out same --channel index --channel nn-vertex",
        0,
        "",
    );
    let rows = rows(&folder.path().join("same"));
    assert_eq!(rows.len(), 12);
    for row in &rows {
        // Through a channel that loses labels, the reference reaches its ceiling and no more.
        assert_eq!(row["accuracy"], row["ceiling"]["accuracy"], "{row}");
        assert_eq!(row["miou"], row["ceiling"]["miou"], "{row}");
        if row["channel"] == "index" {
            assert_eq!(
                (&row["accuracy"], &row["miou"], &row["ari"]),
                (&1.0.into(), &1.0.into(), &1.0.into())
            );
            assert_eq!((&row["n_merges"], &row["n_splits"]), (&0.into(), &0.into()));
            assert!(
                row["boundary"]
                    .as_array()
                    .unwrap()
                    .iter()
                    .all(|band| *band == 1.0),
                "{row}"
            );
        }
    }
    let lossy = rows.iter().filter(|row| row["channel"] == "nn-vertex");
    assert!(
        lossy
            .into_iter()
            .any(|row| row["accuracy"].as_f64().unwrap() < 1.0)
    );
}

#[test]
fn one_label_for_a_block_scores_what_its_largest_face_covers() {
    let folder = block();
    run(
        folder.path(),
        "compare step-parts solid --data block.step --points 20000 --out one",
        0,
        "",
    );
    let [row] = &rows(&folder.path().join("one"))[..] else {
        panic!("one shape, one source, one channel")
    };
    // The faces have areas 12, 12, 8, 8, 6 and 6: the label is matched to one of the largest.
    let accuracy = row["accuracy"].as_f64().unwrap();
    assert!((accuracy - 12.0 / 52.0).abs() < 0.02, "{row}");
    // The union of a part with a label of all points is all points, and five parts have no label.
    let miou = row["miou"].as_f64().unwrap();
    assert!((miou - accuracy / 6.0).abs() < 1e-12, "{row}");
    assert_eq!(
        (&row["ari"], &row["n_merges"], &row["n_splits"]),
        (&0.0.into(), &5.into(), &0.into())
    );
    assert_eq!(
        (&row["n_reference"], &row["n_labels"]),
        (&6.into(), &1.into())
    );
}

#[test]
fn the_distance_to_a_border_and_the_thickness_are_those_of_the_block() {
    let folder = block();
    run(
        folder.path(),
        "compare step-parts brep-face --data block.step --points 20000 --out two",
        0,
        "",
    );
    let [row] = &rows(&folder.path().join("two"))[..] else {
        panic!("one shape, one source, one channel")
    };
    let counts = |key: &str| -> Vec<u64> {
        let bins = row[key].as_array().unwrap();
        bins.iter()
            .map(|bin| bin["n_points"].as_u64().unwrap())
            .collect()
    };
    // The diagonal is √29 = 5.385: the thicknesses 2, 3 and 4 are 0.371, 0.557 and 0.743 of it.
    let thickness = counts("by_thickness");
    assert_eq!(thickness[..6], [0; 6]);
    assert_eq!(thickness.iter().sum::<u64>(), 20_000);
    let thickest = thickness[7] as f64 / 20_000.0;
    assert!((thickest - 12.0 / 52.0).abs() < 0.02, "{thickness:?}");
    // A strip of width w along the border of an a × b face has the area 2 w (a + b) − 4 w².
    let width = 0.01 * 29f64.sqrt();
    let strip = |a: f64, b: f64| 2.0 * width * (a + b) - 4.0 * width * width;
    let expected = 2.0 * (strip(4.0, 3.0) + strip(4.0, 2.0) + strip(3.0, 2.0)) / 52.0;
    let within: u64 = counts("by_distance")[..3].iter().sum();
    assert!(
        (within as f64 / 20_000.0 - expected).abs() < 0.01,
        "{within} {expected}"
    );
}

#[test]
fn files_do_not_depend_on_the_number_of_threads() {
    let folder = corpus();
    run(folder.path(), "label parts --out data", 0, "");
    for (out, jobs) in [("a", 1), ("b", 3)] {
        let arguments = "step-parts ward-20 brep-face --data data --shapes 4 --points 2000 --channel nn-vertex --channel index";
        run(
            folder.path(),
            &format!("compare {arguments} --out {out} --jobs {jobs}"),
            0,
            "",
        );
        run(
            folder.path(),
            &format!(
                "sources step-parts ward-20 --data data --points 2000 --out card-{out} --jobs {jobs}"
            ),
            0,
            "",
        );
        run(
            folder.path(),
            &format!(
                "tessellation --sources step-parts --data parts --shapes 2 --points 2000 --out tess-{out} --jobs {jobs}"
            ),
            0,
            "",
        );
    }
    for name in ["", "card-", "tess-"] {
        let [a, b] = ["a", "b"].map(|out| contents(&folder.path().join(format!("{name}{out}"))));
        assert!(a.len() > 4 && a == b, "{name}: {:?}", a.keys());
    }
}

#[test]
fn a_source_that_refuses_is_named_and_the_others_are_compared() {
    let folder = block();
    let text = run(
        folder.path(),
        "compare step-parts color brep-face --data block.step --points 1000 --out some",
        0,
        "",
    );
    assert!(
        text.contains("- `color`, 1 shape, first `block`: ") && text.contains("| `brep-face` |"),
        "{text}"
    );
    let refused = fs::read_to_string(folder.path().join("some/refused.csv")).unwrap();
    assert_eq!(refused.lines().count(), 2, "{refused}");
    assert_eq!(rows(&folder.path().join("some")).len(), 1);
    run(
        folder.path(),
        "compare step-parts color --data block.step --points 1000",
        1,
        "no shape could be compared; `color` on block",
    );
    run(
        folder.path(),
        "compare color step-parts --data block.step --points 1000",
        1,
        "no shape could be compared; `color` on block",
    );
}

#[test]
fn a_card_compares_each_two_sources_and_draws_the_most_different_shapes() {
    let folder = corpus();
    let json = run(
        folder.path(),
        "sources step-parts brep-face solid --data parts --points 2000 --out card --json",
        0,
        "",
    );
    let card: serde_json::Value = serde_json::from_str(&json).unwrap();
    let names: Vec<&str> = card["sources"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["source"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["step-parts", "brep-face", "solid"]);
    assert_eq!(card["pairs"].as_array().unwrap().len(), 3);
    // One label for everything has no border, no entropy, and an index of 0 with anything else.
    let solid = &card["sources"][2];
    assert_eq!(solid["label_range"], serde_json::json!([1, 1, 1]));
    assert_eq!(
        (
            &solid["border_length"]["mean"],
            &solid["size_entropy"]["mean"]
        ),
        (&0.0.into(), &0.0.into())
    );
    assert_eq!(card["pairs"][1]["ari"]["mean"], 0.0);
    let files = contents(&folder.path().join("card"));
    let pictures = files
        .keys()
        .filter(|file| file.extension().is_some_and(|ending| ending == "png"));
    assert_eq!((files.len(), pictures.count()), (7, 5));
}

#[test]
fn parts_survive_another_tessellation() {
    let folder = corpus();
    let json = run(
        folder.path(),
        "tessellation --sources step-parts,brep-face --data parts --points 3000 --json",
        0,
        "",
    );
    let tables: serde_json::Value = serde_json::from_str(&json).unwrap();
    let tables = tables["tables"].as_array().unwrap();
    let names: Vec<(&str, &str)> = tables
        .iter()
        .map(|table| {
            (
                table["channel"].as_str().unwrap(),
                table["source"].as_str().unwrap(),
            )
        })
        .collect();
    let expected = [
        ("T1", "step-parts"),
        ("T1", "brep-face"),
        ("T2", "step-parts"),
        ("T2", "brep-face"),
        ("T1-no-tau-min", "step-parts"),
        ("T2-no-tau-min", "step-parts"),
    ];
    assert_eq!(names, expected);
    for table in tables {
        let mean = |name: &str| table["statistics"][name]["mean"].as_f64().unwrap();
        // The faces are the same; a point near an edge may lie nearest to the neighbor's triangle on a curved face.
        assert!(
            mean("accuracy") > 0.97 && mean("ceiling_accuracy") > 0.999,
            "{table}"
        );
        if table["source"] == "brep-face" {
            assert!(
                (mean("n_labels") - mean("n_reference")).abs() < 1e-12,
                "{table}"
            );
        }
    }
}

#[test]
fn impossible_values_are_refused() {
    let folder = corpus();
    run(folder.path(), "label parts --out data", 0, "");
    fs::create_dir(folder.path().join("full")).unwrap();
    fs::write(folder.path().join("full/file"), "").unwrap();
    for (arguments, error) in [
        ("compare step-parts ward-20", "give the shapes with --data"),
        ("compare step-parts --data data", "2 values required"),
        (
            "compare step-parts mine --data data",
            "`mine` is not a label source",
        ),
        (
            "compare step-parts solid solid --data data",
            "`solid` is named twice",
        ),
        (
            "compare step-parts solid --data data --out full",
            "is not empty",
        ),
        (
            "compare step-parts solid --data data --shapes 0",
            "--shapes must be at least 1",
        ),
        (
            "compare step-parts solid --data data --min-parts 9 --max-parts 3",
            "must not be larger",
        ),
        ("compare step-parts solid --data missing", "does not exist"),
        ("sources step-parts", "a card needs sources and --data"),
        ("sources --data data", "a card needs sources and --data"),
        (
            "tessellation --sources step-parts",
            "give the shapes with --data",
        ),
        (
            "tessellation --sources step-parts --data data",
            "holds no surfaces",
        ),
    ] {
        run(folder.path(), arguments, 2, error);
    }
}
