//! Tests batches of the real program that are killed, stopped, divided and packed in archives: the bytes are always those
//! of one undisturbed call on plain files.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod folder;
mod program;

use folder::contents;
use partprobe_synth::{SynthSettings, fixtures, part};
use program::{check, index, program};
use std::fs;
use std::io::{Cursor, Write};
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

const N_PARTS: u64 = 12;

/// Parts, two bodies that are one solid twice, and a bad file.
fn steps() -> Vec<(String, Vec<u8>)> {
    let settings = SynthSettings {
        seed: 5,
        min_parts: 2,
        max_parts: 6,
    };
    let mut steps: Vec<_> = (0..N_PARTS)
        .map(|index| {
            (
                format!("d/part{index:02}.step"),
                part(&settings, index).step.into_bytes(),
            )
        })
        .collect();
    steps.push(("d/bad.step".to_owned(), b"no STEP".to_vec()));
    steps.push((
        "twins.stp".to_owned(),
        fixtures::two_blocks([3.0, 4.0, 5.0]).into_bytes(),
    ));
    steps
}

fn folder_with_steps() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir_all(folder.path().join("s/d")).unwrap();
    for (name, bytes) in steps() {
        fs::write(folder.path().join("s").join(name), bytes).unwrap();
    }
    folder
}

fn status(folder: &Path, dataset: &str) -> serde_json::Value {
    serde_json::from_str(&check(folder, &["status", dataset, "--json"], 0, "")).unwrap()
}

