//! Tests `partprobe predict` as a user runs it: on STEP files, data sets and meshes, and what the other verbs do with its files.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod fixture;
mod folder;

use fixture::{Fixture, assert_code};
use folder::contents;
use partprobe_carrier::{Carrier, GIVEN};
use partprobe_formats::{arrays_from_npz, carrier_from_npz, points_from_ply};
use partprobe_net::{Backend, ModelFile};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

const WEIGHTS: &str = "first/checkpoints/step-parts-0/model.safetensors";

fn carrier(file: &Path) -> Carrier {
    carrier_from_npz(&fs::read(file).unwrap()).unwrap()
}

/// The most frequent label of each face, the lowest at a tie; faces without a point are missing.
fn majority(carrier: &Carrier, triangles: &[u32], labels: &[i32]) -> BTreeMap<u32, i32> {
    let mut counts: BTreeMap<u32, BTreeMap<i32, usize>> = BTreeMap::new();
    for (&triangle, &label) in triangles.iter().zip(labels) {
        let face = carrier.mesh().tri_face[triangle as usize];
        *counts.entry(face).or_default().entry(label).or_default() += 1;
    }
    let winner = |counts: BTreeMap<i32, usize>| {
        let most = counts.values().max().copied().unwrap();
        counts.into_iter().find(|(_, n)| *n == most).unwrap().0
    };
    counts
        .into_iter()
        .map(|(face, counts)| (face, winner(counts)))
        .collect()
}

