//! Tests packed STEP files, folders full of other things, and names that are not text: the real program reads what can be
//! read, and a line says of everything else why not.

#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod folder;
mod program;

use folder::contents;
use partprobe_synth::fixtures;
use program::{check, index, program};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::io::{Cursor, Write};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::Command;

fn cuboid() -> Vec<u8> {
    fixtures::cuboid([3.0, 4.0, 5.0]).into_bytes()
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

fn zipped(members: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in members {
        zip.start_file(*name, zip::write::SimpleFileOptions::default())
            .unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// One solid in every container, under names that say so and under names that do not.
fn packed_files() -> Vec<(&'static str, Vec<u8>)> {
    let text = cuboid();
    let zstd = zstd::encode_all(text.as_slice(), 1).unwrap();
    vec![
        ("plain.step", text.clone()),
        ("gzip.stpZ", gzipped(&text)),
        ("zip.STPZ", zipped(&[("inside.stp", text.clone())])),
        ("g.step.gz", gzipped(&text)),
        ("g2.Stp.GZ", gzipped(&text)),
        ("g3.p21.gz", gzipped(&text)),
        ("z.step.zst", zstd.clone()),
        ("z2.stp.zst", zstd.clone()),
        ("x.step.xz", xzipped(&text)),
        ("twice.step.gz", gzipped(&zstd)),
        ("short.ste", text.clone()),
        // The content decides.
        ("lies.step", gzipped(&text)),
        ("lies2.stp", zstd),
        ("lies3.step.gz", text.clone()),
        ("lies4.zip", text.clone()),
        ("lies5.tgz", gzipped(&text)),
    ]
}

/// What the lines of an index say: id, status and reason of each source.
fn lines(dataset: &Path) -> BTreeMap<String, (String, String, String)> {
    let text =
        |row: &serde_json::Value, key: &str| row[key].as_str().unwrap_or_default().to_owned();
    index(dataset)
        .iter()
        .map(|row| {
            (
                text(row, "source"),
                (text(row, "id"), text(row, "status"), text(row, "reason")),
            )
        })
        .collect()
}

#[test]
fn packed_files_are_read_alone_in_folders_and_in_archives() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("d")).unwrap();
    for (name, bytes) in packed_files() {
        fs::write(path.join("d").join(name), bytes).unwrap();
    }
    let is_container = |name: &str| name.ends_with(".zip") || name.ends_with(".tgz");
    let members: Vec<_> = packed_files()
        .into_iter()
        .filter(|(name, _)| !is_container(name))
        .collect();
    fs::write(path.join("a.zip"), zipped(&members)).unwrap();
    for (source, out, n_files) in [
        ("d", "from-folder", packed_files().len()),
        ("a.zip", "from-zip", members.len()),
    ] {
        check(path, &["label", source, "--out", out, "--strict"], 0, "");
        let rows = index(&path.join(out));
        assert_eq!(rows.len(), n_files);
        let hashes: Vec<_> = rows
            .iter()
            .map(|row| (&row["n_faces"], &row["sha256"]))
            .collect();
        assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{rows:#?}");
    }
    assert_eq!(lines(&path.join("from-folder"))["d/gzip.stpZ"].0, "d__gzip");
    let plain = check(path, &["inspect", "d/plain.step", "--json"], 0, "");
    let faces =
        |report: &str| serde_json::from_str::<serde_json::Value>(report).unwrap()["faces"].clone();
    for (name, _) in packed_files() {
        let file = format!("d/{name}");
        assert_eq!(
            faces(&check(path, &["inspect", &file, "--json"], 0, "")),
            faces(&plain),
            "{name}"
        );
    }
    check(
        path,
        &[
            "sample",
            "d",
            "--out",
            "s",
            "--format",
            "npz",
            "--n-points",
            "10",
            "--project",
        ],
        0,
        "",
    );
    // One sample per file, and sample.json.
    assert_eq!(contents(&path.join("s")).len(), packed_files().len() + 1);
    check(path, &["export", "ply", "d/gzip.stpZ", "--out", "e"], 0, "");
    assert!(path.join("e/gzip.ply").exists());
    check(
        path,
        &["render", "d/zip.STPZ", "-o", "r.png", "--size", "32"],
        0,
        "",
    );
}

#[test]
fn damaged_and_endless_containers_are_named_and_the_rest_is_labeled() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("d")).unwrap();
    let two = zipped(&[("a.step", cuboid()), ("b.step", cuboid())]);
    let files = [
        ("cut.step.gz", gzipped(&cuboid())[..300].to_vec()),
        ("cut.stpz", zipped(&[("a.step", cuboid())])[..300].to_vec()),
        ("bomb.step.gz", gzipped(&vec![b' '; 3 << 20])),
        (
            "bomb.step.zst",
            zstd::encode_all(vec![b' '; 3 << 20].as_slice(), 1).unwrap(),
        ),
        ("two.stpz", two),
        ("xml.stpx", b"<?xml version='1.0'?>".to_vec()),
        ("empty.step", Vec::new()),
        ("good.step", cuboid()),
    ];
    for (name, bytes) in files {
        fs::write(path.join("d").join(name), bytes).unwrap();
    }
    check(
        path,
        &["label", "d", "--out", "o", "--set", "label.max_file_mb=1"],
        0,
        "",
    );
    let lines = lines(&path.join("o"));
    for (source, status, words) in [
        (
            "d/cut.step.gz",
            "failed",
            "its gzip container is damaged or cut off: it ends too early",
        ),
        ("d/cut.stpz", "failed", "its zip container is damaged"),
        ("d/bomb.step.gz", "over-budget", "raise label.max_file_mb"),
        ("d/bomb.step.zst", "over-budget", "raise label.max_file_mb"),
        ("d/two.stpz", "failed", "a zip archive with 2 STEP files"),
        ("d/xml.stpx", "skipped", "STEP-XML"),
        ("d/empty.step", "failed", "the file is empty"),
        ("d/good.step", "ok", ""),
    ] {
        let (_, found, reason) = &lines[source];
        assert!(
            found == status && reason.contains(words),
            "{source}: {found}, {reason}"
        );
    }
    for name in ["cut.step.gz", "two.stpz", "bomb.step.gz"] {
        let file = format!("d/{name}");
        check(
            path,
            &["inspect", &file, "--set", "label.max_file_mb=1"],
            1,
            &file,
        );
    }
}

