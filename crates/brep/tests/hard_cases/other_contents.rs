//! Tests other contents than solids of faces: bounds that a surface has by itself, supplemental geometry, bare faces, points that
//! lie on other geometry, replicas, primitives, and styles of items that are not solids.

use super::*;
use FaceType::{Bspline, Cone, Cylinder, Plane, Revolution, Sphere, Torus};
use fixtures::{CUBE_POLYGONS, box_corners, cuboid, cylinder};
use partprobe_brep::{Brep, ReadError, tessellate_instances};
use partprobe_shape::Color;
use std::f64::consts::PI;

#[track_caller]
fn brep_of(name: &str, text: impl AsRef<[u8]>) -> Brep {
    read(text.as_ref(), &ReadBudget::default()).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// A boundary of one circle, along it or against it.
fn circle_boundary(text: &mut StepText, at: Point, z: Point, radius: f64, sense: &str) -> usize {
    let x = if z == X { UP } else { X };
    let axes = text.axes(at, z, x);
    let circle = text.add(format!("CIRCLE('',#{axes},{radius:?})"));
    let ends = "(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(6.283185307179586))";
    let trimmed = text.add(format!(
        "TRIMMED_CURVE('',#{circle},{ends},.T.,.PARAMETER.)"
    ));
    let segment = text.add(format!(
        "COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,{sense},#{trimmed})"
    ));
    text.add(format!("BOUNDARY_CURVE('',(#{segment}),.F.)"))
}

/// A square of a B-spline with sides of 10.
fn square(text: &mut StepText) -> usize {
    let poles =
        [[0.0, 0.0], [0.0, 10.0], [10.0, 0.0], [10.0, 10.0]].map(|[x, y]| text.point([x, y, 0.0]));
    let [a, b, c, d] = poles;
    let knots = "(2,2),(2,2),(0.,1.),(0.,1.),.U.";
    text.add(format!(
        "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#{a},#{b}),(#{c},#{d})),.U.,.F.,.F.,.F.,{knots})"
    ))
}

/// An elementary surface around the z axis.
fn elementary(text: &mut StepText, class: &str, sizes: &str) -> usize {
    let axes = text.axes([0.0; 3], UP, X);
    text.add(format!("{class}('',#{axes}{sizes})"))
}

/// A curve revolved around the z axis.
fn revolved_curve(text: &mut StepText, curve: usize, ends: [f64; 2]) -> usize {
    let ends = ends
        .map(|end| format!("(PARAMETER_VALUE({end:?}))"))
        .join(",");
    let trimmed = text.add(format!("TRIMMED_CURVE('',#{curve},{ends},.T.,.PARAMETER.)"));
    let (origin, up) = (text.point([0.0; 3]), text.direction(UP));
    let axis = text.add(format!("AXIS1_PLACEMENT('',#{origin},#{up})"));
    text.add(format!("SURFACE_OF_REVOLUTION('',#{trimmed},#{axis})"))
}

fn revolved_semicircle(text: &mut StepText) -> usize {
    let axes = text.axes([0.0; 3], [0.0, -1.0, 0.0], X);
    let circle = text.add(format!("CIRCLE('',#{axes},10.)"));
    revolved_curve(text, circle, [-0.5 * PI, 0.5 * PI])
}

/// A surface that is its own outer bound, with holes (center, axis, radius), in a set of a representation.
fn own_bound(
    basis: impl Fn(&mut StepText) -> usize,
    holes: &[(Point, Point, f64)],
    sense: &str,
) -> Vec<u8> {
    let mut text = StepText::in_millimeters();
    let basis = basis(&mut text);
    let holes: Vec<usize> = holes
        .iter()
        .map(|&(at, z, radius)| circle_boundary(&mut text, at, z, radius, sense))
        .collect();
    let surface = text.add(format!(
        "CURVE_BOUNDED_SURFACE('',#{basis},({}),.T.)",
        references(&holes)
    ));
    let set = text.add(format!("GEOMETRIC_SET('',(#{surface}))"));
    text.add(format!(
        "GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION('',(#{set}),#1)"
    ));
    text.bytes()
}

#[test]
fn surfaces_that_are_their_own_outer_bound() {
    let rectangle = |text: &mut StepText| {
        let plane = elementary(text, "PLANE", "");
        text.add(format!(
            "RECTANGULAR_TRIMMED_SURFACE('',#{plane},0.,10.,0.,10.,.T.,.T.)"
        ))
    };
    let sphere = |text: &mut StepText| elementary(text, "SPHERICAL_SURFACE", ",10.");
    let wall = |text: &mut StepText| {
        let (origin, direction) = (text.point([5.0, 0.0, 0.0]), text.direction(UP));
        let vector = text.add(format!("VECTOR('',#{direction},1.)"));
        let line = text.add(format!("LINE('',#{origin},#{vector})"));
        revolved_curve(text, line, [0.0, 12.0])
    };
    let (flat, cap, side) = (
        ([5.0, 5.0, 0.0], UP, 2.0),
        ([0.0, 0.0, 8.0], UP, 6.0),
        ([8.0, 0.0, 0.0], X, 6.0),
    );
    let (square_area, sphere_area, cap_area) = (100.0 - 4.0 * PI, 400.0 * PI, 40.0 * PI);
    for sense in [".T.", ".F."] {
        check_open(
            "spline",
            own_bound(square, &[flat], sense),
            &[(1, Bspline)],
            [0, 1],
            square_area,
        );
        check_open(
            "rectangle",
            own_bound(rectangle, &[flat], sense),
            &[(1, Plane)],
            [0, 1],
            square_area,
        );
        let two = [([3.0, 3.0, 0.0], UP, 1.0), ([7.0, 7.0, 0.0], UP, 2.0)];
        check_open(
            "two holes",
            own_bound(square, &two, sense),
            &[(1, Bspline)],
            [0, 1],
            100.0 - 5.0 * PI,
        );
        for hole in [cap, side] {
            check_open(
                "sphere",
                own_bound(sphere, &[hole], sense),
                &[(1, Sphere)],
                [0, 1],
                sphere_area - cap_area,
            );
        }
        let both = sphere_area - 2.0 * cap_area;
        check_open(
            "sphere, two holes",
            own_bound(sphere, &[cap, side], sense),
            &[(1, Sphere)],
            [0, 1],
            both,
        );
        let text = own_bound(revolved_semicircle, &[side], sense);
        check_open(
            "turned semicircle",
            text,
            &[(1, Revolution)],
            [0, 1],
            sphere_area - cap_area,
        );
    }
    check_open(
        "turned line",
        own_bound(wall, &[], ".T."),
        &[(1, Revolution)],
        [0, 1],
        120.0 * PI,
    );
    let torus = |text: &mut StepText| elementary(text, "TOROIDAL_SURFACE", ",20.,5.");
    check_faces(
        "torus",
        own_bound(torus, &[], ".T."),
        &[(1, Torus)],
        [0, 1],
        400.0 * PI * PI,
    );
}

#[test]
fn a_surface_without_ends_is_not_an_outer_bound() {
    for (class, sizes) in [
        ("PLANE", ""),
        ("CYLINDRICAL_SURFACE", ",5."),
        ("CONICAL_SURFACE", ",5.,0.3"),
    ] {
        let text = own_bound(
            |text| elementary(text, class, sizes),
            &[([5.0, 5.0, 0.0], UP, 2.0)],
            ".T.",
        );
        let error = read(&text, &ReadBudget::default()).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("no ends that could be its outer bound"),
            "{class}: {error}"
        );
    }
}

