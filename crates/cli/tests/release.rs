//! Tests `release`, `attach` and `registry` by the real program: a package without geometry makes the same carriers again,
//! and other files are refused.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod folder;
mod program;

use folder::contents;
use partprobe_release::{Manifest, rows_from_parquet, rows_to_parquet};
use partprobe_synth::{SynthSettings, part};
use program::{check, index};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// `steps/` with four parts, one of them twice, and a file that is none; the data set `d/`, and the package `p/`.
fn released(label: &[&str], release: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir_all(path.join("steps/sub")).unwrap();
    let settings = SynthSettings {
        seed: 3,
        min_parts: 2,
        max_parts: 12,
    };
    for index in 0..4 {
        let text = part(&settings, index).step;
        fs::write(path.join(format!("steps/p{index}.step")), text).unwrap();
    }
    fs::copy(path.join("steps/p0.step"), path.join("steps/sub/twin.step")).unwrap();
    fs::write(path.join("steps/bad.step"), "hello").unwrap();
    fs::write(path.join("steps/notes.txt"), "mine").unwrap();
    check(
        path,
        &[&["label", "steps", "--out", "d"], label].concat(),
        0,
        "",
    );
    check(
        path,
        &[&["release", "d", "--out", "p"], release].concat(),
        0,
        "",
    );
    folder
}

/// The carriers of a data set, by name.
fn carriers(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = contents(folder);
    files.retain(|name, _| name.extension().is_some_and(|ending| ending == "npz"));
    assert!(!files.is_empty());
    files
}

fn manifest(folder: &Path) -> Manifest {
    Manifest::parse(&fs::read(folder.join("p/release.json")).unwrap()).unwrap()
}

#[test]
fn a_package_makes_the_same_data_set_again() {
    for label in [
        &[][..],
        &["--unit", "solid"],
        &["--layers", "brep-face,smooth-12", "--compress"],
        &["--set", "label.theta_deg=20", "--set", "label.tau_min=0"],
    ] {
        let folder = released(label, &[]);
        let path = folder.path();
        let message = check(path, &["attach", "p", "steps", "--out", "again"], 0, "");
        assert!(
            message.contains("5 shapes attached")
                && message.contains(
                    "ones: 5 of 5\nwithout labels, as in the package: 1\nnot attached: 0"
                ),
            "{message}"
        );
        assert_eq!(carriers(&path.join("again")), carriers(&path.join("d")));
        assert_eq!(index(&path.join("again")), index(&path.join("d")));
    }
}

#[test]
fn files_are_found_by_their_text_under_any_name() {
    let folder = released(&[], &[]);
    let path = folder.path();
    fs::create_dir(path.join("other")).unwrap();
    fs::rename(path.join("steps/p1.step"), path.join("other/renamed.stp")).unwrap();
    fs::rename(path.join("steps/sub/twin.step"), path.join("other/a.step")).unwrap();
    let mut tar = tar::Builder::new(fs::File::create(path.join("other/more.tar")).unwrap());
    tar.append_path_with_name(path.join("steps/p2.step"), "x/y.step")
        .unwrap();
    tar.finish().unwrap();
    drop(tar);
    let message = check(path, &["attach", "p", "other", "--out", "again"], 0, "");
    assert!(
        message.contains("3 shapes attached") && message.contains("not given: 3"),
        "{message}"
    );
    let expected = carriers(&path.join("d"));
    let attached: Vec<Vec<u8>> = carriers(&path.join("again")).into_values().collect();
    assert!(
        attached
            .iter()
            .all(|bytes| expected.values().any(|e| e == bytes))
    );
    // The file that is there once gets the first of the two ids that its text has.
    let ids: Vec<String> = index(&path.join("again"))
        .iter()
        .map(|line| line["id"].as_str().unwrap().to_owned())
        .collect();
    assert_eq!(ids, ["steps__p0", "steps__p2", "steps__p1"]);
}

