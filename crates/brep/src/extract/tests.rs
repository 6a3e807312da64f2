//! Tests extracts of small files: their instances, their numbers, and that they are read as before.

use super::*;
use crate::fixtures::{
    CUBE_POLYGONS, StepText, box_corners, cuboid, cylinder, references as listed,
};
use crate::{TessellationOptions, read, tessellate};
use partprobe_shape::FaceType;

fn cut(text: &[u8], ids: &[u64], numbering: Numbering) -> Result<Extract, ExtractError> {
    extract(text, ids, numbering, &ReadBudget::default())
}

/// The number, type and area of each face.
fn faces(text: &[u8]) -> Vec<(u64, FaceType, f64)> {
    let brep = read(text, &ReadBudget::default()).unwrap();
    let shape = tessellate(&brep, &TessellationOptions::default());
    assert_eq!(shape.lost, []);
    shape
        .graph
        .faces
        .iter()
        .map(|face| (face.step_id, face.face_type, face.area))
        .collect()
}

fn ids_of(text: &[u8], class: &str) -> Vec<u64> {
    let text = std::str::from_utf8(text).unwrap();
    let of_class = text.lines().filter(|line| {
        line.split('=')
            .nth(1)
            .is_some_and(|rest| rest.starts_with(class))
    });
    of_class
        .map(|line| line[1..line.find('=').unwrap()].parse().unwrap())
        .collect()
}

/// Checks that the extract has these faces of the file, unchanged.
#[track_caller]
fn check(text: &[u8], ids: &[u64], expected: &[u64]) {
    let whole = faces(text);
    for numbering in [Numbering::FromOne, Numbering::Kept] {
        let extract = cut(text, ids, numbering).unwrap();
        assert_eq!((&extract.missing, extract.n_left_out), (&Vec::new(), 0));
        let old_of = |new: u64| extract.numbers.iter().find(|pair| pair.1 == new).unwrap().0;
        let found: Vec<(u64, FaceType, f64)> = faces(&extract.text)
            .into_iter()
            .map(|(id, face_type, area)| (old_of(id), face_type, area))
            .collect();
        assert_eq!(
            found.iter().map(|face| face.0).collect::<Vec<_>>(),
            expected
        );
        for (id, face_type, area) in found {
            let before = whole.iter().find(|face| face.0 == id).unwrap();
            assert_eq!(before.1, face_type);
            assert!(
                (before.2 - area).abs() <= 1e-3 * area,
                "#{id}: {area}, before {}",
                before.2
            );
        }
        let is_new = |(i, &(old, new)): (u64, &(u64, u64))| {
            new == if numbering == Numbering::Kept { old } else { i }
        };
        assert!((1..).zip(&extract.numbers).all(is_new));
        assert_eq!(cut(text, ids, numbering).unwrap(), extract);
    }
}

#[test]
fn faces_shells_and_solids_are_what_they_were() {
    for text in [cuboid([1.0, 2.0, 3.0]).bytes(), cylinder(2.0, 5.0).bytes()] {
        let all = ids_of(&text, "ADVANCED_FACE");
        for &face in &all {
            check(&text, &[face], &[face]);
        }
        check(&text, &all[..2], &all[..2]);
        for class in [
            "CLOSED_SHELL",
            "MANIFOLD_SOLID_BREP",
            "ADVANCED_BREP_SHAPE_REPRESENTATION",
        ] {
            check(&text, &ids_of(&text, class), &all);
        }
    }
}

#[test]
fn entities_below_a_face_are_cut_out_with_the_faces_that_use_them() {
    let text = cylinder(2.0, 5.0).bytes();
    let all = ids_of(&text, "ADVANCED_FACE");
    check(&text, &ids_of(&text, "CYLINDRICAL_SURFACE"), &all[2..]);
    check(&text, &ids_of(&text, "EDGE_CURVE")[..1], &[all[0], all[2]]);
    check(&text, &ids_of(&text, "FACE_OUTER_BOUND")[1..2], &all[1..2]);
}