/// A cube in a representation, and something else in one of another class.
fn cube_and_item(
    class: &str,
    relationship: Option<&str>,
    other_item: impl Fn(&mut StepText) -> usize,
) -> Vec<u8> {
    let mut text = cuboid([10.0; 3]);
    let part = text.add("APPROVAL_STATUS('approved')") - 1;
    let item = other_item(&mut text);
    let other = text.add(format!("{class}('',(#{item}),#1)"));
    if let Some(relationship) = relationship {
        text.add(
            relationship
                .replace("#1", &format!("#{part}"))
                .replace("#2", &format!("#{other}")),
        );
    }
    text.bytes()
}

fn moved_cube(text: &mut StepText) -> Vec<usize> {
    text.polyhedron(
        &box_corners([3.0; 3]).map(|[x, y, z]| [x + 50.0, y, z]),
        &CUBE_POLYGONS,
    )
}

#[test]
fn supplemental_geometry_is_not_a_face_of_the_part() {
    let set = |text: &mut StepText| {
        let surface = square(text);
        text.add(format!("GEOMETRIC_SET('',(#{surface}))"))
    };
    let solid = |text: &mut StepText| {
        let faces = moved_cube(text);
        let shell = text.add(format!("CLOSED_SHELL('',({}))", references(&faces)));
        text.add(format!("MANIFOLD_SOLID_BREP('',#{shell})"))
    };
    let face = |text: &mut StepText| moved_cube(text)[0];
    let relationship =
        "CONSTRUCTIVE_GEOMETRY_REPRESENTATION_RELATIONSHIP('supplemental geometry','',#1,#2)";
    let complex = "(CONSTRUCTIVE_GEOMETRY_REPRESENTATION_RELATIONSHIP()REPRESENTATION_RELATIONSHIP('','',#1,#2))";
    let cases = [
        ("CONSTRUCTIVE_GEOMETRY_REPRESENTATION", None),
        ("CONSTRUCTIVE_GEOMETRY_REPRESENTATION", Some(relationship)),
        ("SHAPE_REPRESENTATION", Some(relationship)),
        ("SHAPE_REPRESENTATION", Some(complex)),
        (
            "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION",
            None,
        ),
    ];
    for (class, relationship) in cases {
        let named = [
            cube_and_item(class, relationship, set),
            cube_and_item(class, relationship, solid),
        ];
        for text in named {
            check(class, &text, &[(6, Plane)], [12, 6], 600.0, 1000.0);
            assert_eq!(brep_of(class, &text).notes.len(), 1, "{class}");
        }
        check(
            class,
            cube_and_item(class, relationship, face),
            &[(6, Plane)],
            [12, 6],
            600.0,
            1000.0,
        );
    }
    // The same solid in a representation of shape counts.
    let text = cube_and_item("SHAPE_REPRESENTATION", None, solid);
    check(
        "second solid",
        text,
        &[(12, Plane)],
        [24, 12],
        654.0,
        1027.0,
    );
}