#[test]
fn nothing_in_a_folder_vanishes_without_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let d = path.join("d");
    fs::create_dir_all(d.join("sub")).unwrap();
    fs::write(d.join("a.step"), cuboid()).unwrap();
    for (name, text) in [
        ("readme.txt", "x"),
        ("sub/more.TXT", "x"),
        ("makefile", "x"),
        (".hidden.step", ""),
    ] {
        fs::write(d.join(name), text).unwrap();
    }
    symlink("a.step", d.join("link.step")).unwrap();
    symlink("gone", d.join("dangling.step")).unwrap();
    symlink("gone", d.join("dangling")).unwrap();
    symlink("loop.step", d.join("loop.step")).unwrap();
    symlink(".", d.join("circle")).unwrap();
    let _listener = UnixListener::bind(d.join("socket.step")).unwrap();
    assert!(
        Command::new("mkfifo")
            .arg(d.join("pipe.step"))
            .status()
            .unwrap()
            .success()
    );
    let summary = check(path, &["label", "d", "--out", "o"], 0, "");
    let lines = lines(&path.join("o"));
    for (source, status, words) in [
        ("d/a.step", "ok", ""),
        ("d/link.step", "ok", ""),
        ("d/.hidden.step", "failed", "empty"),
        ("d/dangling.step", "failed", "does not exist"),
        ("d/dangling", "skipped", "does not exist"),
        ("d/loop.step", "failed", "cannot be followed"),
        ("d/circle", "skipped", "links to folders are not followed"),
        ("d/socket.step", "skipped", "a socket"),
        ("d/pipe.step", "skipped", "a named pipe"),
        ("d/*.txt", "skipped", "readme.txt, sub/more.TXT"),
        ("d/*", "skipped", "makefile"),
    ] {
        let (_, found, reason) = &lines[source];
        assert!(
            found == status && reason.contains(words),
            "{source}: {found}, {reason}"
        );
    }
    assert_eq!(lines.len(), 11);
    // A link is a name of its own, and each name is labeled once, whichever arguments lead to it.
    for (arguments, again) in [
        (["d", "d/link.step"], "d/link.step"),
        (["d/a.step", "d"], "d/a.step"),
    ] {
        let message = format!("{again} is given 2 times and is read once");
        let out = again.replace('/', "-");
        check(
            path,
            &["label", arguments[0], arguments[1], "--out", &out],
            0,
            &message,
        );
        assert_eq!(index(&path.join(out)), index(&path.join("o")));
    }
    assert!(
        summary.contains("files: 5\nwithout a carrier: 3\n") && summary.contains("skipped: 7\n"),
        "{summary}"
    );
    let status: serde_json::Value =
        serde_json::from_str(&check(path, &["status", "o", "--json"], 0, "")).unwrap();
    assert_eq!(
        (&status["n_done"], &status["by_status"]["skipped"]),
        (&5.into(), &7.into())
    );
    // No command waits for a pipe.
    check(
        path,
        &["label", "d/pipe.step", "--out", "p"],
        2,
        "it is a named pipe",
    );
    check(path, &["inspect", "d/pipe.step"], 1, "it is a named pipe");
    check(
        path,
        &["sample", "d/pipe.step", "--out", "p", "--format", "npz"],
        2,
        "it is a named pipe",
    );
    check(
        path,
        &["export", "ply", "d/pipe.step", "--out", "p"],
        2,
        "it is a named pipe",
    );
    assert!(!path.join("p").exists());
}

