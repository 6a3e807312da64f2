//! Tests the same box as different editions, exporters and encodings write it.

use super::fixtures::{StepText, cuboid, cylinder};
use super::{ReadBudget, check, read};
use partprobe_brep::{Brep, LostKind};
use partprobe_shape::FaceType::{Cylinder, Plane};
use std::f64::consts::PI;

const SIDES: [f64; 3] = [10.0, 20.0, 30.0];

fn text_of(text: &StepText) -> String {
    String::from_utf8(text.bytes()).unwrap()
}

#[track_caller]
fn check_box(name: &str, text: impl AsRef<[u8]>) {
    check(name, text, &[(6, Plane)], [12, 6], 2200.0, 6000.0);
}

#[track_caller]
fn brep_of(text: &str) -> Brep {
    read(text.as_bytes(), &ReadBudget::default()).unwrap()
}

/// Checks the number of faces, and for each lost entity its number and the start of its reason.
#[track_caller]
fn check_losses(text: &str, n_faces: usize, expected: &[(LostKind, u64, &str)]) {
    let brep = brep_of(text);
    let lost: Vec<_> = brep
        .lost
        .iter()
        .map(|loss| (loss.kind, loss.step_id, loss.reason.as_str()))
        .collect();
    let agrees = lost
        .iter()
        .zip(expected)
        .all(|(a, b)| (a.0, a.1) == (b.0, b.1) && a.2.starts_with(b.2));
    assert!(
        agrees && lost.len() == expected.len() && brep.faces.len() == n_faces,
        "{} faces, {lost:?}",
        brep.faces.len()
    );
}

/// The number of the first instance of a class.
fn id_of(text: &str, class: &str) -> u64 {
    let before = &text[..text.find(&format!("={class}(")).unwrap()];
    before[before.rfind('#').unwrap() + 1..].parse().unwrap()
}

const SHORT_NAMES: [(&str, &str); 21] = [
    ("CARTESIAN_POINT", "CRTPNT"),
    ("DIRECTION", "DRCTN"),
    ("VERTEX_POINT", "VRTPNT"),
    ("EDGE_CURVE", "EDGCRV"),
    ("ORIENTED_EDGE", "ORNEDG"),
    ("EDGE_LOOP", "EDGLP"),
    ("FACE_OUTER_BOUND", "FCOTBN"),
    ("AXIS2_PLACEMENT_3D", "A2PL3D"),
    ("ADVANCED_FACE", "ADVFC"),
    ("CYLINDRICAL_SURFACE", "CYLSRF"),
    ("CLOSED_SHELL", "CLSSHL"),
    ("MANIFOLD_SOLID_BREP", "MNSLBR"),
    ("ADVANCED_BREP_SHAPE_REPRESENTATION", "ABSR"),
    ("GEOMETRIC_REPRESENTATION_CONTEXT", "GMRPCN"),
    ("GLOBAL_UNIT_ASSIGNED_CONTEXT", "GUAC"),
    ("REPRESENTATION_CONTEXT", "RPRCNT"),
    ("LENGTH_UNIT", "LNGUNT"),
    ("PLANE_ANGLE_UNIT", "PLANUN"),
    ("NAMED_UNIT", "NMDUNT"),
    ("CONVERSION_BASED_UNIT", "CNBSUN"),
    ("SI_UNIT", "SUNT"),
];

