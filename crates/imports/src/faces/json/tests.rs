//! Tests the structures of each data set, in a few faces.

use super::*;

fn labels_of(items: &[&str]) -> Vec<RawLabel> {
    items.iter().map(|&item| raw_label(item)).collect()
}

fn pairs(items: &[(&str, &str)]) -> Vec<(String, RawLabel)> {
    items
        .iter()
        .map(|&(key, label)| (key.to_owned(), raw_label(label)))
        .collect()
}

#[track_caller]
fn check(text: &str, column: Option<&str>, expected: FaceLabels) {
    assert_eq!(labels(text.as_bytes(), column), Ok(expected));
}

#[track_caller]
fn check_refused(text: &str, column: Option<&str>, expected: &str) {
    let refusal = labels(text.as_bytes(), column).unwrap_err();
    assert!(refusal.contains(expected), "{refusal}");
}

#[test]
fn lists_are_in_order() {
    check(
        "[3, 0, -1, 2.0]",
        None,
        FaceLabels::InOrder(labels_of(&["3", "0", "-1", "2"])),
    );
    check(
        r#"{"file": "a.step", "by": "order", "labels": [4, 0]}"#,
        None,
        FaceLabels::InOrder(labels_of(&["4", "0"])),
    );
    check(
        r#"{"file": "a.step", "by": "name", "labels": [4, 0]}"#,
        None,
        FaceLabels::Named(pairs(&[("0", "4"), ("1", "0")])),
    );
}

#[test]
fn faces_are_known_by_their_keys() {
    check(
        r##"{"12": 3, "#19": "a"}"##,
        None,
        FaceLabels::Keyed(pairs(&[("19", "a"), ("12", "3")])),
    );
    let text =
        r#"{"file": "abc/a.step", "solid_step_id": 190, "faces": {"159": [1, 23], "79": [0, 24]}}"#;
    check(
        text,
        Some("instance"),
        FaceLabels::ByStepId(pairs(&[("159", "1"), ("79", "0")])),
    );
    check(
        text,
        Some("class"),
        FaceLabels::ByStepId(pairs(&[("159", "23"), ("79", "24")])),
    );
    check(
        text,
        Some("1"),
        FaceLabels::ByStepId(pairs(&[("159", "23"), ("79", "24")])),
    );
    check_refused(
        text,
        None,
        "`159`: a face has 2 labels; take one with the key `column`",
    );
    check_refused(text, Some("2"), "a face has no label 2");
    check(
        r#"[{"step_id": 12, "label": 3}, {"step_id": 13, "label": 0}]"#,
        None,
        FaceLabels::ByStepId(pairs(&[("12", "3"), ("13", "0")])),
    );
    check_refused(
        r#"[{"step_id": 12, "label": 3, "class": 1}]"#,
        None,
        "several labels",
    );
}

#[test]
fn mfcad_names_its_faces_by_index() {
    let text = r#"{"body": {"faces": [{"segment": {"index": 15}}, {"segment": {"index": 2}}]}}"#;
    check(
        text,
        None,
        FaceLabels::Named(pairs(&[("0", "15"), ("1", "2")])),
    );
    check_refused(
        r#"{"body": {"faces": [{"segment": {"index": []}}]}}"#,
        None,
        "must be a number",
    );
}

#[test]
fn mfinstseg_has_classes_and_a_matrix_of_instances() {
    let text = r#"[["part_1", {"seg": {"0": 24, "2": 1, "1": 3, "3": 1}, "bottom": {"0": 0, "1": 1, "2": 0, "3": 0},
        "inst": [[0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 1, 1]]}]]"#;
    check(
        text,
        None,
        FaceLabels::InOrder(labels_of(&["24", "3", "1", "1"])),
    );
    check(
        text,
        Some("instance"),
        FaceLabels::InOrder(labels_of(&["stock", "1", "2", "2"])),
    );
    check(
        text,
        Some("bottom"),
        FaceLabels::InOrder(labels_of(&["0", "1", "0", "0"])),
    );
    check_refused(
        r#"{"seg": {"0": 1, "2": 1}}"#,
        None,
        "without a gap, but `2` is among 2",
    );
    check_refused(
        r#"{"seg": {"0": 1}, "inst": [[0, 1]]}"#,
        Some("instance"),
        "row 0",
    );
}

#[test]
fn a_matrix_joins_what_it_joins_in_one_direction() {
    let text = r#"{"seg": [1, 1, 1, 1], "inst": [[0, 0, 0, 1], [0, 0, 1, 0], [0, 0, 0, 0], [0, 0, 1, 0]]}"#;
    check(
        text,
        Some("instance"),
        FaceLabels::InOrder(labels_of(&["0", "0", "0", "0"])),
    );
}

#[test]
fn mftrcad_has_classes_and_groups() {
    let text = r#"{"cls": {"0": 5, "1": 2, "2": 5, "3": 24}, "seg": [[0, 2], [1]]}"#;
    check(
        text,
        None,
        FaceLabels::InOrder(labels_of(&["5", "2", "5", "24"])),
    );
    check(
        text,
        Some("instance"),
        FaceLabels::InOrder(labels_of(&["0", "1", "0", "stock"])),
    );
    check_refused(
        r#"{"cls": {"0": 5}, "seg": [[0], [0]]}"#,
        Some("instance"),
        "face 0 is in two groups",
    );
}

#[test]
fn the_timeline_of_fusion_names_features() {
    let text = r#"{"faces": [{"feature": "Extrude1", "location_in_feature": "SideFace"}, {"feature": "Fillet2"}]}"#;
    check(
        text,
        None,
        FaceLabels::InOrder(labels_of(&["Extrude1", "Fillet2"])),
    );
}

#[test]
fn a_file_may_hold_many_shapes() {
    let lines = "{\"file\": \"abc/a.step\", \"faces\": {\"7\": 1}}\n\n{\"shape\": \"b\", \"labels\": [0, 1]}\n";
    let found = shapes_of_lines(lines.as_bytes(), None);
    let files: Vec<(&str, &str)> = found
        .iter()
        .map(|shape| shape.as_ref().unwrap())
        .map(|shape| (shape.file.as_str(), shape.place.as_str()))
        .collect();
    assert_eq!(files, [("abc/a.step", "line 1"), ("b", "line 3")]);

    let list = r#"[["p1", {"seg": {"0": 1}}], ["p2", {"seg": {"0": 2}}]]"#;
    assert_eq!(shapes(list.as_bytes(), None).unwrap().len(), 2);
    assert!(shapes(b"[1, 2]", None).unwrap().is_empty());
}

#[test]
fn a_damaged_line_loses_only_its_shape() {
    for (line, file, reason) in [
        (&b"{"[..], None, "not JSON"),
        (b"\"\xff\"", None, "not JSON"),
        (
            b"{\"labels\": [0]}",
            None,
            "no entry `file` names the shape",
        ),
        (b"{\"file\": \"a\", \"labels\": 7}", Some("a"), "list"),
    ] {
        let whole = b"{\"file\": \"b\", \"labels\": [0]}";
        let bytes = [&whole[..], line, whole].join(&b'\n');
        let found = shapes_of_lines(&bytes, None);
        let damaged = found[1].as_ref().unwrap_err();
        assert_eq!(damaged.file.as_deref(), file);
        assert_eq!(damaged.place, "line 2");
        assert!(damaged.reason.contains(reason), "{}", damaged.reason);
        assert!(found[0].is_ok() && found[2].is_ok());
    }
}
