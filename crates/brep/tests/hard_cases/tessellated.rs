//! Tests tessellated geometry: every form of triangles, exact geometry next to it, and damaged files.

use super::*;
use FaceType::{Other, Plane};
use fixtures::{CUBE_POLYGONS, box_corners, cuboid};
use partprobe_brep::ReadError;
use std::f64::consts::TAU;

/// The corners of a box, counted from 1.
const QUADS: [[usize; 4]; 6] = [
    [1, 4, 3, 2],
    [5, 6, 7, 8],
    [1, 2, 6, 5],
    [2, 3, 7, 6],
    [3, 4, 8, 7],
    [4, 1, 5, 8],
];

fn coordinates(text: &mut StepText, corners: &[Point]) -> usize {
    let list: Vec<String> = corners
        .iter()
        .map(|[x, y, z]| format!("({x:?},{y:?},{z:?})"))
        .collect();
    text.add(format!(
        "COORDINATES_LIST('',{},({}))",
        corners.len(),
        list.join(",")
    ))
}

/// A side of the box, written in the given form. `@` is replaced by the coordinates and the letters by its corners.
fn quad(form: &str, coordinates: usize, [a, b, c, d]: [usize; 4]) -> String {
    let corners = [("A", a), ("B", b), ("C", c), ("D", d)];
    let written = corners
        .iter()
        .fold(form.to_owned(), |form, (letter, corner)| {
            form.replace(&format!("<{letter}>"), &corner.to_string())
        });
    written.replace('@', &format!("#{coordinates}"))
}

const TRIANGLES: &str =
    "TRIANGULATED_FACE('',@,4,((0.,0.,1.)),$,(<A>,<B>,<C>,<D>),((1,2,3),(1,3,4)))";

/// A box of these sides in one body, of the class `body`.
fn tessellated_box(form: &str, body: &str) -> StepText {
    let mut text = StepText::in_millimeters();
    let list = coordinates(&mut text, &box_corners([10.0, 20.0, 30.0]));
    let faces: Vec<usize> = QUADS
        .iter()
        .map(|&corners| text.add(quad(form, list, corners)))
        .collect();
    let items = if body.is_empty() {
        references(&faces)
    } else {
        format!("#{}", text.add(body.replace('@', &references(&faces))))
    };
    text.add(format!("TESSELLATED_SHAPE_REPRESENTATION('',({items}),#1)"));
    text
}

#[test]
fn triangles_in_all_their_forms() {
    let complex = "(REPRESENTATION_ITEM('')TESSELLATED_FACE(@,4,(),$)TESSELLATED_ITEM()TESSELLATED_STRUCTURED_ITEM()\
        TRIANGULATED_FACE((<A>,<B>,<C>,<D>),((1,2,3),(1,3,4))))";
    let forms = [
        TRIANGLES,
        "TRIANGULATED_FACE('',@,8,(),$,(),((<A>,<B>,<C>),(<A>,<C>,<D>)))",
        "COMPLEX_TRIANGULATED_FACE('',@,4,(),$,(<A>,<B>,<C>,<D>),((1,2,4,3)),())",
        "COMPLEX_TRIANGULATED_FACE('',@,4,(),$,(<A>,<B>,<C>,<D>),$,((1,2,3,4)))",
        complex,
    ];
    let solid = "TESSELLATED_SOLID('body',(@),$)";
    for form in forms {
        check(
            form,
            tessellated_box(form, solid).bytes(),
            &[(6, Other)],
            [12, 6],
            2200.0,
            6000.0,
        );
        check_faces(
            form,
            tessellated_box(form, "").bytes(),
            &[(6, Other)],
            [12, 6],
            2200.0,
        );
        check_faces(
            form,
            tessellated_box(form, "TESSELLATED_SHELL('',(@),$)").bytes(),
            &[(6, Other)],
            [12, 6],
            2200.0,
        );
    }
    let sets = [
        "TRIANGULATED_SURFACE_SET('',@,4,(),(<A>,<B>,<C>,<D>),((1,2,3),(1,3,4)))",
        "COMPLEX_TRIANGULATED_SURFACE_SET('',@,4,(),(<A>,<B>,<C>,<D>),(),((1,2,3,4)))",
    ];
    for form in sets {
        for body in ["", "TESSELLATED_GEOMETRIC_SET('',(@))"] {
            check_faces(
                form,
                tessellated_box(form, body).bytes(),
                &[(6, Other)],
                [12, 6],
                2200.0,
            );
        }
    }
}

