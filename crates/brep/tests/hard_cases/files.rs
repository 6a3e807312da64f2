//! Tests the rest of a file: units, contexts, schemas, placements, and how exporters write them.

use super::bounded::spline_cylinder;
use super::revolved::horn_bend;
use super::*;
use FaceType::{Bspline, Cone, Cylinder, Plane, Torus};
use fixtures::{CUBE_POLYGONS, box_corners, cuboid, cylinder};
use partprobe_brep::tessellate_instances;
use partprobe_synth::fixtures::{Angle, FullTurn, Length};
use std::f64::consts::PI;

#[test]
fn several_contexts_have_their_own_units() {
    let mut text = cuboid([1.0; 3]);
    let centimeter = text.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.CENTI.,.METRE.))");
    let context = text.add(format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#{centimeter},#3))REPRESENTATION_CONTEXT('',''))"
    ));
    let faces = text.polyhedron(&box_corners([1.0; 3]), &CUBE_POLYGONS);
    let shell = text.add(format!("CLOSED_SHELL('',({}))", references(&faces)));
    let solid = text.add(format!("MANIFOLD_SOLID_BREP('',#{shell})"));
    text.add(format!(
        "ADVANCED_BREP_SHAPE_REPRESENTATION('',(#{solid}),#{context})"
    ));
    check(
        "several contexts",
        text.bytes(),
        &[(12, Plane)],
        [24, 12],
        606.0,
        1001.0,
    );
}

#[test]
fn units_of_every_kind() {
    let slant = PI * 17.0 * 7_f64.hypot(20.0);
    let volume = PI * 20.0 / 3.0 * (144.0 + 60.0 + 25.0);
    let text = partprobe_synth::fixtures::frustum(12.0, 5.0, 20.0, FullTurn::Seamed, Angle::Degree);
    check(
        "degrees",
        text,
        &[(2, Plane), (1, Cone)],
        [2, 3],
        slant + 169.0 * PI,
        volume,
    );
    for length in [Length::Millimeter, Length::Inch, Length::Meter] {
        check_plate(
            &format!("{length:?}"),
            partprobe_synth::fixtures::plate_with_hole(50.0, 6.0, 12.0, FullTurn::Seamed, length),
        );
    }
}

#[track_caller]
fn check_plate(name: &str, text: impl AsRef<[u8]>) {
    let disc = 144.0 * PI;
    let area = 2.0 * (2500.0 - disc) + 1200.0 + 144.0 * PI;
    check(
        name,
        text,
        &[(6, Plane), (1, Cylinder)],
        [14, 7],
        area,
        6.0 * (2500.0 - disc),
    );
}

#[test]
fn texts_as_exporters_write_them() {
    let plate = partprobe_synth::fixtures::plate_with_hole(
        50.0,
        6.0,
        12.0,
        FullTurn::Seamed,
        Length::Millimeter,
    );
    let (header, data) = plate.split_at(plate.find("DATA;").unwrap());
    check_plate("$", header.to_owned() + &data.replace("''", "$"));
    check_plate(
        "comments",
        plate
            .replace('=', "/**/=/* = */")
            .replace("\n#", "\n/* it's; #1=PLANE( */#"),
    );
    check_plate(
        "huge ids",
        header.to_owned() + &data.replace('#', "#900000000000000"),
    );
    check_plate(
        "1990s line breaks",
        header.to_owned() + &data.replace(',', " ,\r\n   ").replace('(', " ( "),
    );
    let mut bytes = header.as_bytes().to_vec();
    bytes.extend(data.replace("''", "'@'").bytes().flat_map(|b| {
        if b == b'@' {
            vec![0xc3, 0xa9, 0xe9, 0xff]
        } else {
            vec![b]
        }
    }));
    check_plate("non-ASCII", bytes);
    let mut lines: Vec<&str> = data.lines().filter(|line| line.starts_with('#')).collect();
    lines.reverse();
    check_plate(
        "entities backwards",
        format!(
            "{header}DATA;\n{}\nENDSEC;\nEND-ISO-10303-21;\n",
            lines.join("\n")
        ),
    );
}

/// The file with its representation mapped into another one by a reflection: the first axis points backwards.
pub(crate) fn mirrored(text: &str) -> String {
    let (before, _) = text
        .split_once("=ADVANCED_BREP_SHAPE_REPRESENTATION")
        .unwrap();
    let representation = &before[before.rfind('#').unwrap()..];
    let end = text.rfind("ENDSEC;").unwrap();
    let mapping = format!(
        "#9001=CARTESIAN_POINT('',(0.,0.,0.));\n#9002=AXIS2_PLACEMENT_3D('',#9001,$,$);\n\
         #9003=DIRECTION('',(-1.,0.,0.));\n#9004=DIRECTION('',(0.,1.,0.));\n#9005=DIRECTION('',(0.,0.,1.));\n\
         #9006=CARTESIAN_TRANSFORMATION_OPERATOR_3D('','',$,#9003,#9004,#9001,$,#9005);\n\
         #9007=REPRESENTATION_MAP(#9002,{representation});\n#9008=MAPPED_ITEM('',#9007,#9006);\n\
         #9009=SHAPE_REPRESENTATION('',(#9002,#9008),#1);\n"
    );
    format!("{}{mapping}{}", &text[..end], &text[end..])
}