#[test]
fn shapes_are_divided_and_other_verbs_read_the_labels() {
    let fixture = Fixture::new();
    let data = "first/data/carriers";
    let predict = |out: &str, more: &[&str]| {
        let fixed = ["predict", "first", data, "--k", "step-parts", "--out", out];
        assert_code(&fixture.program(&[&fixed[..], more].concat()), 0);
    };
    predict("parts", &["--jobs", "1"]);
    predict("again", &["--jobs", "3"]);
    let files = contents(&fixture.path("parts"));
    assert_eq!(files, contents(&fixture.path("again")));

    // A folder that lacks a file gets it, and the other shapes are not divided again.
    let of_faces = |file: &&PathBuf| file.extension().is_some_and(|suffix| suffix == "seg");
    let lost = fixture
        .path("again")
        .join(files.keys().find(of_faces).unwrap());
    let kept = fixture
        .path("again")
        .join(files.keys().rfind(of_faces).unwrap());
    assert_ne!(lost, kept);
    fs::remove_file(&lost).unwrap();
    let modified = || fs::metadata(&kept).unwrap().modified().unwrap();
    let before = modified();
    predict("again", &["--resume"]);
    assert_eq!(files, contents(&fixture.path("again")));
    assert_eq!(modified(), before);
    // Carriers that were labeled in another way are divided again: they have other labels, and may have another number of parts.
    let label = |out: &str| {
        let fixed = [
            "label",
            "first/data/step",
            "--out",
            out,
            "--set",
            "label.theta_deg=40",
        ];
        assert_code(&fixture.program(&fixed), 0);
    };
    label("wide");
    let predict_wide = |out: &str, more: &[&str]| {
        let fixed = [
            "predict",
            "first",
            "wide",
            "--k",
            "step-parts",
            "--out",
            out,
        ];
        assert_code(&fixture.program(&[&fixed[..], more].concat()), 0);
    };
    predict_wide("fresh", &[]);
    predict_wide("resumed", &[]);
    let fresh = contents(&fixture.path("fresh"));
    predict("resumed", &["--resume"]);
    assert_ne!(contents(&fixture.path("resumed")), fresh);
    predict_wide("resumed", &["--resume"]);
    assert_eq!(contents(&fixture.path("resumed")), fresh);
    // Shapes that a later call does not name stay in the list.
    let one = contents(&fixture.path("wide"));
    let one = one
        .keys()
        .find(|file| file.extension().is_some_and(|e| e == "npz"))
        .unwrap();
    let one = fixture.path("wide").join(one);
    let fixed = [
        "predict",
        "first",
        one.to_str().unwrap(),
        "--k",
        "step-parts",
        "--out",
        "resumed",
        "--resume",
    ];
    assert_code(&fixture.program(&fixed), 0);
    let n_lines = |out: &str| {
        let path = fixture.path(out).join("shapes.jsonl");
        fs::read_to_string(path).unwrap().lines().count()
    };
    assert_eq!(n_lines("resumed"), n_lines("fresh"));
    // Files of other settings are not mixed.
    let refused = [
        "predict", "first", data, "--k", "3", "--out", "again", "--resume",
    ];
    let output = fixture.program(&refused);
    assert_code(&output, 2);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(
        told.contains(r#"settings.k is "step-parts", not "3""#),
        "{told}"
    );

    // The folder is an input of other verbs, like a data set. Pictures count the labels that they show.
    let sheet = ["render", "parts", "--color", "predicted", "-o", "sheet.svg"];
    assert_code(&fixture.program(&sheet), 0);
    let svg = fs::read_to_string(fixture.path("sheet.svg")).unwrap();
    let export = [
        "export",
        "ply",
        "parts",
        "--label",
        "predicted",
        "-o",
        "mesh",
    ];
    assert_code(&fixture.program(&export), 0);
    let ply_files = contents(&fixture.path("mesh"));
    let is_ply = |file: &&PathBuf| file.extension().is_some_and(|e| e == "ply");
    let n_ply = ply_files.keys().filter(is_ply).count();

    let mut n_shapes = 0;
    for seg in files
        .keys()
        .filter(|file| file.extension().is_some_and(|e| e == "seg"))
    {
        n_shapes += 1;
        let file = fixture.path("parts").join(seg.with_extension("npz"));
        let carrier = carrier(&file);
        let predicted = carrier.layer("predicted").unwrap();
        let lines: Vec<i32> = fs::read_to_string(fixture.path("parts").join(seg))
            .unwrap()
            .lines()
            .map(|line| line.parse().unwrap())
            .collect();
        assert_eq!(lines, predicted.of_face());
        assert!((1..=carrier.n_parts()).contains(&predicted.n_labels()));
        let drawn: BTreeSet<i32> = lines.iter().copied().collect();
        let caption = match drawn.len() {
            1 => "1 label<".to_owned(),
            n => format!("{n} labels<"),
        };
        assert!(svg.contains(&caption), "{caption}");

        let points = fs::read(file.with_extension("points.npz")).unwrap();
        let of_point = arrays_from_npz(&points)
            .unwrap()
            .vector::<i32>("predicted")
            .unwrap();
        // The points are those that a training with the same settings draws.
        let sample = partprobe_carrier::sample_by_area(
            carrier.mesh(),
            600,
            partprobe_carrier::NormalKind::Triangle,
            &mut partprobe_carrier::keyed_rng(0, &["sample", &carrier.meta().id]),
        )
        .unwrap();
        for (face, label) in majority(&carrier, &sample.triangles, &of_point) {
            assert_eq!(lines[face as usize], label);
        }
    }
    assert!(n_shapes > 5, "{n_shapes}");
    assert_eq!(n_ply, n_shapes);

    let labeled = files
        .keys()
        .find(|file| file.extension().is_some_and(|e| e == "seg"));
    let labeled = Path::new("parts").join(labeled.unwrap().with_extension("npz"));
    let labeled = labeled.to_str().unwrap();
    for arguments in [
        &["render", labeled, "--color", "predicted", "-o", "parts.png"][..],
        &[
            "export",
            "glb",
            labeled,
            "--label",
            "predicted",
            "--out",
            "glb",
        ],
        &[
            "export",
            "obj",
            labeled,
            "--label",
            "predicted",
            "--out",
            "obj",
        ],
        // The .seg files are label files like any other.
        &[
            "sources",
            "step-parts",
            "mine",
            "--data",
            data,
            "--out",
            "card",
            "--set",
            "sources.mine.type=faces",
            "--set",
            "sources.mine.path=parts",
        ],
    ] {
        assert_code(&fixture.program(arguments), 0);
    }
    let refused = fixture.program(&[
        "export", "ply", labeled, "--label", "ward-20", "--out", "ply",
    ]);
    assert_code(&refused, 1);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        message.contains(
            "it has no label layer `ward-20`, only predicted, step-parts, step-parts-raw"
        ),
        "{message}"
    );
}

