//! Tests `partprobe extract`: a small file around a face of a generated part, what is said of it, and what is refused.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

#[allow(dead_code, reason = "other tests use the rest of it")]
mod program;

use partprobe_synth::{SynthSettings, part};
use program::{check, program};
use std::fs;
use std::io::Write;
use tempfile::TempDir;

/// A folder with a generated part, and the numbers of its faces.
fn folder() -> (TempDir, Vec<u64>) {
    let folder = tempfile::tempdir().unwrap();
    let step = part(
        &SynthSettings {
            seed: 3,
            min_parts: 2,
            max_parts: 12,
        },
        1,
    )
    .step;
    fs::write(folder.path().join("part.step"), &step).unwrap();
    let of_face = |line: &&str| line.contains("=ADVANCED_FACE(");
    let id = |line: &str| line[1..line.find('=').unwrap()].parse().unwrap();
    (folder, step.lines().filter(of_face).map(id).collect())
}

#[test]
fn every_face_of_a_part_can_be_cut_out() {
    let (folder, faces) = folder();
    for face in faces {
        let id = format!("#{face}");
        let report = check(
            folder.path(),
            &["extract", "part.step", &id, "-o", "small.step"],
            0,
            "",
        );
        assert!(
            report.contains("\nthe extract shows what the file shows"),
            "{report}"
        );
        assert!(report.contains(&format!("\n  {id} is #")), "{report}");
        let small = fs::read_to_string(folder.path().join("small.step")).unwrap();
        assert_eq!(small.matches("=ADVANCED_FACE(").count(), 1);
        assert!(
            small.contains("FILE_NAME('','',(''),(''),'','','');"),
            "{small}"
        );
    }
}

#[test]
fn numbers_can_be_kept_and_stdout_contains_only_the_file() {
    let (folder, faces) = folder();
    let id = format!("#{}", faces[0]);
    let cut = |more: &[&str]| {
        check(
            folder.path(),
            &[&["extract", "part.step", &id, "-o", "-"], more].concat(),
            0,
            "",
        )
    };
    let (renumbered, kept) = (cut(&[]), cut(&["--keep-ids"]));
    assert!(renumbered.starts_with("ISO-10303-21;") && renumbered.ends_with("END-ISO-10303-21;\n"));
    assert!(renumbered.contains("\n#1=") && kept.contains(&format!("\n{id}=ADVANCED_FACE(")));
    assert_eq!(cut(&[]), renumbered);
    let arguments = ["extract", "part.step", &id, "-o", "-"];
    let stderr =
        String::from_utf8(program(folder.path(), &arguments).output().unwrap().stderr).unwrap();
    assert!(
        stderr.contains("the extract shows what the file shows"),
        "{stderr}"
    );
}

#[test]
fn entities_that_cannot_be_cut_out_are_named() {
    let (folder, faces) = folder();
    let face = format!("#{}", faces[0]);
    let refused = |arguments: &[&str], code: i32, error: &str| {
        check(
            folder.path(),
            &[&["extract"], arguments].concat(),
            code,
            error,
        );
    };
    refused(
        &["part.step", "#999999", "-o", "small.step"],
        1,
        "the file has no #999999; its numbers run from #1 to #",
    );
    refused(
        &["part.step", "face", "-o", "small.step"],
        2,
        "'face' is not the number of an entity; write it as '#123'",
    );
    refused(
        &["missing.step", "#1", "-o", "small.step"],
        1,
        "missing.step: opening the file",
    );
    refused(
        &["part.step", &face, "-o", "part.step"],
        2,
        "part.step is the file that is cut; choose another -o",
    );
    refused(
        &["part.step", &face, "-o", "nowhere/small.step"],
        1,
        "writing nowhere/small.step",
    );
    assert!(!folder.path().join("small.step").exists());
}

#[test]
fn a_file_in_any_container_and_encoding_gives_the_same_extract() {
    let (folder, faces) = folder();
    let path = folder.path();
    let id = format!("#{}", faces[0]);
    let step = fs::read_to_string(path.join("part.step")).unwrap();
    let utf16 =
        |order: fn(u16) -> [u8; 2]| step.encode_utf16().flat_map(order).collect::<Vec<u8>>();
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(step.as_bytes()).unwrap();
    // Some programs break lines after so many characters, wherever that is.
    let folded: String = step
        .replace(['\n', '\r'], "")
        .as_bytes()
        .chunks(80)
        .map(|line| format!("{}\n", String::from_utf8_lossy(line)))
        .collect();
    let cut = |name: &str| {
        check(
            path,
            &["extract", name, &id, "-o", "-"],
            0,
            "the extract shows what the file shows",
        )
    };
    let expected = cut("part.step");
    for (name, bytes) in [
        (
            "little.step",
            [vec![0xff, 0xfe], utf16(u16::to_le_bytes)].concat(),
        ),
        (
            "big.step",
            [vec![0xfe, 0xff], utf16(u16::to_be_bytes)].concat(),
        ),
        ("packed.stpz", gzip.finish().unwrap()),
        ("folded.step", folded.into_bytes()),
    ] {
        fs::write(path.join(name), bytes).unwrap();
        assert_eq!(cut(name), expected, "{name}");
    }
    for (name, code, error) in [
        (".", 1, "it is a folder, not a file"),
        ("gone.step", 1, "opening the file"),
    ] {
        check(
            path,
            &["extract", name, &id, "-o", "small.step"],
            code,
            error,
        );
    }
}
