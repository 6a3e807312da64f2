//! Tests two faces under ids, names and positions that agree, differ or are missing.

use super::*;
use partprobe_carrier::{
    CarrierMeta, FaceGraph, FaceType, LabelLayer, Mesh, STEP_PARTS, STEP_PARTS_RAW, Units,
};

fn face(step_id: u64, name: Option<&str>) -> Face {
    Face {
        name: name.map(str::to_owned),
        ..Face::new(step_id, FaceType::Plane, 1.0)
    }
}

fn carrier(faces: &[(u64, &str)]) -> Carrier {
    let faces: Vec<Face> = faces
        .iter()
        .map(|&(id, name)| face(id, Some(name).filter(|name| !name.is_empty())))
        .collect();
    let mesh = Mesh {
        vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        vertex_face: vec![0; 3],
        triangles: vec![[0, 1, 2]; faces.len()],
        tri_face: (0..).take(faces.len()).collect(),
        vertex_normal: Vec::new(),
    };
    let meta = CarrierMeta {
        id: "shape".to_owned(),
        source_sha256: String::new(),
        theta_deg: 8.0,
        tau_min: 0,
        chord_mm: 0.01,
        angle_rad: 0.3,
        diagonal_mm: 1.0,
        units: Units::millimeters_and_radians(),
        lost: Vec::new(),
        notes: Vec::new(),
        instances: Vec::new(),
    };
    let graph = FaceGraph {
        faces,
        edges: Vec::new(),
    };
    let one_per_face: LabelLayer = (0..).take(graph.faces.len()).collect();
    let layers = [
        (STEP_PARTS_RAW, one_per_face.clone()),
        (STEP_PARTS, one_per_face),
    ];
    Carrier::new(mesh, graph, layers, meta).unwrap()
}

fn keyed(pairs: &[(&str, &str)]) -> KeyedLabels {
    pairs
        .iter()
        .map(|&(key, label)| (key.to_owned(), raw_label(label)))
        .collect()
}

fn joined(
    faces: &[(u64, &str)],
    entries: &[FaceLabels],
    by: JoinBy,
) -> Result<JoinedFaces, JoinProblem> {
    join(&carrier(faces), entries, by, Scope::Shape, None)
}

#[track_caller]
fn check(
    faces: &[(u64, &str)],
    labels: FaceLabels,
    by: JoinBy,
    expected: (&str, &[&str], &[&str]),
) {
    let found = joined(faces, &[labels], by).unwrap();
    let labels: Vec<&str> = found
        .label_of_face
        .iter()
        .map(|label| label.as_deref().unwrap_or("-"))
        .collect();
    assert_eq!((found.by, labels.as_slice()), (expected.0, expected.1));
    assert_eq!(found.unused, expected.2);
}

#[track_caller]
fn check_refused(faces: &[(u64, &str)], entries: &[FaceLabels], by: JoinBy, expected: &str) {
    let problem = joined(faces, entries, by).unwrap_err();
    assert!(problem.to_string().contains(expected), "{problem}");
}

const TWO: &[(u64, &str)] = &[(12, "left"), (19, "right")];

#[test]
fn labels_find_their_faces() {
    let by_id = || FaceLabels::ByStepId(keyed(&[("19", "5"), ("12", "4")]));
    check(TWO, by_id(), JoinBy::Auto, ("step-id", &["4", "5"], &[]));
    let unknown = FaceLabels::Keyed(keyed(&[("19", "5"), ("77", "6")]));
    check(
        TWO,
        unknown,
        JoinBy::Auto,
        ("step-id", &["-", "5"], &["77"]),
    );
    let by_name = FaceLabels::Keyed(keyed(&[("right", "5"), ("left", "4")]));
    check(TWO, by_name, JoinBy::Auto, ("name", &["4", "5"], &[]));
    let by_index = FaceLabels::Keyed(keyed(&[("1", "5"), ("0", "4")]));
    check(TWO, by_index, JoinBy::Auto, ("order", &["4", "5"], &[]));
    let in_order = FaceLabels::InOrder(vec![raw_label("4"), raw_label("-1")]);
    check(TWO, in_order, JoinBy::Auto, ("order", &["4", "-"], &[]));
    check(
        &[(1, "3"), (2, "")],
        FaceLabels::InOrder(vec![]),
        JoinBy::NameIsLabel,
        ("name-is-label", &["3", "-"], &[]),
    );
    // The same face twice, as in an assembly, has one label.
    check(
        &[(12, ""), (12, "")],
        by_id(),
        JoinBy::Auto,
        ("step-id", &["4", "4"], &["19"]),
    );
}