#[test]
fn other_files_are_refused_by_name_and_the_rest_is_attached() {
    let folder = released(&[], &[]);
    let path = folder.path();
    let text = fs::read_to_string(path.join("steps/p1.step")).unwrap();
    fs::write(path.join("steps/p1.step"), format!("{text}\n")).unwrap();
    fs::copy(path.join("steps/p2.step"), path.join("steps/again.step")).unwrap();
    let attach = ["attach", "p", "steps", "--out", "again"];
    check(
        path,
        &attach,
        1,
        "steps/p1.step: the package has no file with this SHA-256",
    );
    let lines = index(&path.join("again"));
    let status = |source: &str| {
        let line = lines.iter().find(|line| line["source"] == source).unwrap();
        (
            line["status"].as_str().unwrap(),
            line["reason"].as_str().unwrap_or_default(),
        )
    };
    assert_eq!(status("steps/p0.step"), ("ok", ""));
    assert_eq!(status("steps/p1.step").0, "refused");
    assert!(status("steps/again.step").0 == "ok" || status("steps/p2.step").0 == "ok");
    let repeated = lines.iter().filter(|line| {
        let reason = line["reason"].as_str().unwrap_or_default();
        reason.contains("given more often than the package has it")
    });
    assert_eq!(repeated.count(), 1);
    // Nothing changes if the batch is resumed.
    check(
        path,
        &[&attach[..], &["--resume"]].concat(),
        1,
        "not attached",
    );
    assert_eq!(index(&path.join("again")), lines);
    check(path, &attach, 2, "is not empty");
}

/// Changes the rows of the package, and its `release.json` accordingly.
fn change_rows(folder: &Path, change: impl Fn(&mut partprobe_release::ReleasedRow)) {
    let file = folder.join("p/labels-00000.parquet");
    let mut rows = rows_from_parquet(fs::read(&file).unwrap()).unwrap();
    rows.iter_mut().for_each(change);
    let bytes = rows_to_parquet(&rows, &Default::default()).unwrap();
    let mut manifest = manifest(folder);
    let facts = partprobe_release::FileFacts::of(&bytes);
    manifest
        .files
        .insert("labels-00000.parquet".to_owned(), facts);
    fs::write(file, bytes).unwrap();
    let json = serde_json::to_vec(&manifest).unwrap();
    fs::write(folder.join("p/release.json"), json).unwrap();
}

#[test]
fn different_labels_are_a_separate_outcome() {
    let folder = released(&[], &[]);
    let path = folder.path();
    let mut step_id = 0;
    change_rows(path, |row| {
        if row.shape.id == "steps__p1"
            && let Some(labels) = &mut row.labels
        {
            labels.label[1] += 5;
            row.shape.labels_sha256 = Some(partprobe_release::labels_sha256(labels));
        }
    });
    for row in rows_from_parquet(fs::read(path.join("p/labels-00000.parquet")).unwrap()).unwrap() {
        if row.shape.id == "steps__p1" {
            step_id = row.labels.unwrap().step_id[1];
        }
    }
    check(
        path,
        &["attach", "p", "steps", "--out", "again"],
        1,
        &format!("warning: steps/p1.step: face #{step_id} has the part "),
    );
    let lines = index(&path.join("again"));
    let line = lines.iter().find(|line| line["id"] == "steps__p1").unwrap();
    assert_eq!(
        (&line["status"], &line["file"]),
        (&"differs".into(), &serde_json::Value::Null)
    );
    assert!(!path.join("again/steps__p1.npz").exists());
    assert_eq!(carriers(&path.join("again")).len(), 4);
}

#[test]
fn damaged_and_foreign_packages_are_refused() {
    let folder = released(&[], &[]);
    let path = folder.path();
    let attach = ["attach", "p", "steps", "--out", "again"];
    check(
        path,
        &["attach", "d", "steps", "--out", "again"],
        2,
        "is not a package",
    );
    let file = path.join("p/labels-00000.parquet");
    let bytes = fs::read(&file).unwrap();
    fs::write(&file, &bytes[..bytes.len() - 1]).unwrap();
    check(path, &attach, 1, "is not the file that was released");
    fs::write(&file, &bytes).unwrap();
    change_rows(path, |row| row.shape.file_id.insert_str(0, "../"));
    check(path, &attach, 1, "is not a file name");
    let json = fs::read_to_string(path.join("p/release.json")).unwrap();
    fs::write(
        path.join("p/release.json"),
        json.replace("\"tau_min\":20", "\"tau_min\":3"),
    )
    .unwrap();
    check(path, &attach, 1, "the settings do not have the hash");
    fs::write(path.join("p/release.json"), "{}").unwrap();
    check(path, &attach, 1, "`release.json` is not that of a package");
    assert!(!path.join("again").exists());
}