#[test]
fn parts_are_found_after_a_mean_shift_and_unused_settings_are_refused() {
    let fixture = Fixture::new();
    let data = "first/data/carriers";
    let predicted = |out: &str, more: &[&str]| {
        let fixed = ["predict", "first", data, "--out", out];
        assert_code(&fixture.program(&[&fixed[..], more].concat()), 0);
        contents(&fixture.path(out))
    };
    let found = predicted("found", &[]);
    let named = r#"net.refine={type="mean-shift", kappa=20.0, steps=8}"#;
    assert_eq!(found, predicted("named", &["--set", named]));
    assert_ne!(found, predicted("plain", &["--set", "net.refine=none"]));

    for (verb, idle) in [
        ("predict", "train.steps=9"),
        ("embed", "optim.learning_rate=5"),
        ("embed", "eval.restarts=5"),
    ] {
        let output = fixture.program(&[verb, "first", data, "--out", "x", "--set", idle]);
        assert_code(&output, 2);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            message.contains(&format!("--set {idle} changes nothing here")),
            "{message}"
        );
    }
}

#[test]
fn step_files_meshes_and_clouds_are_prepared_as_the_training_was() {
    let fixture = Fixture::new();
    let corners = [
        [0.0, 0.0, 0.0],
        [4.0, 0.0, 0.0],
        [0.0, 3.0, 0.0],
        [0.0, 0.0, 2.0_f64],
    ];
    let vertices = corners.map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat();
    let obj = vertices + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    fs::write(fixture.path("block.obj"), obj).unwrap();
    let rows: Vec<String> = (0..60)
        .map(|n| format!("{} {} {} 0 0 1\n", n % 10, n / 10, f64::from(n % 7) * 0.1))
        .collect();
    fs::write(fixture.path("cloud.xyz"), rows.concat()).unwrap();

    let two = [
        "predict",
        WEIGHTS,
        "block.obj",
        "cloud.xyz",
        "--k",
        "2",
        "--out",
        "two",
    ];
    assert_code(&fixture.program(&two), 0);
    for name in ["block", "cloud"] {
        let carrier = carrier(&fixture.path("two").join(format!("{name}.npz")));
        assert_eq!(carrier.layer("predicted"), carrier.layer(GIVEN));
        assert!((1..=2).contains(&carrier.n_parts()), "{name}");
        assert!(!fixture.path("two").join(format!("{name}.seg")).exists());
        let file = format!("two/{name}.npz");
        let out = format!("ply-{name}");
        let export = [
            "export",
            "ply",
            &file,
            "--label",
            "predicted",
            "--out",
            &out,
        ];
        assert_code(&fixture.program(&export), 0);
    }
    // A cloud has its points, with the predicted parts.
    let ply = fs::read(fixture.path("ply-cloud/cloud.ply")).unwrap();
    let cloud = points_from_ply(&ply).unwrap();
    assert_eq!((cloud.points.len(), cloud.parts.len()), (60, 60));
    let parts: BTreeSet<i32> = cloud.parts.into_iter().collect();
    let predicted = carrier(&fixture.path("two/cloud.npz"));
    assert_eq!(parts.len(), predicted.n_parts());

    let step = fs::read_dir(fixture.path("first/data/step"))
        .unwrap()
        .next()
        .unwrap();
    let step = step.unwrap().path();
    let step = step.to_str().unwrap();
    // Without a number, the clustering finds one; settings of the network are the caller's.
    let found = [
        "predict",
        "first",
        step,
        "--out",
        "found",
        "--set",
        "tokens.test_tokens=32",
    ];
    assert_code(&fixture.program(&found), 0);

    for (arguments, code, error) in [
        (
            &["predict", "first", step, "--out", "found"][..],
            2,
            "is not empty",
        ),
        (
            &["predict", "first", step, "--out", "x", "--k", "0"],
            2,
            "a number from 1 up",
        ),
        (
            &[
                "predict",
                "first",
                step,
                "--out",
                "x",
                "--k",
                "3",
                "--clusterer",
                "modes",
            ],
            2,
            "does not take a number of parts",
        ),
        (
            &[
                "predict",
                "first",
                step,
                "--out",
                "x",
                "--clusterer",
                "average-link",
            ],
            2,
            "needs the number of parts",
        ),
        (
            &[
                "predict",
                "first",
                step,
                "--out",
                "x",
                "--clusterer",
                "average-lnk",
            ],
            2,
            "there is no clustering `average-lnk`, only k-means",
        ),
        (
            &["predict", "first", step, "--out", "x", "--seed", "7"],
            2,
            "the run has no backbone with seed 7, only 0",
        ),
        (
            &[
                "predict",
                WEIGHTS,
                "block.obj",
                "--out",
                "x",
                "--k",
                "step-parts",
            ],
            1,
            "it has no B-Rep",
        ),
        (
            &[
                "predict",
                "first",
                step,
                "--out",
                "x",
                "--supervision",
                "ward-20",
            ],
            2,
            "the run has no backbone `ward-20`",
        ),
        (
            &["predict", "nowhere", step, "--out", "x"],
            2,
            "nowhere is not a folder",
        ),
    ] {
        let output = fixture.program(arguments);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains(error), "{arguments:?}: {message}");
        assert_code(&output, code);
    }
}