#[test]
fn a_solid_that_no_representation_lists() {
    let mut text = cuboid([10.0; 3]);
    let faces = moved_cube(&mut text);
    let shell = text.add(format!("CLOSED_SHELL('',({}))", references(&faces)));
    let solid = text.add(format!("MANIFOLD_SOLID_BREP('',#{shell})"));
    check(
        "unlisted beside listed",
        text.bytes(),
        &[(6, Plane)],
        [12, 6],
        600.0,
        1000.0,
    );
    let notes = brep_of("unlisted", text.bytes()).notes;
    assert_eq!(
        notes
            .iter()
            .map(|note| note.step_id as usize)
            .collect::<Vec<_>>(),
        [solid]
    );
    // If the file lists nothing, all its bodies count.
    let alone = String::from_utf8(cuboid([10.0; 3]).bytes()).unwrap();
    let alone = alone.replace("ADVANCED_BREP_SHAPE_REPRESENTATION", "APPROVAL");
    check(
        "nothing is listed",
        alone,
        &[(6, Plane)],
        [12, 6],
        600.0,
        1000.0,
    );
}

#[test]
fn faces_and_shells_without_a_body() {
    let with = |items: &dyn Fn(&mut StepText, Vec<usize>) -> Vec<usize>| {
        let mut text = StepText::in_millimeters();
        let faces = text.polyhedron(&box_corners([10.0; 3]), &CUBE_POLYGONS);
        let items = items(&mut text, faces);
        text.add(format!(
            "SHAPE_REPRESENTATION('',({}),#1)",
            references(&items)
        ));
        text.bytes()
    };
    let shell = |class: &'static str, range: std::ops::Range<usize>| {
        move |text: &mut StepText, faces: &[usize]| {
            text.add(format!(
                "{class}('',({}))",
                references(&faces[range.clone()])
            ))
        }
    };
    let reversed = |text: &mut StepText, faces: Vec<usize>| {
        faces
            .iter()
            .map(|face| text.add(format!("ORIENTED_FACE('',*,#{face},.F.)")))
            .collect()
    };
    let halves = |text: &mut StepText, faces: Vec<usize>| {
        vec![
            shell("CONNECTED_FACE_SET", 0..2)(text, &faces),
            shell("OPEN_SHELL", 2..6)(text, &faces),
        ]
    };
    let cases: [(&str, Vec<u8>); 4] = [
        ("bare faces", with(&|_, faces| faces)),
        ("bare faces turned over", with(&reversed)),
        (
            "bare shell",
            with(&|text, faces| vec![shell("CLOSED_SHELL", 0..6)(text, &faces)]),
        ),
        ("bare sets", with(&halves)),
    ];
    for (name, text) in cases {
        let shape = check_faces(name, text, &[(6, Plane)], [12, 6], 600.0);
        assert!(
            shape
                .graph
                .edges
                .iter()
                .all(|edge| (edge.phi - 90.0).abs() < 1e-9),
            "{name}"
        );
    }
    // A representation that lists faces of a solid again adds none.
    let again = |before: bool| {
        let mut text = StepText::in_millimeters();
        let faces = text.polyhedron(&box_corners([10.0; 3]), &CUBE_POLYGONS);
        let list = |text: &mut StepText| {
            text.add(format!(
                "SHAPE_REPRESENTATION('',({}),#1)",
                references(&faces[..2])
            ))
        };
        if before {
            list(&mut text);
        }
        text.solid(&faces);
        if !before {
            list(&mut text);
        }
        text.bytes()
    };
    for before in [true, false] {
        check(
            "faces listed again",
            again(before),
            &[(6, Plane)],
            [12, 6],
            600.0,
            1000.0,
        );
        assert_eq!(
            brep_of("faces listed again", again(before))
                .components
                .len(),
            1
        );
    }
}