#[test]
fn a_folder_that_cannot_be_read_is_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir_all(path.join("d/locked")).unwrap();
    fs::write(path.join("d/a.step"), cuboid()).unwrap();
    fs::set_permissions(path.join("d/locked"), fs::Permissions::from_mode(0o000)).unwrap();
    // For a user who may read everything, such as root, the folder is not locked.
    let is_locked = fs::read_dir(path.join("d/locked")).is_err();
    check(path, &["label", "d", "--out", "o"], 0, "");
    let found = lines(&path.join("o"));
    assert_eq!(found.contains_key("d/locked"), is_locked, "{found:?}");
    assert_eq!(found["d/a.step"].1, "ok");
    fs::set_permissions(path.join("d/locked"), fs::Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn names_that_are_not_utf_8_are_read_and_shown_escaped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let d = path.join(OsStr::from_bytes(b"d\xfc"));
    fs::create_dir(&d).unwrap();
    for name in [
        &b"caf\xe9.step"[..],
        b"caf\xe8.step",
        b"caf%E9.step",
        "café.step".as_bytes(),
        b"50%.step",
    ] {
        // Some file systems allow text only.
        if fs::write(d.join(OsStr::from_bytes(name)), cuboid()).is_err() {
            return;
        }
    }
    let mut list = [b"d\xfc/caf\xe9.step\n".as_slice(), b"d\xfc/50%.step\n"].concat();
    list.extend_from_slice(b"# d\xfc\n");
    fs::write(path.join("list.txt"), list).unwrap();
    let label = |source: &OsStr, out: &str| {
        let arguments = [
            OsStr::new("label"),
            source,
            OsStr::new("--out"),
            OsStr::new(out),
            OsStr::new("--strict"),
        ];
        let output = program(path, &[]).args(arguments).output().unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        index(&path.join(out))
            .iter()
            .map(|row| row["id"].as_str().unwrap().to_owned())
            .collect::<Vec<_>>()
    };
    let ids = label(d.file_name().unwrap(), "o");
    assert_eq!(
        ids,
        [
            "d%FC__50%",
            "d%FC__caf%25E9",
            "d%FC__caf%E8",
            "d%FC__caf%E9",
            "d%FC__café"
        ]
    );
    let ids = label(OsStr::new("list.txt"), "l");
    assert_eq!(ids, ["list__d%FC__50%", "list__d%FC__caf%E9"]);
    assert!(check(path, &["export", "ply", "o", "--out", "e"], 0, "").contains("5 shapes"));
    check(
        path,
        &[
            "sample",
            "o",
            "--out",
            "s",
            "--format",
            "npz",
            "--n-points",
            "10",
        ],
        0,
        "",
    );
}