#[test]
fn weights_without_training_data_label_nothing_and_start_no_training() {
    let fixture = Fixture::new();
    let own = fs::read(fixture.path(WEIGHTS)).unwrap();
    let mut silent = ModelFile::from_bytes(&own, Backend::default()).unwrap();
    silent.trained_on = None;
    fs::write(
        fixture.path("silent.safetensors"),
        silent.to_bytes().unwrap(),
    )
    .unwrap();

    let data = "first/data/carriers";
    let sources = |weights: &str| {
        let path = format!("sources.field.path={weights}");
        let out = weights.replace('/', "-");
        let arguments = [
            "sources",
            "step-parts",
            "field",
            "--data",
            data,
            "--out",
            &out,
            "--set",
            "sources.field.type=backbone",
            "--set",
            &path,
        ];
        let output = fixture.program(&arguments);
        let [message, card] =
            [output.stderr, output.stdout].map(|bytes| String::from_utf8(bytes).unwrap());
        message + &card
    };
    // A backbone labels what it has not seen, and says of each other shape why not.
    let message = sources(WEIGHTS);
    assert!(
        message.contains("the backbone was trained on this shape"),
        "{message}"
    );
    let message = sources("silent.safetensors");
    assert!(
        message.contains("it does not say on which shapes it was trained"),
        "{message}"
    );

    let train = |weights: &str| {
        let init = format!("train.init={weights}");
        fixture.program(&["run", "tiny.toml", "--out", "second", "--set", &init])
    };
    let refused = train("silent.safetensors");
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        message.contains("silent.safetensors does not say on which shapes it was trained"),
        "{message}"
    );
    assert!(
        !fixture
            .path("second/checkpoints/step-parts-0/model.safetensors")
            .exists()
    );
}

