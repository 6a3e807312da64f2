//! Tests how the options of labeling change the shapes of a text.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot read its own text has failed"
)]

use partprobe_label::{Kernel, LabelError, LabelOptions, Unit, label};

fn part() -> partprobe_synth::SynthPart {
    partprobe_synth::part(
        &partprobe_synth::SynthSettings {
            seed: 3,
            min_parts: 4,
            max_parts: 12,
        },
        1,
    )
}

fn options(change: impl FnOnce(&mut LabelOptions)) -> LabelOptions {
    let mut options = LabelOptions::default();
    change(&mut options);
    options
}

#[test]
fn a_file_and_its_only_solid_have_the_same_parts() {
    let part = part();
    for (unit, id) in [(Unit::File, "x"), (Unit::Solid, "x__s0")] {
        let file = label(
            part.step.as_bytes(),
            "x",
            &options(|options| options.unit = unit),
        )
        .unwrap();
        let [shape] = &file.shapes[..] else {
            panic!("{} shapes", file.shapes.len())
        };
        let carrier = shape.carrier.as_ref().unwrap();
        assert_eq!((shape.id.as_str(), carrier.meta().id.as_str()), (id, id));
        assert_eq!(shape.solid_step_id.is_some(), unit == Unit::Solid);
        assert_eq!(carrier.n_raw_parts(), part.n_parts as usize);
        assert_eq!(carrier.graph().faces.len(), part.n_faces as usize);
        assert_eq!(carrier.meta().source_sha256, file.sha256);
    }
}

#[test]
fn a_mesh_is_made_unless_nothing_needs_it() {
    let part = part();
    for (tau_min, has_mesh, expected) in [(0, false, false), (20, false, true), (0, true, true)] {
        let options = options(|options| {
            options.tau_min = tau_min;
            options.has_mesh = has_mesh;
        });
        let file = label(part.step.as_bytes(), "x", &options).unwrap();
        let carrier = file.shapes[0].carrier.as_ref().unwrap();
        assert_eq!(
            !carrier.mesh().triangles.is_empty(),
            expected,
            "{options:?}"
        );
    }
}

#[test]
fn layers_hold_the_labels_of_their_sources() {
    let block = partprobe_synth::fixtures::cuboid([3.0, 2.0, 1.0]);
    let names = ["step-parts", "brep-face", "color", "step-flipped-50"];
    let options = options(|options| options.layers = names.map(str::to_owned).into());
    let file = label(block.as_bytes(), "x", &options).unwrap();
    let carrier = file.shapes[0].carrier.as_ref().unwrap();

    let stored: Vec<&str> = carrier.layers().keys().map(String::as_str).collect();
    let expected = [
        "brep-face",
        "step-flipped-50",
        "step-parts",
        "step-parts-raw",
    ];
    assert_eq!(stored, expected);

    let labels = |name| carrier.layer(name).unwrap().of_face();
    assert_eq!(labels("brep-face"), [0, 1, 2, 3, 4, 5]);
    assert_eq!(labels("step-parts"), carrier.part_of_face());
    assert_ne!(labels("step-flipped-50"), carrier.part_of_face());

    // The block has no colors.
    let [note] = &carrier.meta().notes[..] else {
        panic!("{:?}", carrier.meta().notes)
    };
    assert!(
        note.starts_with("there is no layer `color`: no face has a color"),
        "{note}"
    );
}

#[test]
fn what_cannot_be_labeled_says_why() {
    let part = part();
    let limited = options(|options| options.tessellation.max_triangles = 3);
    let error = label(part.step.as_bytes(), "x", &limited).unwrap_err();
    assert_eq!(error, LabelError::TooManyTriangles { limit: 3 });
    assert!(error.is_over_budget());

    for ask in [
        (|options: &mut LabelOptions| options.unit = Unit::Solid) as fn(&mut LabelOptions),
        |options| options.instances = true,
    ] {
        let mut requested = options(ask);
        requested.kernel = Kernel::Truck;
        let error = label(part.step.as_bytes(), "x", &requested).unwrap_err();
        assert_eq!(error, LabelError::WholeFilesOnly);
    }

    for (name, reason) in [
        (
            "ward-20",
            "the labels of `ward-20` are not constant on faces",
        ),
        ("wards", "`wards` is not a label source"),
    ] {
        let requested = options(|options| options.layers = vec![name.to_owned()]);
        let error = label(part.step.as_bytes(), "x", &requested).unwrap_err();
        assert!(error.to_string().starts_with(reason), "{error}");
    }

    let error = label(b"solid cube", "x", &LabelOptions::default()).unwrap_err();
    assert!(
        matches!(error, LabelError::Read(_)) && !error.is_over_budget(),
        "{error}"
    );
}
