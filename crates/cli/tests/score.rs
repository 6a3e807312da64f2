//! Tests `partprobe score` in the real program: what others predicted is scored, bounds are checked, damage is named.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot read its own files has failed"
)]

use partprobe_formats::{Array, Compression, Values, arrays_to_npz};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn score(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_partprobe"))
        .arg("score")
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn write(path: &Path, members: &[(&str, Array)]) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, arrays_to_npz(members, Compression::Stored).unwrap()).unwrap();
}

/// A shape whose embeddings tell both parts apart, and whose predicted clusters do not.
fn two_parts(path: &Path) {
    let reference = Array::vector::<i64>(vec![0, 0, 0, 7, 7, -1]);
    let predicted = Array::vector::<i32>(vec![2, 2, 2, 2, 2, 0]);
    let [a, b] = [[1.0, 0.0], [0.0, 1.0]];
    let rows = [a, a, a, b, b, b].concat();
    let embedding = Array::with_shape(vec![6, 2], Values::F32(rows)).unwrap();
    write(
        path,
        &[
            ("reference", reference),
            ("predicted", predicted),
            ("embedding", embedding),
        ],
    );
}

fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[track_caller]
fn assert_outcome(output: &Output, code: i32, message: &str) {
    let printed = printed(output);
    assert_eq!(output.status.code(), Some(code), "{printed}");
    assert!(printed.contains(message), "{printed}");
}

#[test]
fn clusters_and_embeddings_are_scored() {
    let folder = tempfile::tempdir().unwrap();
    two_parts(&folder.path().join("scored/a.npz"));
    let output = score(folder.path(), &["scored", "--json"]);
    assert_outcome(&output, 0, "");

    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    let shape = |clusterer: &str| {
        let shapes = document["shapes"].as_array().unwrap();
        let found = shapes.iter().find(|row| row["clusterer"] == clusterer);
        found.unwrap().clone()
    };
    let footer = document["tables"]["footer"][0].as_str().unwrap();
    assert!(
        footer.contains("k-means with 10 restarts and seed 0") && footer.contains("data "),
        "{footer}"
    );
    // A file alone has the same scores as in its folder.
    let alone = score(folder.path(), &["scored/a.npz", "--json"]);
    assert_eq!(alone.stdout, output.stdout);
    let piped = Command::new(env!("CARGO_BIN_EXE_partprobe"))
        .args(["score", "-", "--json"])
        .stdin(fs::File::open(folder.path().join("scored/a.npz")).unwrap())
        .output()
        .unwrap();
    assert_outcome(&piped, 0, r#""shape": "stdin""#);

    let [predicted, embedded] = ["predicted", "k-means"].map(shape);
    // One cluster for two parts: the larger part has 3 of its 5 points.
    assert_eq!(
        (&predicted["miou"], &predicted["accuracy"]),
        (&0.3.into(), &0.6.into())
    );
    assert_eq!(predicted["count_error"], 1.0);
    assert!(predicted["gtc_miou"].is_null());
    for metric in ["miou", "accuracy", "gtc_miou", "ari", "pq", "pair_auc"] {
        let expected = if metric == "pair_auc" {
            Value::Null
        } else {
            1.0.into()
        };
        assert_eq!(embedded[metric], expected, "{metric}");
    }
}

#[test]
fn a_missed_bound_ends_in_3_and_is_in_the_report() {
    let folder = tempfile::tempdir().unwrap();
    two_parts(&folder.path().join("scored/a.npz"));
    let check = |bounds: &str, code: i32, message: &str| {
        fs::write(folder.path().join("bounds.toml"), bounds).unwrap();
        let args = ["scored", "--expect", "bounds.toml", "--junit", "report.xml"];
        assert_outcome(&score(folder.path(), &args), code, message);
    };
    check(
        "\"k-means.miou\" = \">= 0.9\"",
        0,
        "holds: scored/reference@k-means.miou >= 0.9",
    );
    check(
        "\"predicted.miou\" = \">= 0.9\"",
        3,
        "missed: scored/reference@predicted.miou >= 0.9 (it is 0.3000)",
    );
    let report = fs::read_to_string(folder.path().join("report.xml")).unwrap();
    assert!(report.contains("tests=\"1\" failures=\"1\""), "{report}");

    check(
        "miou = \">= 0.9\"",
        2,
        "`miou` does not say which column it is about: k-means, predicted",
    );
    check("\"k-means.nothing\" = \">= 0.9\"", 2, "nothing");
    check("miou = 0.9", 2, "must be a text such as");
    check("# none yet", 2, "has no bound");
}

#[test]
fn damaged_files_are_named_and_the_others_are_scored() {
    let folder = tempfile::tempdir().unwrap();
    two_parts(&folder.path().join("scored/a.npz"));
    fs::write(folder.path().join("scored/b.npz"), "no archive").unwrap();
    write(
        &folder.path().join("scored/c.npz"),
        &[("reference", Array::vector::<i32>(vec![0, 1]))],
    );
    let output = score(folder.path(), &["scored"]);
    assert_outcome(&output, 1, "2 files could not be scored");
    for message in [
        "scored/b.npz: ",
        "scored/c.npz: there is neither a member `predicted`",
        "| `scored` |",
    ] {
        assert!(printed(&output).contains(message), "{}", printed(&output));
    }

    assert_outcome(&score(folder.path(), &["nowhere"]), 2, "reading nowhere");
    fs::create_dir(folder.path().join("empty")).unwrap();
    assert_outcome(&score(folder.path(), &["empty"]), 2, "holds no .npz file");
}
