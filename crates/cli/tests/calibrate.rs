//! Tests `partprobe calibrate` as a user runs it: the same tables from STEP files and from their data set, for any number
//! of threads, with every file of `--out` and every refusal.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

use partprobe_synth::{SynthSettings, part};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs the program in a folder, expects this exit code, and gives stdout and stderr.
#[track_caller]
fn check(folder: &Path, arguments: &str, code: i32) -> [String; 2] {
    let mut command = Command::new(env!("CARGO_BIN_EXE_partprobe"));
    let output = command
        .args(arguments.split(' '))
        .current_dir(folder)
        .output()
        .unwrap();
    let texts = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert_eq!(
        output.status.code(),
        Some(code),
        "{arguments}: {}",
        texts[1]
    );
    texts
}

/// Twelve generated parts and a file that is none.
fn corpus() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("parts")).unwrap();
    for index in 0..12 {
        let part = part(
            &SynthSettings {
                seed: 3,
                min_parts: 4,
                max_parts: 20,
            },
            index,
        );
        fs::write(
            folder.path().join(format!("parts/{}.step", part.name)),
            part.step,
        )
        .unwrap();
    }
    fs::write(folder.path().join("parts/broken.step"), "ISO-10303-21;").unwrap();
    folder
}

#[test]
fn step_files_and_their_data_set_give_the_same_tables() {
    let folder = corpus();
    let [from_step, warnings] = check(folder.path(), "calibrate parts --out a --jobs 1", 0);
    assert!(
        warnings.contains("parts/broken.step") && warnings.contains("1 of 13 could not"),
        "{warnings}"
    );
    check(folder.path(), "label parts --out dataset --jobs 2", 0);
    let [from_dataset, warnings] = check(folder.path(), "calibrate dataset --out b --jobs 3", 0);
    assert_eq!(from_step, from_dataset);
    assert!(warnings.contains("1 of 13 could not"), "{warnings}");
    assert!(
        from_step.starts_with("12 shapes") && from_step.contains("widest around 8°"),
        "{from_step}"
    );
    for file in [
        "calibration.md",
        "calibration.json",
        "histogram.csv",
        "sweep.csv",
        "histogram.svg",
        "sweep.svg",
    ] {
        let [a, b] = ["a", "b"].map(|out| fs::read(folder.path().join(out).join(file)).unwrap());
        assert!(!a.is_empty() && a == b, "{file}");
    }
}

#[test]
fn json_contains_the_angles_of_the_files() {
    let folder = corpus();
    let [json, _] = check(
        folder.path(),
        "calibrate parts --json --thetas 8,0.001,179 --tolerance 0",
        0,
    );
    let tables: serde_json::Value = serde_json::from_str(&json).unwrap();
    let rows = tables["sweep"].as_array().unwrap();
    let column =
        |key: &str| -> Vec<f64> { rows.iter().map(|row| row[key].as_f64().unwrap()).collect() };
    assert_eq!(column("theta_deg"), [0.001, 8.0, 179.0]);
    assert_eq!(rows[1]["n_changed"], 0);
    let parts: Vec<f64> = rows
        .iter()
        .map(|row| row["n_parts"]["mean"].as_f64().unwrap())
        .collect();
    assert!(parts[0] >= parts[1] && parts[1] > parts[2], "{parts:?}");
    let bins: u64 = tables["histogram"]["edge_bins"]
        .as_array()
        .unwrap()
        .iter()
        .map(|n| n.as_u64().unwrap())
        .sum();
    let edges = &tables["histogram"]["edges"];
    assert_eq!(
        bins + edges["n_undefined"].as_u64().unwrap(),
        edges["n"].as_u64().unwrap()
    );
}

#[test]
fn impossible_values_are_refused() {
    let folder = corpus();
    fs::create_dir(folder.path().join("nothing")).unwrap();
    for (arguments, error) in [
        ("calibrate nothing", "there is no"),
        ("calibrate missing", "does not exist"),
        ("calibrate parts --thetas 4,200", "must be from 0 to 180"),
        ("calibrate parts --tolerance 1", "must be from 0 to below 1"),
        ("calibrate parts --out parts", "is not empty"),
    ] {
        let [_, message] = check(folder.path(), arguments, 2);
        assert!(message.contains(error), "{arguments}: {message}");
    }
    let [_, message] = check(folder.path(), "calibrate parts/broken.step", 1);
    assert!(message.contains("no shape has a carrier"), "{message}");
}