/// Two data sets may have shapes of one name. An input that cannot be read any more leaves the index.
fn earlier_shapes_keep_their_place_in_a_library(fixture: &Fixture, steps: [&Path; 2]) {
    let embed = |input: &str, more: &[&str]| {
        let fixed = ["embed", "first", "--form", "shapes", "--out", "two", input];
        fixture.program(&[&fixed[..], more].concat())
    };
    for (folder, step) in ["c", "d"].iter().zip(steps) {
        let file = format!("{folder}/same.step");
        fs::create_dir(fixture.path(folder)).unwrap();
        fs::copy(step, fixture.path(&file)).unwrap();
        let out = format!("{folder}-data");
        assert_code(&fixture.program(&["label", &file, "--out", &out]), 0);
        fs::remove_file(fixture.path(&file)).unwrap();
    }
    assert_code(&embed("c-data", &[]), 0);
    let before = contents(&fixture.path("two"));
    assert_code(&embed("c-data", &["--resume"]), 0);
    let refused = embed("d-data", &["--resume"]);
    assert_code(&refused, 1);
    let message = String::from_utf8_lossy(&refused.stderr);
    assert!(
        message.contains("has the same id, same, and is there already"),
        "{message}"
    );
    assert_eq!(contents(&fixture.path("two")), before);

    for name in ["x.step", "y.step"] {
        fs::copy(steps[0], fixture.path("c").join(name)).unwrap();
    }
    assert_code(&embed("c", &["--resume"]), 0);
    fs::write(fixture.path("c/x.step"), "no STEP").unwrap();
    assert_code(&embed("c", &["--resume"]), 0);
    assert_code(&embed("c", &["--resume", "--strict"]), 1);
    let index = fs::read_to_string(fixture.path("two/index.jsonl")).unwrap();
    assert!(
        index.contains("c__y.npz") && !index.contains("c__x.npz"),
        "{index}"
    );
}

