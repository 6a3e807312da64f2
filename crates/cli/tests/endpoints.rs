//! Tests in the real program the output of a run in addition to its scores: the source card, the rows of chance, A/A, home
//! advantage, and endpoints with their probes.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot read its own files has failed"
)]

mod program;

use partprobe_formats::arrays_from_npz;
use program::check;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Two sources and two seeds on sixteen parts; two updates each.
const TINY: &str = r#"
base = "base.toml"
[data]
source = "synth"
[synth]
n = 16
max_parts = 12
[sample]
n_points = 500
[split]
train = 0.5
valid = 0.0
test = 0.5
[compare]
supervision = ["step-parts", "capped-normal-kmeans-20"]
seeds = [0, 1]
[tokens]
train_tokens = 48
test_tokens = 64
[train]
steps = 2
batch_shapes = 2
valid_every = 0
checkpoint_every = 1
[eval]
restarts = 1
bootstrap = 20
[sources.kinds]
type = "faces"
path = "kinds"
[[endpoints]]
name = "noisy"
position_noise = 0.01
normal_noise_deg = 10.0
[[endpoints]]
name = "positions-only"
normals = "none"
[[endpoints]]
name = "plain"
voxels = "plain"
"#;

/// One label per face, its type, for each shape of a data set that lies in a folder.
fn write_kinds(dataset: &Path, out: &Path) {
    fs::create_dir_all(out).unwrap();
    let index = fs::read_to_string(dataset.join("index.jsonl")).unwrap();
    for line in index.lines() {
        let entry: serde_json::Value = serde_json::from_str(line).unwrap();
        let id = entry["id"].as_str().unwrap();
        let file = dataset.join(entry["file"].as_str().unwrap());
        let mut members = arrays_from_npz(&fs::read(file).unwrap()).unwrap();
        let types = members.vector::<u8>("face_type").unwrap();
        let lines: String = types.iter().map(|kind| format!("{kind}\n")).collect();
        fs::write(out.join(format!("{id}.seg")), lines).unwrap();
    }
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The shapes that a file of scores has under a supervision.
fn shapes(scores: &Path, supervision: &str) -> BTreeSet<String> {
    let lines = text(scores);
    let rows = lines
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    rows.filter(|row| row["supervision"] == supervision)
        .map(|row| row["shape"].as_str().unwrap().to_owned())
        .collect()
}

#[test]
fn a_run_is_scored_again_under_other_conditions() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    fs::write(root.join("tiny.toml"), TINY).unwrap();
    fs::create_dir_all(root.join("kinds")).unwrap();
    fs::write(root.join("kinds/none.seg"), "0\n").unwrap();
    let printed = check(
        root,
        &["run", "tiny.toml", "--out", "run"],
        0,
        "Mean ARI of each two sources",
    );
    for expected in [
        "| `shuffled-labels` |",
        "| `random-fourier` |",
        "A/A `step-parts, seed 0` − `step-parts, seed 1`",
        "Home advantage H",
        "θ 8°, τ_min 20; tessellation: chord 0.002",
        "our loss trains for it",
        "## Endpoint noisy",
    ] {
        assert!(
            printed.contains(expected),
            "{expected} is missing in {printed}"
        );
    }
    let card: serde_json::Value =
        serde_json::from_str(&text(&root.join("run/source_card.json"))).unwrap();
    assert_eq!(card["sources"].as_array().unwrap().len(), 2);
    assert!(text(&root.join("run/source_card.md")).contains("| `step-parts` |"));

    let of_run = shapes(&root.join("run/scores.jsonl"), "step-parts");
    for endpoint in ["noisy", "positions-only", "plain"] {
        let scores = root.join(format!("run/endpoints/{endpoint}/scores.jsonl"));
        assert_eq!(shapes(&scores, "step-parts"), of_run);
        assert_eq!(shapes(&scores, "growing-20"), of_run);
        assert_ne!(text(&scores), text(&root.join("run/scores.jsonl")));
    }

    // The same files, meshed coarser, with a probe of the types of the faces.
    let coarser = [
        "--set",
        "label.angle_rad=0.6",
        "--set",
        "label.chord_fraction=0.004",
    ];
    check(
        root,
        &[&["label", "run/data/step", "--out", "t2"], &coarser[..]].concat(),
        0,
        "",
    );
    fs::remove_dir_all(root.join("kinds")).unwrap();
    write_kinds(&root.join("t2"), &root.join("kinds"));
    let t2 = r#"endpoints=[{ name = "T2", data = "t2", probe = "kinds" }]"#;
    check(root, &["eval", "run", "--set", t2], 0, "");
    assert!(!root.join("run/endpoints/noisy").exists());
    assert_eq!(
        shapes(&root.join("run/endpoints/T2/scores.jsonl"), "untrained"),
        of_run
    );
    let tables = text(&root.join("run/endpoints/T2/tables.md"));
    assert!(
        tables.contains("tessellation: chord 0.004 of the diagonal, angle 0.6 rad"),
        "{tables}"
    );
    assert!(text(&root.join("run/tables.md")).contains("tessellation: chord 0.002"));
    let probe: serde_json::Value =
        serde_json::from_str(&text(&root.join("run/endpoints/T2/probe.json"))).unwrap();
    let rows = probe["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2 + 2 * 3);
    for row in rows {
        let scores = &row["scores"];
        for probe in ["linear", "nearest"] {
            let accuracy = scores[probe]["accuracy"].as_f64().unwrap();
            assert!((0.0..=1.0).contains(&accuracy), "{row}");
        }
        assert!(
            scores["n_learned"].as_u64() > Some(0) && scores["n_classes"].as_u64() > Some(1),
            "{row}"
        );
    }
    // Of all shapes of a data set, those that were trained on are left out and counted.
    let all = r#"endpoints=[{ name = "all", data = "t2", shapes = "all" }]"#;
    check(root, &["eval", "run", "--set", all], 0, "");
    let unseen = shapes(&root.join("run/endpoints/all/scores.jsonl"), "untrained");
    assert!(
        !unseen.is_empty() && unseen.is_subset(&of_run),
        "{unseen:?} of {of_run:?}"
    );
    let tables = text(&root.join("run/endpoints/all/tables.md"));
    assert!(
        tables.contains("left out: nearly equal to a training or validation shape"),
        "{tables}"
    );
    // Only those with at most five parts.
    let few = r#"endpoints=[{ name = "few", data = "t2", shapes = "all", min_parts = 2, max_parts = 5 }]"#;
    check(root, &["eval", "run", "--set", few], 0, "");
    let few = shapes(&root.join("run/endpoints/few/scores.jsonl"), "untrained");
    assert!(
        !few.is_empty() && few.is_subset(&unseen) && few.len() < unseen.len(),
        "{few:?} of {unseen:?}"
    );
    let unknown = r#"endpoints=[{ name = "a", data = "t2", probe = "step-parts" }]"#;
    check(
        root,
        &["eval", "run", "--set", unknown],
        1,
        "are not classes of faces",
    );
}