#[test]
fn units_come_from_the_representation_that_lists_the_entity() {
    let inch = "(CONVERSION_BASED_UNIT('INCH',#4)LENGTH_UNIT()NAMED_UNIT(*))";
    let mut text =
        StepText::with_units(inch, "(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
    text.add("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#5)");
    text.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
    let faces = text.polyhedron(&box_corners([1.0; 3]), &CUBE_POLYGONS);
    text.solid(&faces);
    check(&text.bytes(), &[faces[3] as u64], &[faces[3] as u64]);
}

#[test]
fn names_and_header_are_neutral_and_coordinates_stay() {
    let mut text = StepText::in_millimeters();
    let point = text.add("CARTESIAN_POINT('ACME origin',(0.10,-2.50E-1,0.))");
    let direction = text.add("DIRECTION('ACME up',(0.,0.,1.))");
    text.add(format!(
        "AXIS1_PLACEMENT('ACME axis',#{point},#{direction})"
    ));
    let extract = cut(&text.bytes(), &[6], Numbering::FromOne).unwrap();
    let small = String::from_utf8(extract.text).unwrap();
    assert!(
        small
            .contains("#1=CARTESIAN_POINT('',(0.10,-2.50E-1,0.));\n#2=DIRECTION('',(0.,0.,1.));\n"),
        "{small}"
    );
    assert!(small.contains("#3=AXIS1_PLACEMENT('',#1,#2);\n"), "{small}");
    assert!(
        small.contains("FILE_NAME('','',(''),(''),'','','');") && !small.contains("ACME"),
        "{small}"
    );
    assert_eq!(extract.numbers, [(4, 1), (5, 2), (6, 3)]);
}

#[test]
fn references_to_missing_entities_are_kept() {
    let mut text = StepText::in_millimeters();
    text.add("LINE('',#90,#5)");
    text.add("VECTOR('',#91,1.)");
    let extract = cut(&text.bytes(), &[4], Numbering::FromOne).unwrap();
    assert_eq!(
        (extract.missing.as_slice(), extract.n_instances),
        ([90, 91].as_slice(), 2)
    );
    let small = String::from_utf8(extract.text).unwrap();
    assert!(
        small.contains("#1=LINE('',#3,#2);\n#2=VECTOR('',#4,1.);\n"),
        "{small}"
    );
    let kept = String::from_utf8(cut(&text.bytes(), &[4], Numbering::Kept).unwrap().text).unwrap();
    assert!(kept.contains("#4=LINE('',#90,#5);\n"), "{kept}");
}

#[test]
fn what_many_faces_use_shows_some_of_them() {
    let mut text = StepText::in_millimeters();
    let mut all = Vec::new();
    for i in 0..2 {
        let corners = box_corners([1.0; 3]).map(|[x, y, z]| [x + 2.0 * f64::from(i), y, z]);
        all.extend(text.polyhedron(&corners, &CUBE_POLYGONS));
    }
    let shell = text.add(format!("OPEN_SHELL('',({}))", listed(&all)));
    text.add(format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"));
    let one_direction = String::from_utf8(text.bytes())
        .unwrap()
        .replace("AXIS2_PLACEMENT_3D('',", "AXIS2_PLACEMENT_3D('',#7,#8,");
    let extract = cut(one_direction.as_bytes(), &[7], Numbering::Kept).unwrap();
    assert_eq!(extract.n_left_out, 4);
}

#[test]
fn what_cannot_be_cut_out_is_named() {
    let text = cuboid([1.0; 3]).bytes();
    let last = ids_of(&text, "ADVANCED_BREP_SHAPE_REPRESENTATION")[0];
    assert_eq!(
        cut(&text, &[9999], Numbering::FromOne),
        Err(ExtractError::Unknown {
            id: 9999,
            first: 1,
            last
        })
    );
    let damaged = b"ISO-10303-21;DATA;#1=PLANE('',#2;\n#2=LINE();";
    assert!(matches!(
        cut(damaged, &[1], Numbering::FromOne),
        Err(ExtractError::Damaged { id: 1, .. })
    ));
    assert_eq!(
        cut(b"solid", &[1], Numbering::FromOne),
        Err(ExtractError::NotStep)
    );
    assert_eq!(
        cut(b"ISO-10303-21;", &[1], Numbering::FromOne),
        Err(ExtractError::NoData)
    );
}