#[test]
fn units_and_placements_apply() {
    let text = String::from_utf8(tessellated_box(TRIANGLES, "TESSELLATED_SOLID('',(@),$)").bytes())
        .unwrap();
    let inches = text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)");
    check(
        "centimeters",
        inches,
        &[(6, Other)],
        [12, 6],
        220_000.0,
        6e6,
    );
    let placed = "(GEOMETRIC_REPRESENTATION_ITEM()REPOSITIONED_TESSELLATED_ITEM(#9101)REPRESENTATION_ITEM('')\
        TESSELLATED_ITEM()TESSELLATED_SOLID((@),$))";
    let text = String::from_utf8(tessellated_box(TRIANGLES, placed).bytes()).unwrap();
    let axes = "#9100=CARTESIAN_POINT('',(100.,0.,0.));\n#9101=AXIS2_PLACEMENT_3D('',#9100,$,$);\nENDSEC;\nEND";
    let text = text.replace("ENDSEC;\nEND", axes);
    check(
        "repositioned",
        &text,
        &[(6, Other)],
        [12, 6],
        2200.0,
        6000.0,
    );
    let vertices = shape_of("repositioned", text.as_bytes()).mesh.vertices;
    assert!(vertices.iter().all(|[x, ..]| (100.0..=110.0).contains(x)));
    // A reflection reverses the triangles, and they face outward again.
    let mirrored = super::files::mirrored(&text.replace(
        "TESSELLATED_SHAPE_REPRESENTATION",
        "ADVANCED_BREP_SHAPE_REPRESENTATION",
    ));
    check("mirrored", mirrored, &[(6, Other)], [12, 6], 2200.0, 6000.0);
}

#[test]
fn faces_with_lists_of_their_own_meet_where_coordinates_are_equal() {
    let mut text = StepText::in_millimeters();
    let corners = box_corners([1.0; 3]);
    let faces: Vec<usize> = QUADS
        .iter()
        .map(|quad_corners| {
            let list = coordinates(&mut text, &quad_corners.map(|corner| corners[corner - 1]));
            text.add(quad(TRIANGLES, list, [1, 2, 3, 4]))
        })
        .collect();
    let solid = text.add(format!("TESSELLATED_SOLID('',({}),$)", references(&faces)));
    text.add(format!(
        "TESSELLATED_SHAPE_REPRESENTATION('',(#{solid}),#1)"
    ));
    check("own lists", text.bytes(), &[(6, Other)], [12, 6], 6.0, 1.0);
}

/// A prism of `n` sides between two discs. Its wall is divided into faces of whole sides.
fn prism(n: usize, n_pieces: usize) -> Vec<u8> {
    let mut text = StepText::in_millimeters();
    let rim = |z: f64| (0..n).map(move |i| (TAU * i as f64 / n as f64, z));
    let corners: Vec<Point> = rim(0.0)
        .chain(rim(10.0))
        .map(|(a, z)| [5.0 * a.cos(), 5.0 * a.sin(), z])
        .collect();
    let list = coordinates(&mut text, &corners);
    let face = |text: &mut StepText, triangles: Vec<[usize; 3]>| {
        let triangles: Vec<String> = triangles
            .iter()
            .map(|[a, b, c]| format!("({a},{b},{c})"))
            .collect();
        text.add(format!(
            "TRIANGULATED_FACE('',#{list},{},(),$,(),({}))",
            2 * n,
            triangles.join(",")
        ))
    };
    let mut faces: Vec<usize> = (0..n_pieces)
        .map(|piece| {
            let sides = piece * n / n_pieces..(piece + 1) * n / n_pieces;
            let triangles = sides.flat_map(|i| {
                let (a, b) = (i + 1, (i + 1) % n + 1);
                [[a, b, b + n], [a, b + n, a + n]]
            });
            face(&mut text, triangles.collect())
        })
        .collect();
    faces.push(face(&mut text, (2..n).map(|i| [1, i + 1, i]).collect()));
    faces.push(face(
        &mut text,
        (2..n).map(|i| [n + 1, n + i, n + i + 1]).collect(),
    ));
    let solid = text.add(format!("TESSELLATED_SOLID('',({}),$)", references(&faces)));
    text.add(format!(
        "TESSELLATED_SHAPE_REPRESENTATION('',(#{solid}),#1)"
    ));
    text.bytes()
}

