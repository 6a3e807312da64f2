//! Tests `render`: the same picture on every call, from any kind of input, and what is refused.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

use partprobe_synth::{SynthSettings, fixtures, part};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs the program in a folder and expects this exit code; stdout or stderr must contain the text.
#[track_caller]
fn check(folder: &Path, arguments: &str, code: i32, text: &str) {
    let words = arguments.split_whitespace();
    let output = Command::new(env!("CARGO_BIN_EXE_partprobe"))
        .args(words)
        .current_dir(folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments}: {said}");
    assert!(
        said.contains(text) && !said.contains("panicked"),
        "{arguments}: `{text}` is not in {said}"
    );
}

/// `steps/` with a box and three larger parts.
fn parts() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let steps = folder.path().join("steps");
    fs::create_dir(&steps).unwrap();
    fs::write(
        steps.join("a.step"),
        fixtures::cylinder(3.0, 4.0, fixtures::FullTurn::Halved),
    )
    .unwrap();
    let settings = SynthSettings {
        seed: 3,
        min_parts: 5,
        max_parts: 12,
    };
    for index in 0..3 {
        fs::write(
            steps.join(format!("p{index}.step")),
            part(&settings, index).step,
        )
        .unwrap();
    }
    folder
}

/// Width, height and pixels.
fn png(path: &Path) -> (u32, u32, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(fs::read(path).unwrap()))
        .read_info()
        .unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    (info.width, info.height, pixels)
}

#[test]
fn pictures_are_the_same_for_any_input_and_number_of_threads() {
    let folder = parts();
    let path = folder.path();
    check(path, "label steps --out d --attributes normal", 0, "");
    check(
        path,
        "render d -o 1.png --jobs 1 --size 96",
        0,
        "4 shapes drawn",
    );
    check(
        path,
        "render d -o 3.png --jobs 3 --size 96",
        0,
        "4 shapes drawn",
    );
    check(
        path,
        "render steps -o steps.png --size 96",
        0,
        "4 shapes drawn",
    );
    let first = fs::read(path.join("1.png")).unwrap();
    assert_eq!(fs::read(path.join("3.png")).unwrap(), first);
    assert_eq!(fs::read(path.join("steps.png")).unwrap(), first);
    let (width, height, _) = png(&path.join("1.png"));
    assert!(width == 2 * 96 && height > 2 * 96);
}

#[test]
fn colors_stages_and_views_differ() {
    let folder = parts();
    let path = folder.path();
    let mut pictures = Vec::new();
    for arguments in [
        "",
        "--color face",
        "--color type",
        "--view corner",
        "--theta 0",
    ] {
        check(
            path,
            &format!("render steps/a.step -o a.png --size 64 {arguments}"),
            0,
            "1 shape drawn",
        );
        let (width, height, pixels) = png(&path.join("a.png"));
        assert_eq!((width, height), (64, 64));
        pictures.push(pixels);
    }
    // Two halves of a wall are one part; by face, and where no angle joins, they are two.
    assert_ne!(pictures[0], pictures[1]);
    assert_ne!(pictures[0], pictures[2]);
    assert_eq!(pictures[0], pictures[3]);
    check(
        path,
        "render steps -o s.png --size 64 --stages",
        0,
        "4 shapes drawn",
    );
    assert_eq!(png(&path.join("s.png")).0, 3 * 64);
}

#[test]
fn the_shapes_with_most_parts_are_picked_and_bad_files_are_named() {
    let folder = parts();
    let path = folder.path();
    fs::write(path.join("steps/bad.step"), "hello").unwrap();
    check(
        path,
        "render steps -o most.png --size 64 --most-parts 3",
        0,
        "warning: steps__bad",
    );
    check(
        path,
        "render steps/p0.step steps/p1.step steps/p2.step -o chosen.png --size 64",
        0,
        "3 shapes drawn, 0 failed",
    );
    // The names differ, and so may the order; the size says that the box is not there.
    assert_eq!(
        png(&path.join("most.png")).0,
        png(&path.join("chosen.png")).0
    );
    check(
        path,
        "render steps/bad.step -o no.png",
        1,
        "no shape has a carrier",
    );
    check(
        path,
        "render gone.step -o no.png",
        2,
        "gone.step does not exist",
    );
    check(
        path,
        "render steps -o no.png --theta 200",
        2,
        "--theta must be from 0 to 180",
    );
    check(
        path,
        "render steps -o no.png --most-parts 0",
        2,
        "--most-parts",
    );
    assert!(!path.join("no.png").exists());
}

#[test]
fn figures_have_legends_cameras_and_backgrounds() {
    let folder = parts();
    let path = folder.path();
    let draw = |arguments: &str, name: &str| {
        let call = format!("render steps/p0.step -o {name} --size 96 {arguments}");
        check(path, &call, 0, "1 shape drawn");
        fs::read(path.join(name)).unwrap()
    };
    draw("--legend", "legend.png");
    let (width, height, _) = png(&path.join("legend.png"));
    assert!(width > 96 && height == 96);
    draw("--background transparent", "clear.png");
    let (_, _, pixels) = png(&path.join("clear.png"));
    assert_eq!((pixels.len(), &pixels[..4]), (4 * 96 * 96, &[0; 4][..]));
    draw("--background #102030", "dark.png");
    assert_eq!(png(&path.join("dark.png")).2[..3], [16, 32, 48]);
    let top = draw("--camera top", "top.png");
    assert_eq!(draw("--camera 0,90", "same.png"), top);
    assert_eq!(draw("--camera 0,0,1", "same.png"), top);
    assert_ne!(draw("--camera front", "front.png"), top);
    assert_ne!(draw("--camera top --up x", "turned.png"), top);

    let svg = String::from_utf8(draw("--legend --color type", "a.svg")).unwrap();
    assert!(
        svg.starts_with("<svg ") && svg.contains(">plane</text>"),
        "{svg}"
    );
    assert!(draw("--stages", "a.pdf").starts_with(b"%PDF-"));
    assert_eq!(draw("", "b.pdf"), draw("", "c.pdf"));
    for (arguments, code, text) in [
        ("-o a.gif", 2, "give a name that ends in .png, .svg or .pdf"),
        ("-o a.png --camera above", 2, "is not a viewpoint"),
        ("-o a.png --up w", 2, "is not an axis"),
        ("-o a.png --background pink", 2, "is not a background"),
        (
            "-o a.png --color nothing",
            1,
            "it has no label layer `nothing`",
        ),
    ] {
        check(
            path,
            &format!("render steps/p0.step {arguments}"),
            code,
            text,
        );
    }
}