/// A cube with the side 10 whose corners are written in another way. `point` returns an entity for a corner. It may add other
/// entities, which are numbered from 9000.
fn cube_of_points(point: impl Fn(Point, &mut Vec<String>) -> String) -> String {
    let text = String::from_utf8(cuboid([10.0; 3]).bytes()).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut extra = Vec::new();
    for i in 0..lines.len() {
        let Some((_, reference)) = lines[i].split_once("=VERTEX_POINT('',") else {
            continue;
        };
        let reference = format!("{}=", reference.trim_end_matches(");"));
        let line = lines
            .iter()
            .position(|line| line.starts_with(&reference))
            .unwrap();
        let (_, list) = lines[line].split_once(",(").unwrap();
        let corner: Vec<f64> = list
            .trim_end_matches("));")
            .split(',')
            .map(|x| x.parse().unwrap())
            .collect();
        lines[line] = format!(
            "{reference}{};",
            point([corner[0], corner[1], corner[2]], &mut extra)
        );
    }
    let end = lines.iter().rposition(|line| line == "ENDSEC;").unwrap();
    lines.splice(
        end..end,
        (9000..)
            .zip(extra)
            .map(|(id, entity)| format!("#{id}={entity};")),
    );
    lines.join("\n")
}

fn add(extra: &mut Vec<String>, entity: String) -> usize {
    extra.push(entity);
    8999 + extra.len()
}

fn add_axes(extra: &mut Vec<String>, at: Point) -> usize {
    let [x, y, z] = at;
    let origin = add(extra, format!("CARTESIAN_POINT('',({x:?},{y:?},{z:?}))"));
    add(extra, format!("AXIS2_PLACEMENT_3D('',#{origin},$,$)"))
}

fn on_plane([x, y, z]: Point, extra: &mut Vec<String>) -> String {
    let axes = add_axes(extra, [0.0, 0.0, z]);
    let plane = add(extra, format!("PLANE('',#{axes})"));
    format!("POINT_ON_SURFACE('',#{plane},{x:?},{y:?})")
}

fn on_line([x, y, z]: Point, extra: &mut Vec<String>) -> String {
    let origin = add(extra, format!("CARTESIAN_POINT('',({x:?},{y:?},0.))"));
    let direction = add(extra, "DIRECTION('',(0.,0.,1.))".to_owned());
    let vector = add(extra, format!("VECTOR('',#{direction},2.)"));
    let line = add(extra, format!("LINE('',#{origin},#{vector})"));
    format!("POINT_ON_CURVE('',#{line},{:?})", 0.5 * z)
}