#[test]
fn an_angle_is_given_where_triangles_bend_more_than_inside_the_faces() {
    let n = 24;
    let base = 0.5 * 25.0 * n as f64 * (TAU / n as f64).sin();
    let wall = 10.0 * 10.0 * n as f64 * (TAU / (2.0 * n as f64)).sin();
    let phi = |text: &[u8]| {
        shape_of("prism", text)
            .graph
            .edges
            .iter()
            .map(|edge| edge.phi)
            .collect::<Vec<f64>>()
    };
    // With one wall, each rim is one edge with a right angle.
    check(
        "prism",
        prism(n, 1),
        &[(3, Other)],
        [2, 3],
        wall + 2.0 * base,
        10.0 * base,
    );
    assert!(
        phi(&prism(n, 1))
            .iter()
            .all(|phi| (phi - 90.0).abs() < 1e-9)
    );
    // Two halves meet as smoothly as the triangles inside them. The angle may come from the tessellation, so it is undefined.
    check(
        "prism of two halves",
        prism(n, 2),
        &[(4, Other)],
        [6, 4],
        wall + 2.0 * base,
        10.0 * base,
    );
    let smooth = phi(&prism(n, 2)).iter().filter(|phi| phi.is_nan()).count();
    assert_eq!(smooth, 2);
    // If each side is a separate face, all faces are flat, so every angle is defined, and fine sides are joined at a threshold of
    // 8°.
    check(
        "prism of sides",
        prism(n, n),
        &[(n + 2, Other)],
        [3 * n, n + 2],
        wall + 2.0 * base,
        10.0 * base,
    );
    check_faces(
        "prism of fine sides",
        prism(60, 60),
        &[(62, Other)],
        [180, 3],
        471.0,
    );
}

/// A box with its tessellation, in two representations that `relate` joins. `links` are written into the tessellation.
fn tessellation_and_exact(links: [&str; 2], relate: impl Fn(&mut StepText, [usize; 2])) -> Vec<u8> {
    let mut text = StepText::in_millimeters();
    let faces = text.polyhedron(&box_corners([10.0, 20.0, 30.0]), &CUBE_POLYGONS);
    let [_, solid] = text.solid(&faces);
    let list = coordinates(&mut text, &box_corners([10.0, 20.0, 30.0]));
    let face_link = |face: usize| links[0].replace('@', &format!("#{face}"));
    let written: Vec<usize> = QUADS
        .iter()
        .zip(&faces)
        .map(|(&corners, &face)| {
            text.add(quad(
                &TRIANGLES.replace('$', &face_link(face)),
                list,
                corners,
            ))
        })
        .collect();
    let link = links[1].replace('@', &format!("#{solid}"));
    let body = text.add(format!(
        "TESSELLATED_SOLID('',({}),{link})",
        references(&written)
    ));
    let tessellation = text.add(format!("TESSELLATED_SHAPE_REPRESENTATION('',(#{body}),#1)"));
    relate(&mut text, [solid + 1, tessellation]);
    text.bytes()
}

