//! Tests `label --kernel truck`: refused with the remedy where truck is not built in, and the same parts where it is.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

use partprobe_synth::{SynthSettings, part};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn label(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_partprobe"))
        .arg("label")
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Six generated parts in a folder `parts`.
fn parts() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("parts")).unwrap();
    for index in 0..6 {
        let part = part(
            &SynthSettings {
                seed: 9,
                min_parts: 2,
                max_parts: 12,
            },
            index,
        );
        fs::write(
            folder.path().join(format!("parts/{}.step", part.name)),
            part.step,
        )
        .unwrap();
    }
    folder
}

#[cfg(not(feature = "truck"))]
#[test]
fn a_program_without_truck_says_how_to_get_it() {
    let folder = parts();
    for arguments in [
        ["parts", "--out", "d", "--kernel", "truck"],
        ["parts", "--out", "d", "--set", "label.kernel=truck"],
    ] {
        let output = label(folder.path(), &arguments);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains("--features truck"), "{message}");
    }
    assert!(!folder.path().join("d").exists());
}

#[cfg(feature = "truck")]
#[test]
fn both_kernels_give_the_same_parts() {
    let folder = parts();
    for kernel in ["own", "truck"] {
        let output = label(
            folder.path(),
            &["parts", "--out", kernel, "--kernel", kernel],
        );
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
    let carriers = |kernel: &str| -> Vec<partprobe_carrier::Carrier> {
        let files = fs::read_dir(folder.path().join(kernel))
            .unwrap()
            .map(|entry| entry.unwrap().path());
        let mut files: Vec<_> = files
            .filter(|file| file.extension().is_some_and(|name| name == "npz"))
            .collect();
        files.sort();
        files
            .iter()
            .map(|file| partprobe_formats::carrier_from_npz(&fs::read(file).unwrap()).unwrap())
            .collect()
    };
    let (own, truck) = (carriers("own"), carriers("truck"));
    assert_eq!((own.len(), truck.len()), (6, 6));
    for (own, truck) in own.iter().zip(&truck) {
        let step_ids = |carrier: &partprobe_carrier::Carrier| -> Vec<u64> {
            carrier
                .graph()
                .faces
                .iter()
                .map(|face| face.step_id)
                .collect()
        };
        assert_eq!(
            (own.raw_part_of_face(), step_ids(own)),
            (truck.raw_part_of_face(), step_ids(truck))
        );
    }
    let solids = label(
        folder.path(),
        &[
            "parts", "--out", "s", "--kernel", "truck", "--unit", "solid",
        ],
    );
    assert_eq!(solids.status.code(), Some(2));
}