fn on_circle([x, y, z]: Point, extra: &mut Vec<String>) -> String {
    let axes = add_axes(extra, [x - 3.0, y, z]);
    let circle = add(extra, format!("CIRCLE('',#{axes},3.)"));
    format!("POINT_ON_CURVE('',#{circle},0.)")
}

fn replica([x, y, z]: Point, extra: &mut Vec<String>) -> String {
    let parent = add(
        extra,
        format!("CARTESIAN_POINT('',({:?},{y:?},{z:?}))", x - 5.0),
    );
    let shift = add(extra, "CARTESIAN_POINT('',(5.,0.,0.))".to_owned());
    let operator = add(
        extra,
        format!("CARTESIAN_TRANSFORMATION_OPERATOR_3D('','',$,$,$,#{shift},$,$)"),
    );
    format!("POINT_REPLICA('',#{parent},#{operator})")
}

#[test]
fn vertices_on_curves_and_surfaces() {
    let texts = [
        ("plane", cube_of_points(on_plane)),
        ("line", cube_of_points(on_line)),
        ("circle", cube_of_points(on_circle)),
        ("replica", cube_of_points(replica)),
    ];
    for (name, text) in texts {
        check(name, &text, &[(6, Plane)], [12, 6], 600.0, 1000.0);
        let centimeters = text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)");
        check(name, centimeters, &[(6, Plane)], [12, 6], 60_000.0, 1e6);
    }
}

#[test]
fn points_that_lead_nowhere_are_lost_by_name() {
    let beyond = |[x, y, z]: Point, extra: &mut Vec<String>| {
        let ends = [0.0, 1.0].map(|by| {
            add(
                extra,
                format!("CARTESIAN_POINT('',({:?},{y:?},{z:?}))", x + by),
            )
        });
        let line = add(extra, format!("POLYLINE('',(#{},#{}))", ends[0], ends[1]));
        format!("POINT_ON_CURVE('',#{line},7.)")
    };
    let circular = |_: Point, extra: &mut Vec<String>| {
        let line = 9000 + extra.len();
        add(extra, format!("POLYLINE('',(#{0},#{0}))", line + 1));
        add(extra, format!("POINT_ON_CURVE('',#{line},0.)"));
        format!("POINT_ON_CURVE('',#{line},0.)")
    };
    let trimmed = |[x, y, z]: Point, extra: &mut Vec<String>| {
        let axes = add_axes(extra, [x, y, z]);
        let circle = add(extra, format!("CIRCLE('',#{axes},3.)"));
        let ends = "(PARAMETER_VALUE(1.)),(PARAMETER_VALUE(2.))";
        let trimmed = add(
            extra,
            format!("TRIMMED_CURVE('',#{circle},{ends},.T.,.PARAMETER.)"),
        );
        format!("POINT_ON_CURVE('',#{trimmed},0.5)")
    };
    let cases: [(&str, String); 3] = [
        ("beyond the ends", cube_of_points(beyond)),
        ("leads back to itself", cube_of_points(circular)),
        ("of a trimmed curve", cube_of_points(trimmed)),
    ];
    for (reason, text) in cases {
        let Err(ReadError::NoFaces { lost }) = read(text.as_bytes(), &ReadBudget::default()) else {
            panic!("{reason}: faces were read")
        };
        assert!(
            lost.iter().all(|loss| loss.reason.contains(reason)),
            "{lost:?}"
        );
    }
}