#[test]
fn a_library_finds_its_own_shapes_and_knows_its_backbone() {
    let fixture = Fixture::new();
    let data = "first/data/carriers";
    let embed = |form: &str, out: &str, more: &[&str]| {
        let fixed = ["embed", "first", data, "--form", form, "--out", out];
        fixture.program(&[&fixed[..], more].concat())
    };
    assert_code(&embed("shapes", "library", &[]), 0);
    let lines = fs::read_to_string(fixture.path("library/index.jsonl")).unwrap();
    let n_shapes = lines.lines().count();
    assert_eq!(n_shapes, 14);
    let before = contents(&fixture.path("library"));

    // What is there is not embedded again, and what is missing is.
    let removed = before
        .keys()
        .find(|file| file.extension().is_some_and(|e| e == "npz"))
        .unwrap();
    fs::remove_file(fixture.path("library").join(removed)).unwrap();
    let again = embed("shapes", "library", &["--resume"]);
    assert_code(&again, 0);
    assert_eq!(String::from_utf8(again.stdout).unwrap().lines().count(), 1);
    assert_eq!(contents(&fixture.path("library")), before);
    // A shape whose file was removed leaves the index.
    let gone = removed.with_extension("").to_string_lossy().into_owned();
    fs::remove_file(fixture.path("library").join(removed)).unwrap();
    let other = fs::read_dir(fixture.path("first/data/step")).unwrap();
    let other = other
        .map(|entry| entry.unwrap().path())
        .find(|path| !path.to_string_lossy().contains(&gone));
    let other = other.unwrap();
    let fixed = [
        "embed", "first", "--form", "shapes", "--out", "library", "--resume",
    ];
    let add =
        |step: &std::path::Path| fixture.program(&[&fixed[..], &[step.to_str().unwrap()]].concat());
    fs::create_dir(fixture.path("a")).unwrap();
    fs::create_dir(fixture.path("b")).unwrap();
    for folder in ["a", "b"] {
        fs::copy(&other, fixture.path(folder).join("new.step")).unwrap();
    }
    assert_code(&add(&fixture.path("a/new.step")), 0);
    let index = || fs::read_to_string(fixture.path("library/index.jsonl")).unwrap();
    assert!(
        !index().contains(&format!("\"id\":\"{gone}\"")),
        "{}",
        index()
    );
    // Another file with the name of an earlier one does not take its place.
    let refused = add(&fixture.path("b/new.step"));
    assert_code(&refused, 1);
    let message = String::from_utf8_lossy(&refused.stderr);
    assert!(message.contains("has the same id, new"), "{message}");
    assert!(index().contains("a/new.step"), "{}", index());
    fs::remove_file(fixture.path("library/new.npz")).unwrap();
    assert_code(&embed("shapes", "library", &["--resume"]), 0);
    assert_eq!(contents(&fixture.path("library")), before);
    // What a killed program leaves behind: a file that is cut off, and one that was not finished.
    fs::write(fixture.path("library").join(removed), "PK").unwrap();
    fs::write(fixture.path("library/.a.npz.1-0.unfinished"), "half").unwrap();
    assert_code(&embed("shapes", "library", &["--resume"]), 0);
    assert_eq!(contents(&fixture.path("library")), before);
    let mut steps = fs::read_dir(fixture.path("first/data/step")).unwrap();
    let another = steps.find_map(|entry| Some(entry.unwrap().path()).filter(|path| *path != other));
    earlier_shapes_keep_their_place_in_a_library(&fixture, [&other, &another.unwrap()]);

    let full = embed("shapes", "library", &[]);
    assert_code(&full, 2);
    let message = String::from_utf8_lossy(&full.stderr);
    assert!(message.contains("library is not empty"), "{message}");

    let step = fs::read_dir(fixture.path("first/data/step"))
        .unwrap()
        .next()
        .unwrap();
    let step = step.unwrap().path();
    let name = step.file_stem().unwrap().to_str().unwrap();
    let nearest = [
        "nearest",
        "library",
        step.to_str().unwrap(),
        "--most",
        "3",
        "--json",
    ];
    let found = fixture.program(&nearest);
    assert_code(&found, 0);
    let found: Vec<serde_json::Value> = String::from_utf8(found.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(found.len(), 3);
    // The points of a file and of its shape in a data set have different seeds, as their ids differ.
    let is_own = |found: &serde_json::Value| found["id"].as_str().unwrap().ends_with(name);
    assert!(is_own(&found[0]), "{found:?}");
    let cosines: Vec<f64> = found
        .iter()
        .map(|found| found["cosine"].as_f64().unwrap())
        .collect();
    assert!(
        cosines.is_sorted_by(|a, b| a >= b) && cosines[0] > 0.9,
        "{cosines:?}"
    );

    assert_code(&embed("faces", "faces", &[]), 0);
    for (file, bytes) in contents(&fixture.path("faces")) {
        if file.extension().is_some_and(|e| e == "npz") {
            let mut members = arrays_from_npz(&bytes).unwrap();
            let counts = members.vector::<u32>("n_points").unwrap();
            assert_eq!(
                members.array("embeddings").unwrap().shape(),
                [counts.len(), 128]
            );
            assert_eq!(counts.iter().sum::<u32>(), 600);
        }
    }

    fs::rename(fixture.path("first"), fixture.path("moved")).unwrap();
    let step = step.to_str().unwrap().replace("first/data", "moved/data");
    for (arguments, code, error) in [
        (
            &["nearest", "library", &step][..],
            2,
            "say with --model where it is now",
        ),
        (&["nearest", "library", &step, "--model", "moved"], 0, ""),
        (
            &["nearest", "faces", &step, "--model", "moved"],
            2,
            "embed with --form shapes",
        ),
        (&["nearest", "moved", &step], 2, "moved has no embed.json"),
        (
            &[
                "embed", "moved", &step, "--form", "points", "--out", "library", "--resume",
            ],
            2,
            "has embeddings of another backbone, form or setting",
        ),
    ] {
        let output = fixture.program(arguments);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains(error), "{arguments:?}: {message}");
        assert_code(&output, code);
    }
}