/// The status of a batch that was killed. A worker that the killed program was just starting holds the lock for a moment longer.
fn status_after_kill(folder: &Path, dataset: &str) -> serde_json::Value {
    let until = Instant::now() + Duration::from_secs(20);
    loop {
        let found = status(folder, dataset);
        if found["state"] != "running" || Instant::now() > until {
            return found;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Kills the program as soon as the journal has so many lines; says whether it was still at work.
fn killed_at(mut child: Child, dataset: &Path, n_lines: usize) -> bool {
    loop {
        let journal = fs::read(dataset.join(".unfinished.jsonl")).unwrap_or_default();
        if journal.iter().filter(|&&byte| byte == b'\n').count() >= n_lines {
            child.kill().unwrap();
        }
        if child.try_wait().unwrap().is_some() {
            return !dataset.join("index.jsonl").exists();
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_killed_batch_is_resumed_to_the_same_bytes() {
    let folder = folder_with_steps();
    let path = folder.path();
    check(
        path,
        &[
            "label", "s", "--out", "whole", "--jobs", "2", "--unit", "solid",
        ],
        0,
        "",
    );
    let arguments = [
        "label", "s", "--out", "killed", "--jobs", "1", "--unit", "solid", "--resume",
    ];
    let mut n_kills = 0;
    for n_lines in [1, 4, 6, 9] {
        let child = program(path, &arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        n_kills += usize::from(killed_at(child, &path.join("killed"), n_lines));
        if path.join("killed/.unfinished.jsonl").exists() {
            let status = status_after_kill(path, "killed");
            assert_eq!(
                (&status["state"], &status["n_files"]),
                (&"stopped".into(), &14.into()),
                "{status}"
            );
            check(
                path,
                &["sample", "killed", "--out", "x", "--format", "npz"],
                2,
                "--resume",
            );
        }
    }
    assert!(n_kills > 0, "the program was always faster");
    // What a kill can leave behind: a torn line, a carrier that was not finished, one that is too short.
    let mut journal = fs::OpenOptions::new()
        .append(true)
        .open(path.join("killed/.unfinished.jsonl"))
        .unwrap();
    journal
        .write_all(b"{\"line\":\"file\",\"source\":\"s/d/pa")
        .unwrap();
    fs::write(path.join("killed/.a.npz.1-1.unfinished"), "half").unwrap();
    let carrier = fs::read_dir(path.join("killed"))
        .unwrap()
        .find_map(|entry| {
            let path = entry.unwrap().path();
            path.extension()
                .is_some_and(|extension| extension == "npz")
                .then_some(path)
        });
    fs::write(carrier.unwrap(), "").unwrap();
    check(path, &arguments, 0, "");
    assert_eq!(
        contents(&path.join("whole")),
        contents(&path.join("killed"))
    );
    // A finished batch has nothing left to do, and other settings or inputs are refused.
    check(path, &arguments, 0, "");
    check(
        path,
        &[&arguments[..], &["--set", "label.theta_deg=9"]].concat(),
        2,
        "label.theta_deg is 9.0, not 8.0",
    );
    fs::write(path.join("s/new.step"), "").unwrap();
    check(path, &arguments, 2, "the inputs are now 15 files");
    assert_eq!(
        contents(&path.join("whole")),
        contents(&path.join("killed"))
    );
}

#[test]
fn shares_join_to_the_batch_of_one_machine() {
    let folder = folder_with_steps();
    let path = folder.path();
    check(path, &["label", "s", "--out", "whole"], 0, "");
    for index in 1..=3 {
        let (out, shard) = (format!("share{index}"), format!("{index}/3"));
        check(
            path,
            &["label", "s", "--out", &out, "--shard", &shard],
            0,
            "",
        );
        assert_eq!(status(path, &out)["shard"], shard);
    }
    check(
        path,
        &["merge", "share1", "share3", "--out", "joined"],
        2,
        "shares are missing: 2/3",
    );
    check(
        path,
        &["merge", "share1", "share1", "--out", "joined"],
        2,
        "are both share 1/3",
    );
    check(
        path,
        &["merge", "whole", "--out", "joined"],
        2,
        "is not a share",
    );
    check(
        path,
        &["merge", "share3", "share1", "share2", "--out", "joined"],
        0,
        "",
    );
    assert_eq!(
        contents(&path.join("whole")),
        contents(&path.join("joined"))
    );
    // A share with a damaged carrier is named, and nothing is left behind. It can be joined after it was labeled again.
    let shares = ["share1", "share2", "share3"];
    let damaged = shares.into_iter().find_map(|share| {
        let mut files = contents(&path.join(share)).into_keys();
        let carrier = files.find(|file| file.extension().is_some_and(|end| end == "npz"));
        Some((share, path.join(share).join(carrier?)))
    });
    let (share, carrier) = damaged.unwrap();
    let bytes = fs::read(&carrier).unwrap();
    // The data sets above have links to this file.
    fs::remove_file(&carrier).unwrap();
    fs::write(&carrier, &bytes[..bytes.len() / 2]).unwrap();
    let merge = ["merge", "share1", "share2", "share3", "--out", "repaired"];
    check(path, &merge, 1, "1 carrier is not as labeled");
    assert!(!path.join("repaired").exists());
    let shard = format!("{}/3", &share["share".len()..]);
    let again = ["label", "s", "--out", share, "--shard", &shard, "--resume"];
    check(path, &again, 0, "");
    check(path, &merge, 0, "");
    assert_eq!(
        contents(&path.join("whole")),
        contents(&path.join("repaired"))
    );
    check(
        path,
        &[
            "label",
            "s",
            "--out",
            "other",
            "--shard",
            "2/3",
            "--set",
            "label.tau_min=0",
        ],
        0,
        "",
    );
    check(
        path,
        &["merge", "share1", "other", "share3", "--out", "x"],
        2,
        "label.tau_min is 0, not 20",
    );
    check(
        path,
        &["label", "s", "--out", "x", "--shard", "4/3"],
        2,
        "i/n",
    );
}

#[test]
fn a_share_without_a_shape_is_joined_like_any_other() {
    let folder = folder_with_steps();
    let path = folder.path();
    fs::create_dir(path.join("mixed")).unwrap();
    fs::copy(path.join("s/twins.stp"), path.join("mixed/good.step")).unwrap();
    fs::write(path.join("mixed/bad.step"), "no STEP text").unwrap();
    for share in ["1/2", "2/2"] {
        let out = share.replace('/', "-of-");
        check(
            path,
            &["label", "mixed", "--out", &out, "--shard", share],
            0,
            "",
        );
    }
    check(
        path,
        &["merge", "1-of-2", "2-of-2", "--out", "joined"],
        0,
        "",
    );
    check(path, &["label", "mixed", "--out", "one-machine"], 0, "");
    assert_eq!(
        contents(&path.join("joined")),
        contents(&path.join("one-machine"))
    );
    let message = "no file could be labeled";
    check(
        path,
        &["label", "mixed/bad.step", "--out", "alone"],
        1,
        message,
    );
    // A batch of which no share has a shape fails when it is joined.
    let share = [
        "label",
        "mixed/bad.step",
        "--out",
        "whole",
        "--shard",
        "1/1",
    ];
    check(path, &share, 0, "");
    check(path, &["merge", "whole", "--out", "nothing"], 1, message);
}

fn tarred(members: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut tar = tar::Builder::new(Vec::new());
    for (name, bytes) in members {
        let mut header = tar::Header::new_gnu();
        header.as_old_mut().name[..name.len()].copy_from_slice(name.as_bytes());
        header.set_size(bytes.len() as u64);
        header.set_cksum();
        tar.append(&header, bytes.as_slice()).unwrap();
    }
    tar.into_inner().unwrap()
}

fn zipped(members: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in members {
        zip.start_file(name.as_str(), zip::write::SimpleFileOptions::default())
            .unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// A zip whose size depends on the sizes of its members alone.
fn stored(members: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options =
        zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, bytes) in members {
        zip.start_file(name.as_str(), options).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gz.write_all(bytes).unwrap();
    gz.finish().unwrap()
}

fn xzipped(bytes: &[u8]) -> Vec<u8> {
    let mut xz =
        lzma_rust2::XzWriter::new(Vec::new(), lzma_rust2::XzOptions::with_preset(0)).unwrap();
    xz.write_all(bytes).unwrap();
    xz.finish().unwrap()
}

fn seven_zipped(members: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut writer = sevenz_rust2::ArchiveWriter::new(Cursor::new(Vec::new())).unwrap();
    let entries = members
        .iter()
        .map(|(name, _)| sevenz_rust2::ArchiveEntry::new_file(name))
        .collect();
    let readers = members
        .iter()
        .map(|(_, bytes)| sevenz_rust2::SourceReader::new(bytes.as_slice()))
        .collect();
    writer.push_archive_entries(entries, readers).unwrap();
    writer.finish().unwrap().into_inner()
}

#[test]
fn archives_give_the_same_result_as_their_files() {
    let folder = folder_with_steps();
    let path = folder.path();
    fs::write(path.join("s/readme.txt"), "not asked for").unwrap();
    check(path, &["label", "s", "--out", "plain"], 0, "");
    let plain = index(&path.join("plain"));
    let mut members = steps();
    members.push(("readme.txt".to_owned(), b"not asked for".to_vec()));
    let archives = [
        ("s.zip", zipped(&members)),
        ("s.tar", tarred(&members)),
        ("s.tgz", gzipped(&tarred(&members))),
        (
            "s.tar.zst",
            zstd::encode_all(tarred(&members).as_slice(), 1).unwrap(),
        ),
        ("s.tar.xz", xzipped(&tarred(&members))),
        ("s.7z", seven_zipped(&members)),
        // The content decides, and not the name.
        ("zip.7z", zipped(&members)),
        ("tar.zip", gzipped(&tarred(&members))),
    ];
    for (name, bytes) in archives {
        let out = format!("out-{name}");
        fs::write(path.join(name), bytes).unwrap();
        check(path, &["label", name, "--out", &out, "--jobs", "2"], 0, "");
        let rows = index(&path.join(&out));
        assert_eq!(rows.len(), plain.len(), "{name}");
        for (row, expected) in rows.iter().zip(&plain) {
            let source = expected["source"].as_str().unwrap().replacen('s', name, 1);
            let id =
                expected["id"]
                    .as_str()
                    .unwrap()
                    .replacen('s', name.split('.').next().unwrap(), 1);
            assert_eq!(
                (&row["id"], &row["source"]),
                (&id.clone().into(), &source.into()),
                "{name}"
            );
            assert_eq!(row["sha256"], expected["sha256"]);
            assert_eq!(row["reason"], expected["reason"]);
            if let Some(file) = row["file"].as_str().filter(|_| id.starts_with("s__")) {
                let carrier = fs::read(path.join(&out).join(file)).unwrap();
                assert_eq!(
                    carrier,
                    fs::read(path.join("plain").join(expected["file"].as_str().unwrap())).unwrap()
                );
            }
        }
    }
    let child = program(path, &["label", "s.7z", "--out", "killed", "--jobs", "1"])
        .stderr(Stdio::null())
        .spawn();
    killed_at(child.unwrap(), &path.join("killed"), 4);
    check(
        path,
        &["label", "s.7z", "--out", "killed", "--resume"],
        0,
        "",
    );
    assert_eq!(
        contents(&path.join("killed")),
        contents(&path.join("out-s.7z"))
    );
}

/// The lines of the index that are not `ok`, as `source status reason`.
fn refused(folder: &Path) -> Vec<String> {
    let text = |row: &serde_json::Value, key: &str| row[key].as_str().unwrap().to_owned();
    let bad = index(folder)
        .into_iter()
        .filter(|row| row["status"] != "ok");
    bad.map(|row| {
        format!(
            "{} {} {}",
            text(&row, "source"),
            text(&row, "status"),
            text(&row, "reason")
        )
    })
    .collect()
}

#[test]
fn hostile_archives_are_refused_by_name_and_the_rest_is_labeled() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let cuboid = || fixtures::cuboid([3.0, 4.0, 5.0]).into_bytes();
    let members = [
        ("../../escaped.step".to_owned(), cuboid()),
        ("/absolute.step".to_owned(), cuboid()),
        ("C:/drive.step".to_owned(), cuboid()),
        ("back\\slash.step".to_owned(), cuboid()),
        ("twice.step".to_owned(), cuboid()),
        ("twice.stp".to_owned(), cuboid()),
        ("bomb.step".to_owned(), vec![b' '; 3 << 20]),
        ("inner.zip".to_owned(), b"PK".to_vec()),
        ("good.step".to_owned(), cuboid()),
        ("./good.step".to_owned(), cuboid()),
    ];
    fs::write(path.join("h.tar.gz"), gzipped(&tarred(&members))).unwrap();
    let arguments = [
        "label",
        "h.tar.gz",
        "--out",
        "d",
        "--set",
        "label.max_file_mb=1",
    ];
    check(path, &arguments, 0, "");
    let found = refused(&path.join("d"));
    let expected = [
        "h.tar.gz//absolute.step refused the name is absolute",
        "h.tar.gz/./good.step refused another member of the archive has the same name",
        "h.tar.gz/../../escaped.step refused the name leads out of the archive",
        "h.tar.gz/C:/drive.step refused the name is absolute",
        "h.tar.gz/back\\slash.step refused the name holds a backslash",
        "h.tar.gz/bomb.step over-budget the file has more than 1 MiB; raise label.max_file_mb",
        "h.tar.gz/inner.zip refused it is an archive inside an archive",
    ];
    assert_eq!(found.len(), expected.len(), "{found:#?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            found.starts_with(expected),
            "`{found}` does not begin with `{expected}`"
        );
    }
    let labeled: Vec<_> = index(&path.join("d"))
        .into_iter()
        .filter(|row| row["status"] == "ok")
        .collect();
    let ids: Vec<_> = labeled
        .iter()
        .map(|row| row["id"].as_str().unwrap())
        .collect();
    assert_eq!(ids, ["h__good", "h__twice", "h__twice.stp"]);
    assert!(
        !path.join("escaped.step").exists()
            && !path.parent().unwrap().join("escaped.step").exists()
    );
    // A cut archive gives what stands before the cut, and one that is none at all is named too.
    let noise: Vec<u8> = (0..400_000u32)
        .map(|x| (x.wrapping_mul(2_654_435_761) >> 13) as u8 | 1)
        .collect();
    let whole = gzipped(&tarred(&[
        ("a.step".to_owned(), cuboid()),
        ("b.step".to_owned(), noise),
    ]));
    fs::create_dir(path.join("cut")).unwrap();
    fs::write(path.join("cut/c.tgz"), &whole[..whole.len() / 2]).unwrap();
    fs::write(path.join("cut/none.7z"), "hello").unwrap();
    check(path, &["label", "cut", "--out", "e"], 0, "");
    let found = refused(&path.join("e"));
    assert!(
        found[0].starts_with("cut/c.tgz failed the archive is damaged"),
        "{found:#?}"
    );
    assert!(
        found[1].starts_with("cut/c.tgz/b.step failed the archive is damaged in this member"),
        "{found:#?}"
    );
    assert!(
        found[2].starts_with("cut/none.7z failed the archive is damaged"),
        "{found:#?}"
    );
    assert_eq!(
        index(&path.join("e"))
            .iter()
            .filter(|row| row["status"] == "ok")
            .count(),
        1
    );
}

#[test]
fn resuming_with_a_higher_budget_gives_the_result_of_that_budget() {
    let folder = folder_with_steps();
    let path = folder.path();
    let with = |out: &'static str, n: &'static str| ["label", "s", "--out", out, "--set", n];
    check(path, &with("once", "label.max_entities=1000000"), 0, "");
    check(path, &with("again", "label.max_entities=300"), 0, "");
    let over: Vec<_> = refused(&path.join("again"));
    let is_over =
        |line: &&String| line.contains(" over-budget the file has more than 300 entities");
    assert!(over.iter().filter(is_over).count() > 0, "{over:#?}");
    check(path, &["status", "again"], 0, "");
    let retry =
        |n: &'static str| [&with("again", n)[..], &["--retry", "over-budget,timed-out"]].concat();
    check(
        path,
        &retry("label.max_entities=200"),
        2,
        "label.max_entities is 200, not 300",
    );
    check(
        path,
        &[
            &retry("label.max_entities=1000000")[..],
            &["--set", "label.tau_min=1"],
        ]
        .concat(),
        2,
        "tau_min",
    );
    check(path, &retry("label.max_entities=1000000"), 0, "");
    assert_eq!(contents(&path.join("once")), contents(&path.join("again")));
    check(path, &retry("label.max_entities=1000000"), 0, "");
    assert_eq!(contents(&path.join("once")), contents(&path.join("again")));
}

#[test]
fn what_is_emitted_can_be_chosen() {
    let folder = folder_with_steps();
    let path = folder.path();
    check(
        path,
        &[
            "label",
            "s",
            "--out",
            "all",
            "--emit",
            "carrier,labels,points",
        ],
        0,
        "",
    );
    check(path, &["label", "s", "--out", "carriers"], 0, "");
    check(
        path,
        &["sample", "carriers", "--out", "sampled", "--format", "npz"],
        0,
        "",
    );
    let (all, carriers) = (
        contents(&path.join("all")),
        contents(&path.join("carriers")),
    );
    let sampled = contents(&path.join("sampled")).into_iter();
    for (name, sample) in sampled.filter(|(name, _)| name != Path::new("sample.json")) {
        assert_eq!(all[&Path::new("points").join(&name)], sample, "{name:?}");
        assert_eq!(all[&name], carriers[&name]);
        let mut labels =
            partprobe_formats::arrays_from_npz(&all[&Path::new("labels").join(&name)]).unwrap();
        let mut carrier = partprobe_formats::arrays_from_npz(&carriers[&name]).unwrap();
        assert_eq!(
            labels.vector::<i32>("face_label"),
            carrier.vector("face_label")
        );
        assert!(labels.array("edge_phi").is_some() && labels.array("triangles").is_none());
    }
    let alone = [
        "label",
        "s",
        "--out",
        "labels",
        "--emit",
        "labels",
        "--set",
        "label.tau_min=0",
    ];
    check(path, &alone, 0, "");
    for (row, with_mesh) in index(&path.join("labels"))
        .iter()
        .zip(index(&path.join("carriers")))
    {
        assert_eq!(
            (&row["n_faces"], &row["n_parts"]),
            (&with_mesh["n_faces"], &with_mesh["n_parts"])
        );
        assert!(row["file"].is_null());
    }
    check(
        path,
        &["sample", "labels", "--out", "x", "--format", "npz"],
        2,
        "holds no carriers",
    );
    check(
        path,
        &["label", "s", "--out", "y", "--emit", "labels,labels"],
        2,
        "names something twice",
    );
}

#[test]
fn files_damaged_later_are_named_and_labeled_again() {
    let folder = folder_with_steps();
    let path = folder.path();
    check(
        path,
        &["label", "s", "--out", "d", "--emit", "carrier,points"],
        0,
        "",
    );
    let expected = contents(&path.join("d"));
    let rows = index(&path.join("d"));
    let file = |idx: usize, key: &str| path.join("d").join(rows[idx][key].as_str().unwrap());
    let labeled: Vec<usize> = (0..rows.len())
        .filter(|&idx| rows[idx]["file"].is_string())
        .collect();
    let (one, other) = (labeled[0], labeled[1]);
    type Damage<'a> = (&'a str, &'a dyn Fn(), bool);
    let damages: [Damage<'_>; 4] = [
        (
            "missing",
            &|| fs::remove_file(file(one, "file")).unwrap(),
            true,
        ),
        (
            "cut",
            &|| fs::write(file(one, "file"), b"PK").unwrap(),
            true,
        ),
        (
            "exchanged",
            &|| assert!(fs::copy(file(other, "file"), file(one, "file")).is_ok()),
            true,
        ),
        (
            "no points",
            &|| fs::remove_file(file(one, "points_file")).unwrap(),
            false,
        ),
    ];
    for (name, damage, is_carrier) in damages {
        damage();
        if is_carrier {
            let message = "1 carrier cannot be used; everything else is written";
            check(
                path,
                &[
                    "sample",
                    "d",
                    "--out",
                    name,
                    "--format",
                    "npz",
                    "--n-points",
                    "9",
                ],
                1,
                message,
            );
            assert_eq!(
                fs::read_dir(path.join(name)).unwrap().count(),
                // All other shapes, and sample.json.
                labeled.len(),
                "{name}"
            );
            check(
                path,
                &["render", "d", "-o", "x.png", "--size", "40"],
                1,
                message,
            );
        }
        let again = if name == "cut" {
            ["--retry", "crashed"].as_slice()
        } else {
            &["--resume"]
        };
        let arguments = [
            &["label", "s", "--out", "d", "--emit", "carrier,points"],
            again,
        ]
        .concat();
        let id = rows[one]["id"].as_str().unwrap();
        check(
            path,
            &arguments,
            0,
            &format!("warning: {id} is labeled again: "),
        );
        assert_eq!(contents(&path.join("d")), expected, "{name}");
    }
}

/// The same text in another unit of length: it has another shape, and as many bytes.
fn edited(text: &[u8]) -> Vec<u8> {
    let text = String::from_utf8(text.to_vec()).unwrap();
    let changed = text.replacen(".MILLI.", ".CENTI.", 1);
    assert_ne!(changed, text);
    changed.into_bytes()
}

#[test]
fn a_file_that_was_edited_since_is_named_and_labeled_again() {
    let folder = folder_with_steps();
    let path = folder.path();
    let resumed = ["label", "s", "--out", "d", "--unit", "solid", "--resume"];
    check(path, &resumed, 0, "");
    let first = contents(&path.join("d"));

    // Copied or touched files are the same: only their texts count.
    let part = path.join("s/d/part03.step");
    let text = fs::read(&part).unwrap();
    fs::remove_file(&part).unwrap();
    fs::write(&part, &text).unwrap();
    check(path, &resumed, 0, "");
    assert_eq!(contents(&path.join("d")), first);

    // A part, and a file that could not be read and still cannot.
    fs::write(&part, edited(&text)).unwrap();
    check(
        path,
        &resumed,
        0,
        "warning: s/d/part03.step is labeled again, because it was edited",
    );
    assert_ne!(contents(&path.join("d")), first);
    fs::write(path.join("s/d/bad.step"), b"NO STEP").unwrap();
    check(
        path,
        &resumed,
        0,
        "warning: s/d/bad.step is labeled again, because it was edited",
    );
    check(
        path,
        &["label", "s", "--out", "fresh", "--unit", "solid"],
        0,
        "",
    );
    assert_eq!(contents(&path.join("d")), contents(&path.join("fresh")));

    // An edit that changes the size is refused, and the file is named.
    fs::write(&part, [&text[..], b"\n"].concat()).unwrap();
    check(
        path,
        &resumed,
        2,
        "their names or sizes differ (edited or unreadable: s/d/part03.step)",
    );

    // So is another name.
    fs::write(&part, &text).unwrap();
    fs::rename(&part, path.join("s/d/renamed.step")).unwrap();
    check(
        path,
        &resumed,
        2,
        "names or sizes differ (new: s/d/renamed.step; missing: s/d/part03.step",
    );
}

#[test]
fn files_edited_while_a_batch_was_stopped_are_labeled_again() {
    let folder = folder_with_steps();
    let path = folder.path();
    let arguments = ["label", "s", "--out", "d", "--jobs", "1", "--resume"];
    let child = program(path, &arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    killed_at(child, &path.join("d"), 6);
    for index in 0..N_PARTS {
        let part = path.join(format!("s/d/part{index:02}.step"));
        fs::write(&part, edited(&fs::read(&part).unwrap())).unwrap();
    }
    check(
        path,
        &arguments,
        0,
        "part00.step is labeled again, because it was edited",
    );
    check(path, &["label", "s", "--out", "fresh"], 0, "");
    assert_eq!(contents(&path.join("d")), contents(&path.join("fresh")));
}

#[test]
fn a_member_that_was_edited_since_is_labeled_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut members = steps();
    members.push((
        "gone.step".to_owned(),
        fixtures::cuboid([3.0, 4.0, 5.0]).into_bytes(),
    ));
    members.push(("more.txt".to_owned(), b"text".to_vec()));
    let mut changed = members.clone();
    changed[3].1 = edited(&members[3].1);
    // One member has another name, and another is no longer STEP.
    changed[14].0 = "came.step".to_owned();
    type Pack = fn(&[(String, Vec<u8>)]) -> Vec<u8>;
    let archives: [(&str, Pack); 2] = [("a.tar", tarred), ("a.zip", stored)];
    for (name, archive) in archives {
        let (before, after) = (archive(&members), archive(&changed));
        assert_eq!(before.len(), after.len());
        let (out, fresh) = (format!("{name}-d"), format!("{name}-fresh"));
        fs::write(path.join(name), before).unwrap();
        check(path, &["label", name, "--out", &out, "--resume"], 0, "");
        let same = contents(&path.join(&out));
        check(path, &["label", name, "--out", &out, "--resume"], 0, "");
        assert_eq!(contents(&path.join(&out)), same);

        fs::write(path.join(name), after).unwrap();
        let message =
            format!("warning: {name}/d/part03.step is labeled again, because it was edited");
        check(
            path,
            &["label", name, "--out", &out, "--resume"],
            0,
            &message,
        );
        check(path, &["label", name, "--out", &fresh], 0, "");
        assert_eq!(
            contents(&path.join(&out)),
            contents(&path.join(&fresh)),
            "{name}"
        );
        assert!(
            index(&path.join(&out))
                .iter()
                .any(|row| row["id"] == "a__came")
        );

        // Damage of the same size, and its repair.
        let whole = fs::read(path.join(name)).unwrap();
        let mut damaged = whole.clone();
        let tail = whole.len() / 2;
        damaged[tail..].fill(0xAA);
        for (bytes, fresh) in [
            (damaged, format!("{name}-damaged")),
            (whole, format!("{name}-repaired")),
        ] {
            fs::write(path.join(name), bytes).unwrap();
            check(
                path,
                &["label", name, "--out", &out, "--resume"],
                0,
                "is labeled again",
            );
            check(path, &["label", name, "--out", &fresh], 0, "");
            assert_eq!(
                contents(&path.join(&out)),
                contents(&path.join(&fresh)),
                "{fresh}"
            );
        }
    }
}

#[cfg(unix)]
#[test]
fn two_batches_in_one_folder_do_not_meet() {
    let folder = folder_with_steps();
    let path = folder.path();
    check(path, &["label", "s", "--out", "d"], 0, "");
    let expected = contents(&path.join("d"));
    let lock = fs::File::open(path.join("d")).unwrap();
    lock.lock().unwrap();
    for more in ["--force", "--resume"] {
        check(
            path,
            &["label", "s", "--out", "d", more],
            2,
            "another partprobe is labeling into d",
        );
        assert_eq!(contents(&path.join("d")), expected);
    }
    drop(lock);
    let begin = || {
        program(path, &["label", "s", "--out", "d", "--force"])
            .stdout(Stdio::null())
            .spawn()
            .unwrap()
    };
    for _ in 0..3 {
        let codes = [begin(), begin()].map(|mut child| child.wait().unwrap().code());
        assert!(
            codes.contains(&Some(0)) && codes.iter().all(|code| [Some(0), Some(2)].contains(code)),
            "{codes:?}"
        );
        assert_eq!(contents(&path.join("d")), expected);
    }
}

#[test]
fn a_running_batch_is_neither_replaced_nor_exported() {
    let folder = folder_with_steps();
    let path = folder.path();
    check(path, &["label", "s", "--out", "d"], 0, "");
    let journal = partprobe_dataset::Journal::open(&path.join("d"), |_| true).unwrap();
    let expected = contents(&path.join("d"));
    check(
        path,
        &["label", "s", "--out", "d", "--force"],
        2,
        "another partprobe is labeling into d",
    );
    assert_eq!(contents(&path.join("d")), expected);
    fs::remove_file(path.join("d/index.jsonl")).unwrap();
    for arguments in [
        ["export", "ply", "d", "--out", "o"].as_slice(),
        &["render", "d", "-o", "x.png"],
    ] {
        check(
            path,
            arguments,
            2,
            "d is not finished; continue with `partprobe label … --resume`",
        );
    }
    drop(journal);
    check(path, &["label", "s", "--out", "d", "--force"], 0, "");
}