#[test]
fn replicas_of_curves_and_surfaces() {
    // The wall of a cylinder as a replica of one with half its radius, and its rims as replicas of circles.
    let text = String::from_utf8(cylinder(2.0, 3.0).bytes()).unwrap();
    let shift = "#9000=CARTESIAN_POINT('',(0.,0.,0.));\n\
        #9001=CARTESIAN_TRANSFORMATION_OPERATOR_3D('','',$,$,$,#9000,2.,$);\n";
    let mut extra = shift.to_owned();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for (id, line) in (9100..).zip(&mut lines) {
        let Some((number, entity)) = line.split_once('=') else {
            continue;
        };
        let halved = entity.replace(",2.0);", ",1.0);");
        if entity.starts_with("CYLINDRICAL_SURFACE") {
            extra += &format!("#{id}={halved}\n");
            *line = format!("{number}=SURFACE_REPLICA('',#{id},#9001);");
        } else if entity.starts_with("CIRCLE") && !entity.contains("9001") {
            // The upper circle is at a height of 3, which the operator would double, so only the lower one is replaced.
            if extra.contains("CIRCLE") {
                continue;
            }
            extra += &format!("#{id}={halved}\n");
            *line = format!("{number}=CURVE_REPLICA('',#{id},#9001);");
        }
    }
    let end = lines.iter().rposition(|line| line == "ENDSEC;").unwrap();
    lines.insert(end, extra);
    check(
        "replicas",
        lines.join("\n"),
        &[(2, Plane), (1, Cylinder)],
        [2, 3],
        20.0 * PI,
        12.0 * PI,
    );
}

#[test]
fn a_transformation_operator_as_a_complex_instance() {
    let mut text = cuboid([1.0; 3]);
    let cube = text.add("APPROVAL_STATUS('approved')") - 1;
    let (origin, x, y, z) = (
        text.point([5.0, 0.0, 0.0]),
        text.direction([-1.0, 0.0, 0.0]),
        text.direction([0.0, 1.0, 0.0]),
        text.direction(UP),
    );
    let operator = text.add(format!(
        "(CARTESIAN_TRANSFORMATION_OPERATOR(#{x},#{y},#{origin},2.)CARTESIAN_TRANSFORMATION_OPERATOR_3D(#{z})\
         FUNCTIONALLY_DEFINED_TRANSFORMATION('','')GEOMETRIC_REPRESENTATION_ITEM()REPRESENTATION_ITEM(''))"
    ));
    let axes = text.axes([0.0; 3], UP, X);
    let map = text.add(format!("REPRESENTATION_MAP(#{axes},#{cube})"));
    let item = text.add(format!("MAPPED_ITEM('',#{map},#{operator})"));
    text.add(format!("SHAPE_REPRESENTATION('',(#{item}),#1)"));
    check(
        "complex operator",
        text.bytes(),
        &[(6, Plane)],
        [12, 6],
        24.0,
        8.0,
    );
    let vertices = shape_of("complex operator", &text.bytes()).mesh.vertices;
    assert!(vertices.iter().all(|[x, ..]| (3.0..=5.0).contains(x)));
}

/// A `CSG_SOLID` of one entity. In its text, `@` is replaced by an axis placement and `%` by a point.
fn csg(entity: &str) -> Vec<u8> {
    let mut text = StepText::in_millimeters();
    let position = if entity.contains("BLOCK") || entity.contains("WEDGE") {
        text.axes([1.0, 2.0, 3.0], X, UP)
    } else {
        let (origin, up) = (text.point([1.0, 2.0, 3.0]), text.direction(UP));
        text.add(format!("AXIS1_PLACEMENT('',#{origin},#{up})"))
    };
    let center = text.point([1.0, 2.0, 3.0]);
    let primitive = text.add(
        entity
            .replace('@', &format!("#{position}"))
            .replace('%', &format!("#{center}")),
    );
    let solid = text.add(format!("CSG_SOLID('body',#{primitive})"));
    text.add(format!("CSG_SHAPE_REPRESENTATION('',(#{solid}),#1)"));
    text.bytes()
}