#[test]
fn short_names_of_the_first_edition() {
    let short = |text: String| {
        SHORT_NAMES.iter().fold(text, |text, (long, short)| {
            text.replace(&format!("={long}("), &format!("={short}("))
                .replace(&format!("{long}("), &format!("{short}("))
        })
    };
    let text = short(text_of(&cuboid(SIDES)));
    assert!(text.contains("=ADVFC(") && text.contains("SUNT(") && !text.contains("ADVANCED"));
    check_box("short names", &text);
    check_box(
        "short names in lower case",
        text.to_ascii_lowercase().replace("data", "DATA"),
    );
    let short_text = short(text_of(&cylinder(2.0, 3.0)));
    check(
        "cylinder in short names",
        short_text,
        &[(2, Plane), (1, Cylinder)],
        [2, 3],
        20.0 * PI,
        12.0 * PI,
    );
    // The unit is found too.
    let inch = "(CONVERSION_BASED_UNIT('INCH',#4)LENGTH_UNIT()NAMED_UNIT(*))";
    let mut text =
        StepText::with_units(inch, "(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
    text.add("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#5)");
    text.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
    let vertex = text.add("VERTEX_SHELL('',#1)");
    assert_eq!(vertex, 6);
    let faces = text.polyhedron(
        &super::fixtures::box_corners(SIDES),
        &super::fixtures::CUBE_POLYGONS,
    );
    text.solid(&faces);
    assert_eq!(brep_of(&short(text_of(&text))).units.mm_per_unit, 25.4);
}

#[test]
fn scopes_of_the_first_edition() {
    let text = text_of(&cuboid(SIDES));
    let line = |class: &str| {
        text.lines()
            .find(|line| line.contains(&format!("={class}(")))
            .unwrap()
    };
    let (shell, solid) = (line("CLOSED_SHELL"), line("MANIFOLD_SOLID_BREP"));
    let (solid_id, solid_class) = solid.split_once('=').unwrap();
    let (shell_id, shell_class) = shell.split_once('=').unwrap();
    let without_shell = text.replace(&format!("{shell}\n"), "");
    let scope = |inner: &str| {
        without_shell.replace(
            solid,
            &format!("{solid_id}=&SCOPE\n{inner}\nENDSCOPE /{shell_id}/ {solid_class}"),
        )
    };
    check_box("scope", scope(shell));
    check_box(
        "scope without exports",
        scope(shell).replace(&format!("/{shell_id}/"), ""),
    );
    check_box(
        "lower case",
        scope(shell)
            .replace("&SCOPE", "& scope")
            .replace("ENDSCOPE", "endscope"),
    );
    let point = "#9001=CARTESIAN_POINT('',(0.,0.,0.));";
    check_box(
        "nested",
        scope(&format!(
            "{shell_id}=&SCOPE {point} ENDSCOPE /#9001, {shell_id}/ {shell_class}"
        )),
    );
    let end = text.rfind("ENDSEC;").unwrap();
    let with = |extra: &str| format!("{}{extra}\n{}", &text[..end], &text[end..]);
    check_losses(
        &with("#9002=&SCOPE #9001=LINE();"),
        6,
        &[(LostKind::Entity, 9002, "its scope does not end")],
    );
    check_losses(
        &with("ENDSCOPE LINE();"),
        6,
        &[(LostKind::Entity, 0, "a scope ends here that has not begun")],
    );
    check_losses(
        &with("#9002=&SCOPE #9001=LINE(); ENDSCOPE /#9001;"),
        6,
        &[(LostKind::Entity, 9002, "it is not")],
    );
}

#[test]
fn lines_of_one_length() {
    let text = text_of(&cuboid(SIDES));
    let (header, data) = text.split_once("DATA;\n").unwrap();
    let fold = |text: &str, width: usize, line_end: &str| {
        let lines: Vec<String> = text
            .as_bytes()
            .chunks(width)
            .map(|line| String::from_utf8(line.to_vec()).unwrap())
            .collect();
        lines.join(line_end)
    };
    for width in [72, 80] {
        for line_end in ["\n", "\r\n", "\r"] {
            let name = format!("{width} columns, {line_end:?}");
            check_box(&name, fold(&text.replace('\n', ""), width, line_end));
            let header = header.replace('\n', line_end);
            check_box(
                &name,
                format!(
                    "{header}DATA;{line_end}{}",
                    fold(&data.replace('\n', ""), width, line_end)
                ),
            );
        }
    }
    // Each instance begins a line, and only long ones are cut.
    let lines = data.lines().map(|line| fold(line, 30, "\n"));
    check_box(
        "long instances",
        format!("{header}DATA;\n{}\n", lines.collect::<Vec<_>>().join("\n")),
    );
}

#[test]
fn sections_of_the_third_edition() {
    let text = text_of(&cuboid(SIDES));
    let face = id_of(&text, "ADVANCED_FACE");
    let with = |sections: &str| text.replacen("DATA;", &format!("{sections}DATA;"), 1);
    check_box(
        "anchors",
        with(&format!(
            "ANCHOR;\n<face'1>=#{face};\n<a;b(/*c>=(#1,'d''e');\n<f>=$ {{tag:'it''s'}};\nENDSEC;\n"
        )),
    );
    let references = "REFERENCE;\n#9001=<o'ther.stp#b;ox>;\n@5=<x>; /* it's */\nENDSEC;\n";
    check_box("references", with(references));
    check_box(
        "signature",
        format!("{text}SIGNATURE;\nMIIF'jQY(JKo#1=/+==\nENDSEC;\n"),
    );
    let line = text
        .lines()
        .find(|line| line.starts_with(&format!("#{face}=")))
        .unwrap();
    let elsewhere = with(&format!(
        "REFERENCE;\n#{face}=<other.stp#front>;\nENDSEC;\n"
    ))
    .replacen(line, "", 1);
    check_losses(
        &elsewhere,
        5,
        &[(
            LostKind::Face,
            face,
            "it is in another file, <other.stp#front>",
        )],
    );
    let value = text.replacen("(0.0,0.0,0.0)", "(@5,0.0,0.0)", 1);
    assert!(
        brep_of(&value)
            .lost
            .iter()
            .any(|loss| loss.reason.contains("a value is in another file"))
    );
}

#[test]
fn headers_with_an_apostrophe_too_many() {
    let text = text_of(&cuboid(SIDES));
    for name in ["John's part", "a'", "'", "O''Brien's", "x;#1=Y();DATA;"] {
        check_box(name, text.replacen("'test'", &format!("'{name}'"), 1));
    }
}

#[test]
fn flags_in_every_spelling() {
    let text = text_of(&cuboid(SIDES));
    for (yes, no) in [
        (".true.", ".false."),
        (".TRUE.", ".FALSE."),
        (".t.", ".f."),
        ("BOOLEAN(.T.)", "LOGICAL(.F.)"),
    ] {
        check_box(yes, text.replace(".T.", yes).replace(".F.", no));
    }
    let reason = "its orientation is not given";
    for unknown in [".U.", ".u.", ".UNKNOWN.", "$", "*"] {
        for class in [
            "ADVANCED_FACE",
            "FACE_OUTER_BOUND",
            "EDGE_CURVE",
            "ORIENTED_EDGE",
        ] {
            let start = text.find(&format!("={class}(")).unwrap();
            let end = start + text[start..].find(';').unwrap();
            let changed = text[start..end].replace(".T.", unknown);
            let changed = format!("{}{changed}{}", &text[..start], &text[end..]);
            check_losses(
                &changed,
                6,
                &[(LostKind::Entity, id_of(&text, class), reason)],
            );
        }
    }
}

#[test]
fn tokens_as_other_exporters_write_them() {
    let text = text_of(&cuboid(SIDES));
    let (header, data) = text.split_once("DATA;\n").unwrap();
    let numbers = data
        .replace("10.0", "1.E+01")
        .replace("20.0", "2D1")
        .replace("30.0", "+30.")
        .replace(",0.0", ",-.0");
    for (name, data) in [
        ("numbers", numbers),
        ("leading zeros", data.replace('#', "#000")),
        ("carriage returns", data.replace('\n', "\r")),
        ("no line ends", data.replace('\n', "")),
        ("lower case", data.to_ascii_lowercase()),
        (
            "left out",
            data.replace("'',*,*", ",,")
                .replace("DIRECTION('',", "DIRECTION($,"),
        ),
        (
            "typed",
            data.replace(",1.)", ",LENGTH_MEASURE(1.))")
                .replace("BREP('body'", "BREP(LABEL('body')"),
        ),
        (
            "print directives",
            data.replace(";\n", ";\\N\\\n").replace('=', "\\F\\="),
        ),
        (
            "comments in comments",
            format!("/* outer /* inner */\n/**//***//*/*/{data}"),
        ),
        (
            "a user's classes",
            format!("#9001=!MY_THING('x',(1,2),#1);\n{data}"),
        ),
        ("no end", data.split("ENDSEC;").next().unwrap().to_owned()),
        (
            "rubbish behind the end",
            format!("{data}\x1a\0 #12 'open ("),
        ),
        ("strings", data.replace("'body'", "'a;b#1=X(''/*'")),
    ] {
        check_box(name, format!("{header}DATA;\n{data}"));
    }
    let end = text.rfind("ENDSEC;").unwrap();
    let large = format!(
        "{}#99999999999999999999999=LINE();\n{}",
        &text[..end],
        &text[end..]
    );
    check_losses(
        &large,
        6,
        &[(
            LostKind::Entity,
            0,
            "#99999999999999999999999: its number has more than 64 bits",
        )],
    );
    // A face with such a number is lost, but the other faces of its shell are not.
    let large = text.replace(
        "CLOSED_SHELL('',(",
        "CLOSED_SHELL('',(#99999999999999999999999,",
    );
    let shell = id_of(&text, "CLOSED_SHELL");
    check_losses(
        &large,
        6,
        &[(
            LostKind::Face,
            shell,
            "it refers to a number of more than 64 bits",
        )],
    );
}

/// Checks the name of the solid, which is written with these bytes.
#[track_caller]
fn check_name(written: &[u8], expected: &str) {
    let text = cuboid(SIDES).bytes();
    let at = text
        .windows(6)
        .position(|bytes| bytes == b"'body'")
        .unwrap();
    let text = [&text[..=at], written, &text[at + 5..]].concat();
    check_box(expected, &text);
    let brep = read(&text, &ReadBudget::default()).unwrap();
    assert_eq!(brep.solids[0].name.as_deref(), Some(expected));
}

#[test]
fn names_in_every_encoding() {
    check_name("Gehäuse".as_bytes(), "Gehäuse");
    check_name(b"Geh\xe4use", "Gehäuse");
    check_name(b"\xd8 12", "Ø 12");
    check_name(b"\xc4\xe5\xf2\xe0\xeb\xfc 5", "Деталь 5");
    check_name(b"\xc6\xbd\xc3\xe6", "平面");
    check_name(b"\xb3\xdd\xc2\xd6", "齿轮");
    check_name(b"\x95\x94\x95\x69", "部品");
    // The second half of two of these three characters is a backslash. In the last one, it is right before the quote.
    check_name(b"\x95\x5c\x8e\xa6\x83\x5c", "表示ソ");
    check_name(br"\PE\\S\:\S\^", "Ко");
    check_name(br"\X2\96F64EF6\X0\ \X\D8", "零件 Ø");
    check_name(b"long\r\n  na\nme", "long  name");
    check_name(br"C:\parts\new", r"C:\parts\new");
    check_name(br"\S\' 5", "§ 5");
    check_name(b"it''s", "it's");
}

#[test]
fn wide_files() {
    let text = text_of(&cuboid(SIDES)).replace("'body'", "'Gehäuse 零件'");
    let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
    let marked = |mark: &[u8], bytes: &[u8]| [mark, bytes].concat();
    for bytes in [
        marked(&[0xff, 0xfe], &little),
        marked(&[0xfe, 0xff], &big),
        little,
        big,
        marked(b"\xef\xbb\xbf", text.as_bytes()),
    ] {
        check_box("wide", &bytes);
        assert_eq!(
            read(&bytes, &ReadBudget::default()).unwrap().solids[0]
                .name
                .as_deref(),
            Some("Gehäuse 零件")
        );
    }
}