#[test]
fn files_of_one_stem_keep_their_endings_for_any_order_and_cut() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for name in [
        "d/x.step",
        "d/x.stp",
        "d/b.STEP",
        "d/b.step",
        "d/one.step",
        "d/a/b.step",
        "d/a__b.step",
        "e/d/x.step",
    ] {
        fs::create_dir_all(path.join(name).parent().unwrap()).unwrap();
        fs::write(path.join(name), cuboid()).unwrap();
    }
    let ids = |out: &str| {
        index(&path.join(out))
            .iter()
            .map(|row| row["id"].as_str().unwrap().to_owned())
            .collect::<Vec<_>>()
    };
    check(path, &["label", "d", "--out", "whole", "--strict"], 0, "");
    let found = ids("whole");
    assert_eq!(
        found[2..],
        ["d__b.STEP", "d__b.step", "d__one", "d__x.step", "d__x.stp"],
        "{found:?}"
    );
    assert!(
        found[..2].iter().all(|id| id.starts_with("d__a__b.step--")) && found[0] != found[1],
        "{found:?}"
    );
    for index in 1..=3 {
        let (out, shard) = (format!("share{index}"), format!("{index}/3"));
        check(
            path,
            &["label", "d", "--out", &out, "--shard", &shard],
            0,
            "",
        );
    }
    check(
        path,
        &["merge", "share2", "share3", "share1", "--out", "joined"],
        0,
        "",
    );
    assert_eq!(
        contents(&path.join("whole")),
        contents(&path.join("joined"))
    );
    check(path, &["label", "d", "e/d", "--out", "both"], 0, "");
    check(path, &["label", "e/d", "d", "--out", "turned"], 0, "");
    assert_eq!(index(&path.join("both")), index(&path.join("turned")));
    assert!(
        ids("both").contains(&"e__d__x".to_owned()),
        "{:?}",
        ids("both")
    );
    for (out, again) in [("again1", "d"), ("again2", "./d")] {
        check(
            path,
            &["label", "d", again, "--out", out],
            0,
            "is given 2 times and is read once",
        );
        assert_eq!(index(&path.join("whole")), index(&path.join(out)));
    }
    // The members of a zip, in either order.
    let mut members = vec![
        ("x.step", cuboid()),
        ("x.stp", cuboid()),
        ("y.step", cuboid()),
    ];
    for out in ["zip1", "zip2"] {
        fs::write(path.join("z.zip"), zipped(&members)).unwrap();
        check(path, &["label", "z.zip", "--out", out], 0, "");
        let mut found = ids(out);
        found.sort();
        assert_eq!(found, ["z__x.step", "z__x.stp", "z__y"]);
        members.reverse();
    }
}

#[test]
fn a_text_is_a_list_only_if_its_lines_are_paths() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("a.step"), cuboid()).unwrap();
    for (name, text) in [
        ("readme.md", "# Parts\nThese are our parts.\n"),
        ("table.csv", "name,size\nbolt,3\n"),
        ("mesh.stl", "solid x\nendsolid x\n"),
        ("mesh.glb", "glTF"),
        ("part.sldprt", "\0\0"),
        ("part.igs", "S      1"),
        ("empty.txt", ""),
        ("list.txt", "a.step\n"),
        ("odd.txt", "a.stepp\n"),
    ] {
        fs::write(path.join(name), text).unwrap();
    }
    for (name, words) in [
        (
            "readme.md",
            "neither STEP nor a list of paths, as it begins with `# Parts`",
        ),
        ("table.csv", "neither STEP nor a list"),
        ("mesh.glb", "export STEP"),
        (
            "part.sldprt",
            "a SolidWorks file: open it in a CAD program and export STEP",
        ),
        ("part.igs", "an IGES file"),
        ("empty.txt", "the file is empty"),
        (
            "odd.txt",
            "`--list FILE` reads a file as a list in any case",
        ),
    ] {
        check(path, &["label", name, "--out", "no"], 2, words);
        assert!(!path.join("no").exists(), "{name}");
    }
    check(path, &["label", "list.txt", "--out", "l1"], 0, "");
    check(path, &["label", "--list", "list.txt", "--out", "l2"], 0, "");
    assert_eq!(contents(&path.join("l1")), contents(&path.join("l2")));
    check(
        path,
        &["label", "--list", "odd.txt", "--out", "l3"],
        1,
        "no file could be labeled",
    );
    // A call on everything in a folder continues with the STEP files.
    check(
        path,
        &["label", "a.step", "mesh.stl", "readme.md", "--out", "all"],
        0,
        "",
    );
    assert_eq!(lines(&path.join("all"))["mesh.stl"].1, "skipped");
}