#[test]
fn primitives_become_bodies() {
    check(
        "block",
        csg("BLOCK('',@,1.,2.,3.)"),
        &[(6, Plane)],
        [12, 6],
        22.0,
        6.0,
    );
    let slant = 13_f64.sqrt();
    let area = 2.0 * 4.0 + 3.0 * (3.0 + 1.0 + 2.0 + 8_f64.sqrt());
    check(
        "wedge",
        csg("RIGHT_ANGULAR_WEDGE('',@,3.,2.,3.,1.)"),
        &[(6, Plane)],
        [12, 6],
        area,
        12.0,
    );
    let area = 2.0 * 3.0 + 3.0 * (3.0 + 2.0 + slant);
    check(
        "wedge with an edge",
        csg("RIGHT_ANGULAR_WEDGE('',@,3.,2.,3.,0.)"),
        &[(5, Plane)],
        [9, 5],
        area,
        9.0,
    );
    let types = [(2, Plane), (1, Cylinder)];
    check(
        "cylinder",
        csg("RIGHT_CIRCULAR_CYLINDER('',@,3.,2.)"),
        &types,
        [2, 3],
        20.0 * PI,
        12.0 * PI,
    );
    let (angle, side) = (0.75_f64.atan(), PI * 8.0 * 5.0);
    let text = csg(&format!("RIGHT_CIRCULAR_CONE('',@,4.,2.5,{angle:?})"));
    check(
        "truncated cone",
        text,
        &[(2, Plane), (1, Cone)],
        [2, 3],
        side + PI * 36.5,
        PI * 4.0 / 3.0 * 50.25,
    );
    let text = csg(&format!("RIGHT_CIRCULAR_CONE('',@,4.,0.,{angle:?})"));
    check(
        "cone",
        &text,
        &[(1, Plane), (1, Cone)],
        [1, 2],
        24.0 * PI,
        12.0 * PI,
    );
    // The base is on the other side of the apex, against the axis.
    assert!(
        shape_of("cone", &text)
            .mesh
            .vertices
            .iter()
            .all(|[_, _, z]| *z <= 3.0 + 1e-9 && *z >= -1.0 - 1e-9)
    );
    check(
        "sphere",
        csg("SPHERE('',2.,%)"),
        &[(1, Sphere)],
        [0, 1],
        16.0 * PI,
        32.0 * PI / 3.0,
    );
    check(
        "torus",
        csg("TORUS('',@,5.,1.)"),
        &[(1, Torus)],
        [0, 1],
        20.0 * PI * PI,
        10.0 * PI * PI,
    );
}

#[test]
fn what_has_to_be_evaluated_is_named() {
    let reason = |text: &[u8]| match read(text, &ReadBudget::default()) {
        Err(ReadError::NoFaces { lost }) => lost[0].reason.clone(),
        other => panic!("{other:?}"),
    };
    let boolean = reason(&csg("BOOLEAN_RESULT('',.DIFFERENCE.,%,%)"));
    assert!(
        boolean.contains("CSG_SOLID of BOOLEAN_RESULT #8 (difference)"),
        "{boolean}"
    );
    assert!(reason(&csg("BLOCK('',@,1.,2.,0.)")).contains("radius"));
    let swept = String::from_utf8(csg("SPHERE('',2.,%)"))
        .unwrap()
        .replace("CSG_SOLID", "EXTRUDED_AREA_SOLID");
    assert!(reason(swept.as_bytes()).contains("EXTRUDED_AREA_SOLID, is not evaluated"));
    let missing = String::from_utf8(csg("SPHERE('',2.,%)"))
        .unwrap()
        .replace("=SPHERE", "=SPHEROID");
    assert!(reason(missing.as_bytes()).contains("CSG_SOLID of SPHEROID"));
}

/// A style of one color, which may be transparent.
fn style(text: &mut StepText, rgb: &str, transparency: Option<f64>) -> usize {
    let color = text.add(format!("COLOUR_RGB('',{rgb})"));
    let shown = match transparency {
        Some(transparency) => {
            let transparent = text.add(format!("SURFACE_STYLE_TRANSPARENT({transparency:?})"));
            text.add(format!("SURFACE_STYLE_RENDERING_WITH_PROPERTIES(.NORMAL_SHADING.,#{color},(#{transparent}))"))
        }
        None => {
            let fill = text.add(format!("FILL_AREA_STYLE_COLOUR('',#{color})"));
            let area = text.add(format!("FILL_AREA_STYLE('',(#{fill}))"));
            text.add(format!("SURFACE_STYLE_FILL_AREA(#{area})"))
        }
    };
    let side = text.add(format!("SURFACE_SIDE_STYLE('',(#{shown}))"));
    let usage = text.add(format!("SURFACE_STYLE_USAGE(.BOTH.,#{side})"));
    text.add(format!("PRESENTATION_STYLE_ASSIGNMENT((#{usage}))"))
}