#[test]
fn what_is_not_certain_is_refused() {
    let in_order = FaceLabels::InOrder(vec![raw_label("4"); 3]);
    check_refused(
        TWO,
        std::slice::from_ref(&in_order),
        JoinBy::Auto,
        "there are 3 labels in order, and the shape has 2 faces",
    );
    check_refused(
        TWO,
        std::slice::from_ref(&in_order),
        JoinBy::StepId,
        "they can by order",
    );
    check_refused(
        TWO,
        &[in_order.clone(), in_order],
        JoinBy::Auto,
        "2 files or lines",
    );

    let twice = FaceLabels::ByStepId(keyed(&[("12", "4"), ("12", "5")]));
    check_refused(TWO, &[twice], JoinBy::Auto, "`12` has two labels");
    let same_name = FaceLabels::Named(keyed(&[("left", "4")]));
    check_refused(
        &[(1, "left"), (2, "left")],
        &[same_name],
        JoinBy::Auto,
        "2 faces have the name `left`",
    );
    let elsewhere = FaceLabels::ByStepId(keyed(&[("77", "4")]));
    check_refused(
        TWO,
        &[elsewhere],
        JoinBy::Auto,
        "no face is found by step-id; the labels have 77",
    );
    let nothing = FaceLabels::Keyed(keyed(&[("up", "4")]));
    check_refused(TWO, &[nothing], JoinBy::Auto, "");
    // The ids are 1 and 0, and the positions are 0 and 1.
    let both = FaceLabels::Keyed(keyed(&[("0", "4"), ("1", "5")]));
    check_refused(
        &[(1, ""), (0, "")],
        &[both],
        JoinBy::Auto,
        "fit by step-id and by order, and these differ",
    );
    check_refused(
        &[(1, "")],
        &[],
        JoinBy::NameIsLabel,
        "no face has a name that is a label",
    );
}

#[test]
fn entries_of_several_solids_are_put_together() {
    let first = FaceLabels::ByStepId(keyed(&[("12", "0"), ("13", "1")]));
    let second = FaceLabels::ByStepId(keyed(&[("19", "1"), ("20", "0")]));
    let other_solid = FaceLabels::ByStepId(keyed(&[("99", "1")]));
    let faces = carrier(&[(12, ""), (13, ""), (19, ""), (20, "")]);
    let entries = [first, second, other_solid];
    let found = |scope, background| {
        let joined = join(&faces, &entries, JoinBy::Auto, scope, background).unwrap();
        assert!(joined.unused.is_empty());
        numbered(&joined.label_of_face)
    };
    assert_eq!(found(Scope::Shape, None), [0, 1, 1, 0]);
    assert_eq!(found(Scope::Entry, None), [0, 1, 3, 2]);
    assert_eq!(found(Scope::Entry, Some("0")), [0, 1, 2, 0]);
}

#[test]
fn labels_of_other_solids_are_not_those_of_this_one() {
    let other_solids = ["98", "99"].map(|id| FaceLabels::ByStepId(keyed(&[(id, "1")])));
    let problem = joined(TWO, &other_solids, JoinBy::Auto).unwrap_err();
    assert_eq!(problem, JoinProblem::NoLabels);
}

#[test]
fn numbers_keep_their_order() {
    let labels = ["10", "word", "9", "-1", "10"].map(raw_label);
    assert_eq!(numbered(&labels), [1, 2, 0, -1, 1]);
}