#[test]
fn a_package_says_what_is_in_it_and_has_the_same_bytes_for_any_number_of_threads() {
    let folder = released(&[], &["--jobs", "1", "--license", "CC0-1.0"]);
    let path = folder.path();
    let release = [
        "release",
        "d",
        "--out",
        "p3",
        "--jobs",
        "3",
        "--license",
        "CC0-1.0",
    ];
    check(path, &release, 0, "");
    assert_eq!(contents(&path.join("p3")), contents(&path.join("p")));
    check(path, &release, 2, "is not empty");
    check(
        path,
        &["release", "steps", "--out", "p4"],
        2,
        "is not a data set",
    );
    assert!(!path.join("p4").exists());

    let manifest = manifest(path);
    assert_eq!((manifest.counts.n_files, manifest.counts.n_shapes), (5, 5));
    assert_eq!(
        manifest.counts.without_labels,
        [("failed".to_owned(), 1)].into()
    );
    let text = fs::read_to_string(path.join("p/DATASHEET.md")).unwrap();
    assert!(
        text.contains("Part labels of 5 STEP files") && text.contains("| failed |"),
        "{text}"
    );
    let note = fs::read_to_string(path.join("p/LICENSE-NOTE.md")).unwrap();
    assert!(note.contains("License of the labels: CC0-1.0"));

    fs::write(path.join("d/steps__p2.npz"), "torn").unwrap();
    check(path, &["release", "d", "--out", "p5"], 1, "steps__p2");
    assert!(path.join("p5/release.json").exists());
}

#[test]
fn an_anonymous_package_has_no_names_and_can_be_attached() {
    let folder = released(&["--unit", "solid"], &["--anonymous"]);
    let path = folder.path();
    for row in rows_from_parquet(fs::read(path.join("p/labels-00000.parquet")).unwrap()).unwrap() {
        assert!(row.shape.source.is_none() && row.shape.content_hash.is_none());
        assert!(row.shape.id.starts_with("file-") && row.shape.file_id.starts_with("file-"));
    }
    for bytes in contents(&path.join("p")).into_values() {
        let text = String::from_utf8_lossy(&bytes);
        assert!(
            !text.contains("twin") && !text.contains("steps__"),
            "{text}"
        );
    }
    let message = check(path, &["attach", "p", "steps", "--out", "again"], 0, "");
    assert!(
        message.contains("5 shapes attached with equal labels\nwithout"),
        "{message}"
    );
    assert_eq!(carriers(&path.join("again")).len(), 5);
}

#[test]
fn packages_are_joined_by_hash() {
    let folder = released(&[], &[]);
    let path = folder.path();
    // A second data set of some of the files by other settings, and a third with one label that differs.
    let label = ["label", "steps/p0.step", "steps/p1.step", "--out", "d2"];
    check(
        path,
        &[&label[..], &["--set", "label.theta_deg=170"]].concat(),
        0,
        "",
    );
    check(path, &["release", "d2", "--out", "q"], 0, "");
    check(path, &["release", "d", "--out", "r"], 0, "");
    change_rows(path, |row| {
        if row.shape.id == "steps__p3"
            && let Some(labels) = &mut row.labels
        {
            labels.phi_deg[0] = Some(1.0);
            row.shape.labels_sha256 = Some(partprobe_release::labels_sha256(labels));
        }
    });
    let message = check(
        path,
        &["registry", "p", "q", "r", "--out", "joined.parquet"],
        0,
        "",
    );
    for expected in [
        "2 files have labels in 2 packages\n2 files have labels in 3 packages",
        "p and q: other settings\n  in both: 2 files, and 2 shapes of one unit\n",
        "p and r: the same settings\n  in both: 4 files, and 4 shapes of one unit\n  equal parts: 4\n  equal labels: 3\n  disagreements: 1\n    p3.step (",
    ] {
        assert!(
            message.contains(expected),
            "`{expected}` is not in {message}"
        );
    }
    let json = check(path, &["registry", "p", "q", "r", "--json"], 0, "");
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["shapes"].as_array().unwrap().len(), 4);
    assert_eq!(json["pairs"][1]["disagreements"][0]["source"], "p3.step");
    assert!(path.join("joined.parquet").exists());
    check(path, &["registry", "p", "p"], 2, "p is given twice");
    check(path, &["registry", "p", "steps"], 2, "is not a package");
}