#[test]
fn occurrences_in_a_mirror() {
    let area = 8.0 * PI + 4.0 * PI * PI;
    let bend = mirrored(&horn_bend());
    check(
        "bend in a mirror",
        &bend,
        &[(2, Plane), (1, Torus)],
        [2, 3],
        area,
        4.0 * PI * PI,
    );
    assert!(
        shape_of("bend in a mirror", bend.as_bytes())
            .mesh
            .vertices
            .iter()
            .all(|place| place[0] < 1e-9)
    );
    let plain = String::from_utf8(cylinder(2.0, 3.0).bytes()).unwrap();
    check(
        "cylinder in a mirror",
        mirrored(&plain),
        &[(2, Plane), (1, Cylinder)],
        [2, 3],
        20.0 * PI,
        12.0 * PI,
    );
    let spline = mirrored(&spline_cylinder(|_| {}));
    check(
        "spline in a mirror",
        spline,
        &[(2, Plane), (1, Bspline)],
        [2, 3],
        20.0 * PI,
        12.0 * PI,
    );
}

#[test]
fn pieces_of_faces_and_edges() {
    // The top of a cube names its parent, and one of its edges is a piece of a longer one.
    let text = String::from_utf8(cuboid([10.0; 3]).bytes()).unwrap();
    let face = text.match_indices("ADVANCED_FACE('',(").nth(1).unwrap().0;
    let end = face + text[face..].find(';').unwrap();
    let bounds =
        &text[face + "ADVANCED_FACE('',".len()..text[face..].find("),#").unwrap() + face + 1];
    let edge = text.find("EDGE_CURVE").unwrap();
    let edge_end = edge + text[edge..].find(';').unwrap();
    let ends = text[edge..edge_end]
        .split(',')
        .skip(1)
        .take(2)
        .collect::<Vec<_>>()
        .join(",");
    let pieces = format!(
        "#9001={};\n#9002={};\n",
        &text[face..end],
        &text[edge..edge_end]
    );
    let text = format!(
        "{}SUBEDGE('',{ends},#9002){}SUBFACE('',{bounds},#9001){}",
        &text[..edge],
        &text[edge_end..face],
        text[end..].replacen("ENDSEC;", &format!("{pieces}ENDSEC;"), 1)
    );
    check(
        "pieces of faces and edges",
        text,
        &[(6, Plane)],
        [12, 6],
        600.0,
        1000.0,
    );
}

#[test]
fn boards_of_many_bodies() {
    check(
        "several solids in one representation",
        partprobe_synth::fixtures::two_blocks([10.0; 3]),
        &[(12, Plane)],
        [24, 12],
        1200.0,
        2000.0,
    );
    check(
        "colored faces",
        partprobe_synth::fixtures::colored_cuboid([10.0; 3]),
        &[(6, Plane)],
        [12, 6],
        600.0,
        1000.0,
    );
}

/// Adds a product whose shape is `representation`, as one application protocol writes it. Returns its definition.
fn add_product(text: &mut StepText, protocol: &str, name: &str, representation: usize) -> usize {
    let is_203 = protocol == "AP203";
    let about = match protocol {
        "AP203" => "configuration controlled 3d designs of mechanical parts and assemblies",
        "AP214" => "core data for automotive mechanical design processes",
        _ => "managed model based 3d engineering",
    };
    let application = text.add(format!("APPLICATION_CONTEXT('{about}')"));
    let kind = if is_203 {
        "MECHANICAL_CONTEXT"
    } else {
        "PRODUCT_CONTEXT"
    };
    let context = text.add(format!("{kind}('',#{application},'mechanical')"));
    let product = text.add(format!("PRODUCT('{name}','{name}','',(#{context}))"));
    let formation = text.add(if is_203 {
        format!("PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE('','',#{product},.NOT_KNOWN.)")
    } else {
        format!("PRODUCT_DEFINITION_FORMATION('','',#{product})")
    });
    let kind = if is_203 {
        "DESIGN_CONTEXT('design'"
    } else {
        "PRODUCT_DEFINITION_CONTEXT('part definition'"
    };
    let context = text.add(format!("{kind},#{application},'design')"));
    let definition = text.add(format!(
        "PRODUCT_DEFINITION('design','',#{formation},#{context})"
    ));
    let shape = text.add(format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
    // Exporters of AP203 attach the solid's representation to one that contains only axes.
    let shown = if is_203 {
        let axes = text.axes([0.0; 3], UP, X);
        let shown = text.add(format!("SHAPE_REPRESENTATION('',(#{axes}),#1)"));
        text.add(format!(
            "SHAPE_REPRESENTATION_RELATIONSHIP('','',#{shown},#{representation})"
        ));
        shown
    } else {
        representation
    };
    text.add(format!(
        "SHAPE_DEFINITION_REPRESENTATION(#{shape},#{shown})"
    ));
    definition
}

#[test]
fn application_protocols() {
    let protocols = [
        ("AP203", "'1'", "CONFIG_CONTROL_DESIGN"),
        (
            "AP214",
            "'2;1'",
            "AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }",
        ),
        (
            "AP242",
            "'2;1'",
            "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 }",
        ),
    ];
    for (protocol, level, schema) in protocols {
        let mut text = cuboid([10.0; 3]);
        let shape = text.add("APPROVAL_STATUS('approved')") - 1;
        add_product(&mut text, protocol, "flange", shape);
        let measure = text.add(
            "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-5),#2,'distance_accuracy_value','')",
        );
        let text = String::from_utf8(text.bytes())
            .unwrap()
            .replace("'body'", "''")
            .replace(
                "GLOBAL_UNIT_ASSIGNED_CONTEXT",
                &format!(
                    "GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{measure}))GLOBAL_UNIT_ASSIGNED_CONTEXT"
                ),
            );
        let data = &text[text.find("DATA;").unwrap()..];
        let text = format!(
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),{level});\n\
             FILE_NAME('flange.stp','1998-04-01T12:00:00',('A. Writer'),(''),'PREPROCESSOR','CAD','');\n\
             FILE_SCHEMA(('{schema}'));\nENDSEC;\n{data}"
        );
        check(protocol, &text, &[(6, Plane)], [12, 6], 600.0, 1000.0);
        let brep = read(text.as_bytes(), &ReadBudget::default()).unwrap();
        assert_eq!(brep.solids[0].name.as_deref(), Some("flange"), "{protocol}");
    }
}