/// The colors of a surface model's faces after `add` has styled them. `add` gets the first face, the shell, the model and the
/// representation.
fn colors_of(add: impl Fn(&mut StepText, [usize; 4])) -> Vec<Option<u32>> {
    let mut text = StepText::in_millimeters();
    let faces = text.polyhedron(&box_corners([1.0; 3]), &CUBE_POLYGONS);
    let shell = text.add(format!("OPEN_SHELL('',({}))", references(&faces)));
    let model = text.add(format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"));
    let representation = text.add(format!(
        "MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#{model}),#1)"
    ));
    add(&mut text, [faces[0], shell, model, representation]);
    let faces = shape_of("colors", &text.bytes()).graph.faces;
    faces
        .iter()
        .map(|face| face.color.map(|Color(rgba)| rgba))
        .collect()
}

#[test]
fn styles_of_items_that_are_not_solids() {
    let styled = |item: usize, transparency: Option<f64>| {
        move |text: &mut StepText, items: [usize; 4]| {
            let style = style(text, "1.,0.,0.", transparency);
            text.add(format!("STYLED_ITEM('',(#{style}),#{})", items[item]));
        }
    };
    for item in 1..4 {
        assert_eq!(
            colors_of(styled(item, None)),
            [Some(0xff00_00ff); 6],
            "item {item}"
        );
    }
    assert_eq!(colors_of(styled(2, Some(0.5))), [Some(0xff00_0080); 6]);
    assert_eq!(colors_of(styled(2, Some(7.0))), [Some(0xff00_0000); 6]);
    let complex = |text: &mut StepText, [_, _, model, _]: [usize; 4]| {
        let style = style(text, "0.,1.,0.", None);
        text.add(format!(
            "(REPRESENTATION_ITEM('')STYLED_ITEM((#{style}),#{model}))"
        ));
    };
    assert_eq!(colors_of(complex), [Some(0x00ff_00ff); 6]);
    // Each style overrides the previous one. The last style of the chain applies for any order in the file.
    let chain = |text: &mut StepText, [face, ..]: [usize; 4]| {
        let [red, green, blue] =
            ["1.,0.,0.", "0.,1.,0.", "0.,0.,1."].map(|rgb| style(text, rgb, None));
        let plain = text.add(format!("STYLED_ITEM('',(#{red}),#{face})"));
        text.add(format!(
            "OVER_RIDING_STYLED_ITEM('',(#{blue}),#{face},#{})",
            plain + 2
        ));
        text.add(format!(
            "OVER_RIDING_STYLED_ITEM('',(#{green}),#{face},#{plain})"
        ));
    };
    assert_eq!(colors_of(chain)[..2], [Some(0x0000_ffff), None]);
}

#[test]
fn each_mapped_item_has_its_own_style() {
    let mut text = cuboid([1.0; 3]);
    let cube = text.add("APPROVAL_STATUS('approved')") - 1;
    let axes = text.axes([0.0; 3], UP, X);
    let map = text.add(format!("REPRESENTATION_MAP(#{axes},#{cube})"));
    let items = [[5.0, 0.0, 0.0], [0.0, 5.0, 0.0]].map(|at| {
        let target = text.axes(at, UP, X);
        text.add(format!("MAPPED_ITEM('',#{map},#{target})"))
    });
    text.add(format!(
        "SHAPE_REPRESENTATION('',({}),#1)",
        references(&items)
    ));
    for (item, rgb) in items.into_iter().zip(["1.,0.,0.", "0.,1.,0."]) {
        let style = style(&mut text, rgb, None);
        text.add(format!("STYLED_ITEM('',(#{style}),#{item})"));
    }
    text.add(format!(
        "PRESENTATION_LAYER_ASSIGNMENT('second','',(#{}))",
        items[1]
    ));
    let brep = brep_of("mapped items", text.bytes());
    let (shape, _) = tessellate_instances(&brep, &TessellationOptions::default());
    let of_face = |face: usize| {
        let face = &shape.graph.faces[face];
        (face.color.map(|Color(rgba)| rgba), face.layer.as_deref())
    };
    assert_eq!(
        (of_face(0), of_face(6)),
        (
            (Some(0xff00_00ff), None),
            (Some(0x00ff_00ff), Some("second"))
        )
    );
}