#[test]
fn exact_geometry_wins() {
    let product = |text: &mut StepText, name: &str| {
        let product = text.add(format!("PRODUCT('{name}','{name}','',())"));
        let formation = text.add(format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
        let definition = text.add(format!("PRODUCT_DEFINITION('','',#{formation},$)"));
        text.add(format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"))
    };
    let define = |text: &mut StepText, shape: usize, representation: usize| {
        text.add(format!(
            "SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})"
        ));
    };
    let unrelated = |text: &mut StepText, [exact, tessellation]: [usize; 2]| {
        let [a, b] = ["a", "b"].map(|name| product(text, name));
        define(text, a, exact);
        define(text, b, tessellation);
    };
    let one_product = |text: &mut StepText, [exact, tessellation]: [usize; 2]| {
        let shape = product(text, "part");
        define(text, shape, exact);
        define(text, shape, tessellation);
    };
    let one_system = |text: &mut StepText, [exact, tessellation]: [usize; 2]| {
        text.add(format!(
            "SHAPE_REPRESENTATION_RELATIONSHIP('','',#{exact},#{tessellation})"
        ));
    };
    let exact = [
        (
            "linked by solid",
            tessellation_and_exact(["$", "@"], unrelated),
        ),
        (
            "linked by face",
            tessellation_and_exact(["@", "$"], unrelated),
        ),
        (
            "of one product",
            tessellation_and_exact(["$", "$"], one_product),
        ),
        (
            "of one coordinate system",
            tessellation_and_exact(["$", "$"], one_system),
        ),
        (
            "of no product",
            tessellation_and_exact(["$", "$"], |_, _| ()),
        ),
    ];
    for (name, text) in exact {
        check(name, text, &[(6, Plane)], [12, 6], 2200.0, 6000.0);
    }
    let two = tessellation_and_exact(["$", "$"], unrelated);
    check(
        "of another product",
        two,
        &[(6, Plane), (6, Other)],
        [24, 12],
        4400.0,
        12_000.0,
    );
    // If the exact faces cannot be read, the triangles are used.
    let damaged = String::from_utf8(tessellation_and_exact(["$", "@"], one_product))
        .unwrap()
        .replace("=ADVANCED_FACE", "=NO_FACE");
    let brep = read(damaged.as_bytes(), &ReadBudget::default()).unwrap();
    assert_eq!((brep.faces.len(), brep.lost.len()), (6, 6));
}

#[test]
fn the_answer_says_that_its_faces_are_triangles() {
    let text = tessellated_box(TRIANGLES, "TESSELLATED_SOLID('',(@),$)").bytes();
    let notes = read(&text, &ReadBudget::default()).unwrap().notes;
    assert_eq!(notes.len(), 1);
    assert!(
        notes[0].text.contains("6 faces are triangles of the file"),
        "{}",
        notes[0]
    );
    assert_eq!(
        read(&cuboid([1.0; 3]).bytes(), &ReadBudget::default())
            .unwrap()
            .notes,
        []
    );
}

#[test]
fn triangles_that_number_the_coordinates_are_understood_and_noted() {
    let form = "TRIANGULATED_FACE('',@,4,(),$,(<A>,<B>,<C>,<D>),((<A>,<B>,<C>),(<A>,<C>,<D>)))";
    let text = tessellated_box(form, "TESSELLATED_SOLID('',(@),$)").bytes();
    check(
        "numbered by coordinates",
        &text,
        &[(6, Other)],
        [12, 6],
        2200.0,
        6000.0,
    );
    // The list of the lowest side has as many members as its highest corner number, so nothing is irregular there.
    assert_eq!(read(&text, &ReadBudget::default()).unwrap().notes.len(), 6);
}

#[test]
fn damage_is_named_and_the_rest_is_read() {
    let text = String::from_utf8(tessellated_box(TRIANGLES, "TESSELLATED_SOLID('',(@),$)").bytes())
        .unwrap();
    let lost = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        match read(
            text.replacen(from, to, 1).as_bytes(),
            &ReadBudget::default(),
        ) {
            Ok(brep) => (
                brep.faces.len(),
                brep.lost
                    .iter()
                    .map(|loss| loss.reason.clone())
                    .collect::<Vec<_>>(),
            ),
            Err(ReadError::NoFaces { lost }) => {
                (0, lost.into_iter().map(|loss| loss.reason).collect())
            }
            Err(error) => panic!("{error}"),
        }
    };
    let named = |reason: &str| vec![reason.to_owned()];
    assert_eq!(
        lost("(4,1,5,8)", "(4,1,5,9)"),
        (5, named("it names member 9 of a list of 8"))
    );
    assert_eq!(
        lost("(4,1,5,8)", "(4,1,5)"),
        (5, named("it names member 4 of a list of 3"))
    );
    assert_eq!(
        lost("(4,1,5,8)", "(0,1,5,8)"),
        (5, named("it names member 0 of a list of 8"))
    );
    assert_eq!(
        lost("(4,1,5,8)", "(4,4,4,4)"),
        (5, named("it has no triangle"))
    );
    assert_eq!(
        lost("((1,2,3),(1,3,4))", "()"),
        (5, named("it has no triangle"))
    );
    assert_eq!(
        lost("((1,2,3),(1,3,4))", "((1,2.5,3))"),
        (5, named("a parameter is not a count"))
    );
    assert_eq!(lost("COORDINATES_LIST", "COORDINATE_LIST").0, 0);
    assert_eq!(lost("(#5,", "(#5,#5,").0, 6);
    assert_eq!(
        lost("(#5,", "(#999,#5,"),
        (6, named("it is not in the file"))
    );
    assert_eq!(
        lost(
            "TESSELLATED_SOLID('',(#5,#6,#7,#8,#9,#10)",
            "TESSELLATED_SOLID('',()"
        ),
        (0, named("it has no triangle"))
    );
    let mut cycle = StepText::in_millimeters();
    let set = cycle.add("TESSELLATED_GEOMETRIC_SET('',(#4))");
    cycle.add(format!("TESSELLATED_SHAPE_REPRESENTATION('',(#{set}),#1)"));
    assert!(
        matches!(read(&cycle.bytes(), &ReadBudget::default()), Err(ReadError::NoFaces { lost }) if lost.len() == 1)
    );
}