/// Adds a box in a separate representation, in one color. Returns the representation.
fn colored_box(text: &mut StepText, sides: Point, [r, g, b]: Point) -> usize {
    let faces = text.polyhedron(&box_corners(sides), &CUBE_POLYGONS);
    let [_, solid] = text.solid(&faces);
    let color = text.add(format!("COLOUR_RGB('',{r:?},{g:?},{b:?})"));
    let color = text.add(format!("FILL_AREA_STYLE_COLOUR('',#{color})"));
    let style = text.add(format!("FILL_AREA_STYLE('',(#{color}))"));
    let style = text.add(format!("SURFACE_STYLE_FILL_AREA(#{style})"));
    let style = text.add(format!("SURFACE_SIDE_STYLE('',(#{style}))"));
    let style = text.add(format!("SURFACE_STYLE_USAGE(.BOTH.,#{style})"));
    let style = text.add(format!("PRESENTATION_STYLE_ASSIGNMENT((#{style}))"));
    text.add(format!("STYLED_ITEM('color',(#{style}),#{solid})"));
    solid + 1
}

/// One occurrence of a product in another, both with their definitions and representations.
fn place(text: &mut StepText, [part, shape]: [usize; 2], [assembly, whole]: [usize; 2], at: Point) {
    let (from, to) = (text.axes([0.0; 3], UP, X), text.axes(at, UP, X));
    let motion = text.add(format!("ITEM_DEFINED_TRANSFORMATION('','',#{from},#{to})"));
    let relationship = text.add(format!(
        "(REPRESENTATION_RELATIONSHIP('','',#{shape},#{whole})\
         REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{motion})SHAPE_REPRESENTATION_RELATIONSHIP())"
    ));
    let occurrence = text.add(format!(
        "NEXT_ASSEMBLY_USAGE_OCCURRENCE('','U1','',#{assembly},#{part},$)"
    ));
    let shape = text.add(format!("PRODUCT_DEFINITION_SHAPE('','',#{occurrence})"));
    text.add(format!(
        "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{relationship},#{shape})"
    ));
}

#[test]
fn a_board_with_parts_on_it() {
    let mut text = StepText::in_millimeters();
    let board = colored_box(&mut text, [20.0, 20.0, 1.0], [0.0, 0.5, 0.0]);
    let chip = colored_box(&mut text, [2.0, 2.0, 1.0], [0.1, 0.1, 0.1]);
    let axes = text.axes([0.0; 3], UP, X);
    let whole = text.add(format!("SHAPE_REPRESENTATION('',(#{axes}),#1)"));
    let [board_part, chip_part, pcb] = [
        ("board", board),
        ("SOIC-8_3.9x4.9mm_P1.27mm", chip),
        ("pcb", whole),
    ]
    .map(|(name, representation)| add_product(&mut text, "AP214", name, representation));
    place(&mut text, [board_part, board], [pcb, whole], [0.0; 3]);
    place(&mut text, [chip_part, chip], [pcb, whole], [3.0, 3.0, 1.0]);
    place(&mut text, [chip_part, chip], [pcb, whole], [9.0, 3.0, 1.0]);
    let text = text.bytes();
    check(
        "board with parts",
        &text,
        &[(12, Plane)],
        [24, 12],
        880.0 + 16.0,
        400.0 + 4.0,
    );
    let brep = read(&text, &ReadBudget::default()).unwrap();
    let (all, instances) = tessellate_instances(&brep, &TessellationOptions::default());
    assert_eq!((all.graph.faces.len(), instances.len()), (18, 3));
    assert!(all.graph.faces.iter().all(|face| face.color.is_some()));
}
