//! Every hard case of STEP files by name: what is read of it, in closed form.

#![allow(clippy::unwrap_used, reason = "a test that cannot build its own text has failed")]

#[path = "../src/fixtures.rs"]
#[allow(dead_code, reason = "the unit tests use the rest of it")]
mod fixtures;

use FaceType::{Bspline, Cone, Cylinder, Plane, Sphere, Torus};
use brep::{ReadBudget, Shape, ShapeOptions, read, shape};
use carrier::{FaceType, Point, solid_mesh, weld};
use fixtures::{CUBE_POLYGONS, StepText, box_corners, cuboid, cylinder, references};
use std::f64::consts::{PI, TAU};
use synth::fixtures::{Angle, FullTurn, Length};

const UP: Point = [0.0, 0.0, 1.0];
const X: Point = [1.0, 0.0, 0.0];

fn shape_of(name: &str, text: &[u8]) -> Shape {
    let brep = read(text, &ReadBudget::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
    shape(&brep, &ShapeOptions { solid_volumes: true, ..ShapeOptions::default() })
}

/// Types and edges as the file has them, the total area within 1 %, and no face lost.
#[track_caller]
fn check_faces(name: &str, text: impl AsRef<[u8]>, types: &[(usize, FaceType)], n_edges: usize, area: f64) -> Shape {
    let shape = shape_of(name, text.as_ref());
    assert_eq!(shape.lost, [], "{name}");
    for face_type in FaceType::ALL {
        let expected: usize = types.iter().filter(|entry| entry.1 == face_type).map(|entry| entry.0).sum();
        let found = shape.graph.faces.iter().filter(|face| face.face_type == face_type).count();
        assert_eq!(found, expected, "{name}: {face_type}");
    }
    assert_eq!(shape.graph.edges.len(), n_edges, "{name}: edges");
    let found: f64 = shape.graph.faces.iter().map(|face| face.area).sum();
    assert!((found - area).abs() <= 0.01 * area, "{name}: area {found}, expected {area}");
    shape
}

/// As `check_faces`; the mesh closes besides, and the surfaces enclose this volume within 1 %.
#[track_caller]
fn check(name: &str, text: impl AsRef<[u8]>, types: &[(usize, FaceType)], n_edges: usize, area: f64, volume: f64) {
    let shape = check_faces(name, text, types, n_edges, area);
    let mesh = solid_mesh(&shape.mesh, &weld(&shape.mesh), |_| true);
    assert!(mesh.watertight && mesh.volume > 0.0, "{name}: the mesh is open");
    let found: f64 = shape.solid_volumes.iter().sum();
    assert!((found - volume).abs() <= 0.01 * volume, "{name}: volume {found}, expected {volume}");
}

/// An open shell: as `check_faces`, and the mesh has a border.
#[track_caller]
fn check_open(name: &str, text: impl AsRef<[u8]>, types: &[(usize, FaceType)], n_edges: usize, area: f64) {
    let shape = check_faces(name, text, types, n_edges, area);
    assert!(!solid_mesh(&shape.mesh, &weld(&shape.mesh), |_| true).watertight, "{name}: the mesh is closed");
}

#[test]
fn full_turns_with_and_without_seams() {
    for (turn, n) in [(FullTurn::Seamed, 1), (FullTurn::Seamless, 1), (FullTurn::Halved, 2)] {
        let name = |kind: &str| format!("{kind} {turn:?}");
        let both = 2 * n + if n == 2 { 2 } else { 0 };
        let text = synth::fixtures::cylinder(10.0, 25.0, turn);
        check(&name("cylinder"), text, &[(2, Plane), (n, Cylinder)], both, 700.0 * PI, 2500.0 * PI);
        let side = PI * 12.0 * 12_f64.hypot(20.0);
        let text = synth::fixtures::cone(12.0, 20.0, turn);
        let edges = n + if n == 2 { 2 } else { 0 };
        check(&name("cone"), text, &[(1, Plane), (n, Cone)], edges, side + 144.0 * PI, 960.0 * PI);
        let text = synth::fixtures::sphere(15.0, turn);
        let edges = if n == 2 { 2 } else { 0 };
        check(&name("sphere"), text, &[(n, Sphere)], edges, 900.0 * PI, 4500.0 * PI);
    }
    let text = synth::fixtures::torus(20.0, 5.0);
    check("torus with seams", text, &[(1, Torus)], 0, 400.0 * PI * PI, 1000.0 * PI * PI);
}

/// A whole torus that a vertex bounds: in closed form by the angle at which its tube meets the axis.
fn whole_torus(entity: &str, [major, minor]: [f64; 2]) -> (StepText, [f64; 2]) {
    let mut text = StepText::in_millimetres();
    let axes = text.axes([0.0; 3], UP, X);
    let surface = text.add(entity.replace('@', &format!("#{axes}")));
    let end = (-major / minor).clamp(-1.0, 1.0).acos();
    let vertex = text.vertex([0.0, 0.0, minor * end.sin()]);
    let vertex = text.add(format!("VERTEX_LOOP('',#{vertex})"));
    let bound = text.add(format!("FACE_BOUND('',#{vertex},.T.)"));
    let face = text.add(format!("ADVANCED_FACE('',(#{bound}),#{surface},.T.)"));
    text.solid(&[face]);
    let (sin, double) = (end.sin(), end + end.sin() * end.cos());
    let area = 2.0 * TAU * minor * (major * end + minor * sin);
    let squares = 2.0 * major * major * sin + 2.0 * major * minor * double;
    (text, [area, PI * minor * (squares + minor * minor * (2.0 * sin - 2.0 / 3.0 * sin.powi(3)))])
}

#[test]
fn horn_apple_and_lemon_tori() {
    let cases = [
        ("horn torus", "TOROIDAL_SURFACE('',@,2.,2.)", [2.0, 2.0]),
        ("apple torus", "DEGENERATE_TOROIDAL_SURFACE('',@,1.,2.,.T.)", [1.0, 2.0]),
        ("lemon torus by its sign", "TOROIDAL_SURFACE('',@,-1.,2.)", [-1.0, 2.0]),
        ("lemon torus", "DEGENERATE_TOROIDAL_SURFACE('',@,1.,2.,.F.)", [-1.0, 2.0]),
    ];
    for (name, entity, radii) in cases {
        let (text, [area, volume]) = whole_torus(entity, radii);
        check(name, text.bytes(), &[(1, Torus)], 0, area, volume);
    }
}

/// A circle of radius 2 about `at`, which touches the axis at the origin.
fn tube_section(text: &mut StepText, axis: Point, at: Point, vertex: usize) -> usize {
    circle_edge(text, [vertex; 2], [axis, at.map(|x| -x / 2.0)], at, 2.0)
}

/// A quarter of a horn torus between two discs that touch its axis, in the octants where x and y are positive.
fn horn_bend() -> String {
    let mut text = StepText::in_millimetres();
    let vertex = text.vertex([0.0; 3]);
    let y = [0.0, 1.0, 0.0];
    let from = tube_section(&mut text, [0.0, -1.0, 0.0], [2.0, 0.0, 0.0], vertex);
    let to = tube_section(&mut text, X, [0.0, 2.0, 0.0], vertex);
    let planes = [([0.0, -1.0, 0.0], X), ([-1.0, 0.0, 0.0], y)].map(|(normal, along)| {
        let axes = text.axes([0.0; 3], normal, along);
        text.add(format!("PLANE('',#{axes})"))
    });
    let axes = text.axes([0.0; 3], UP, X);
    let torus = text.add(format!("TOROIDAL_SURFACE('',#{axes},2.,2.)"));
    let faces = [
        text.face(planes[0], ".T.", &[(from, ".T.")]),
        text.face(planes[1], ".T.", &[(to, ".F.")]),
        text.face(torus, ".T.", &[(from, ".F."), (to, ".T.")]),
    ];
    text.solid(&faces);
    String::from_utf8(text.bytes()).unwrap()
}

#[test]
fn a_bend_of_a_horn_torus() {
    let area = 8.0 * PI + 4.0 * PI * PI;
    check("bend of a horn torus", horn_bend(), &[(2, Plane), (1, Torus)], 2, area, 4.0 * PI * PI);
}

/// The file with its representation mapped into another by axes of which the first points backwards.
fn mirrored(text: &str) -> String {
    let (before, _) = text.split_once("=ADVANCED_BREP_SHAPE_REPRESENTATION").unwrap();
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
    check("bend in a mirror", &bend, &[(2, Plane), (1, Torus)], 2, area, 4.0 * PI * PI);
    assert!(shape_of("bend in a mirror", bend.as_bytes()).mesh.vertices.iter().all(|place| place[0] < 1e-9));
    let plain = String::from_utf8(cylinder(2.0, 3.0).bytes()).unwrap();
    check("cylinder in a mirror", mirrored(&plain), &[(2, Plane), (1, Cylinder)], 2, 20.0 * PI, 12.0 * PI);
    let spline = mirrored(&spline_cylinder(|_| {}));
    check("spline in a mirror", spline, &[(2, Plane), (1, Bspline)], 2, 20.0 * PI, 12.0 * PI);
}

#[test]
fn pieces_of_faces_and_edges() {
    // The top of a cube names its parent, and one of its edges is a piece of a longer one.
    let text = String::from_utf8(cuboid([10.0; 3]).bytes()).unwrap();
    let face = text.match_indices("ADVANCED_FACE('',(").nth(1).unwrap().0;
    let end = face + text[face..].find(';').unwrap();
    let bounds = &text[face + "ADVANCED_FACE('',".len()..text[face..].find("),#").unwrap() + face + 1];
    let edge = text.find("EDGE_CURVE").unwrap();
    let edge_end = edge + text[edge..].find(';').unwrap();
    let ends = text[edge..edge_end].split(',').skip(1).take(2).collect::<Vec<_>>().join(",");
    let pieces = format!("#9001={};\n#9002={};\n", &text[face..end], &text[edge..edge_end]);
    let text = format!(
        "{}SUBEDGE('',{ends},#9002){}SUBFACE('',{bounds},#9001){}",
        &text[..edge],
        &text[edge_end..face],
        text[end..].replacen("ENDSEC;", &format!("{pieces}ENDSEC;"), 1)
    );
    check("pieces of faces and edges", text, &[(6, Plane)], 12, 600.0, 1000.0);
}

#[test]
fn a_cap_on_the_inner_sheet_of_a_torus() {
    // The sheet that a negative major radius gives, in a file that writes the radius as positive.
    let mut text = StepText::in_millimetres();
    let (reach, height): (f64, f64) = (3.0, 24_f64.sqrt());
    let vertex = text.vertex([reach - 1.0, 0.0, height]);
    let rim = circle_edge(&mut text, [vertex; 2], [UP, X], [0.0, 0.0, height], reach - 1.0);
    let axes = text.axes([0.0; 3], UP, X);
    let torus = text.add(format!("TOROIDAL_SURFACE('',#{axes},1.,{:?})", (reach * reach + height * height).sqrt()));
    let face = text.face(torus, ".F.", &[(rim, ".T.")]);
    // 2π∫ρ ds along the meridian from the rim to the tip, with ρ = r·cos t − 1.
    let minor = (reach * reach + height * height).sqrt();
    let [from, to] = [(reach / minor).acos(), (1.0 / minor).acos()];
    let area = TAU * minor * (minor * (to.sin() - from.sin()) - (to - from));
    check_open("cap on the inner sheet of a torus", open(text, &[face]), &[(1, Torus)], 0, area);
}

/// An open shell of these faces.
fn open(mut text: StepText, faces: &[usize]) -> Vec<u8> {
    let shell = text.add(format!("OPEN_SHELL('',({}))", references(faces)));
    let model = text.add(format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"));
    text.add(format!("MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#{model}),#1)"));
    text.bytes()
}

fn circle_edge(text: &mut StepText, [from, to]: [usize; 2], [z, x]: [Point; 2], at: Point, radius: f64) -> usize {
    let axes = text.axes(at, z, x);
    let circle = text.add(format!("CIRCLE('',#{axes},{radius:?})"));
    text.add(format!("EDGE_CURVE('',#{from},#{to},#{circle},.T.)"))
}

#[test]
fn poles_inside_and_on_the_boundary() {
    let mut text = StepText::in_millimetres();
    let radius = 5.0 * 3_f64.sqrt();
    let vertex = text.vertex([radius, 0.0, 5.0]);
    let rim = circle_edge(&mut text, [vertex; 2], [UP, X], [0.0, 0.0, 5.0], radius);
    let axes = text.axes([0.0; 3], UP, X);
    let sphere = text.add(format!("SPHERICAL_SURFACE('',#{axes},10.)"));
    let face = text.face(sphere, ".T.", &[(rim, ".T.")]);
    check_open("pole inside", open(text, &[face]), &[(1, Sphere)], 0, 100.0 * PI);

    let mut text = StepText::in_millimetres();
    let y = [0.0, 1.0, 0.0];
    let vertices = [X, y, UP].map(|at| text.vertex(at.map(|x| 10.0 * x)));
    let arcs = [(0, 1, UP, X), (1, 2, X, y), (2, 0, y, UP)]
        .map(|(i, j, z, x)| (circle_edge(&mut text, [vertices[i], vertices[j]], [z, x], [0.0; 3], 10.0), ".T."));
    let axes = text.axes([0.0; 3], UP, X);
    let sphere = text.add(format!("SPHERICAL_SURFACE('',#{axes},10.)"));
    let face = text.face(sphere, ".T.", &arcs);
    check_open("pole on the boundary", open(text, &[face]), &[(1, Sphere)], 0, 50.0 * PI);
}

/// A helix of radius 10 about z as a polygon of many corners, from this height, one turn in 5.
fn helix(text: &mut StepText, [from, to]: [usize; 2], foot: f64, n_turns: usize) -> usize {
    let n = 256 * n_turns;
    let poles: Vec<usize> = (0..=n)
        .map(|i| {
            let angle = TAU * i as f64 / 256.0;
            text.point([10.0 * angle.cos(), 10.0 * angle.sin(), foot + 5.0 * i as f64 / 256.0])
        })
        .collect();
    let mut multiplicities = vec!["1"; n + 1];
    (multiplicities[0], multiplicities[n]) = ("2", "2");
    let knots: Vec<String> = (0..=n).map(|i| format!("{i}.")).collect();
    let (multiplicities, knots) = (multiplicities.join(","), knots.join(","));
    let poles = references(&poles);
    let curve = text.add(format!(
        "B_SPLINE_CURVE_WITH_KNOTS('',1,({poles}),.UNSPECIFIED.,.F.,.F.,({multiplicities}),({knots}),.UNSPECIFIED.)"
    ));
    text.add(format!("EDGE_CURVE('',#{from},#{to},#{curve},.T.)"))
}

#[test]
fn helical_faces() {
    let mut text = StepText::in_millimetres();
    let axes = text.axes([0.0; 3], UP, X);
    let side = text.add(format!("CYLINDRICAL_SURFACE('',#{axes},10.)"));
    let corners = [0.0, 10.0, 12.0, 2.0].map(|z| [10.0, 0.0, z]);
    let vertices = corners.map(|at| text.vertex(at));
    let low = helix(&mut text, [vertices[0], vertices[1]], 0.0, 2);
    let high = helix(&mut text, [vertices[3], vertices[2]], 2.0, 2);
    let ends = [[1, 2], [3, 0]].map(|ends| text.straight_edge(ends.map(|i| vertices[i]), ends.map(|i| corners[i])));
    let face = text.face(side, ".T.", &[(low, ".T."), (ends[0], ".T."), (high, ".F."), (ends[1], ".T.")]);
    check_open("helical band of two turns", open(text, &[face]), &[(1, Cylinder)], 0, 80.0 * PI);

    let mut text = StepText::in_millimetres();
    let axes = text.axes([0.0; 3], UP, X);
    let side = text.add(format!("CYLINDRICAL_SURFACE('',#{axes},10.)"));
    let corners = [0.0, 5.0, 10.0].map(|z| [10.0, 0.0, z]);
    let vertices = corners.map(|at| text.vertex(at));
    let rim = circle_edge(&mut text, [vertices[0]; 2], [UP, X], [0.0; 3], 10.0);
    let thread = helix(&mut text, [vertices[1], vertices[2]], 5.0, 1);
    let step = text.straight_edge([vertices[2], vertices[1]], [corners[2], corners[1]]);
    let seam = text.straight_edge([vertices[0], vertices[1]], [corners[0], corners[1]]);
    let walk = [(rim, ".T."), (seam, ".T."), (step, ".F."), (thread, ".F."), (seam, ".F.")];
    let face = text.face(side, ".T.", &walk);
    check_open("one winding thread above a rim", open(text, &[face]), &[(1, Cylinder)], 0, 150.0 * PI);
}

#[test]
fn plane_faces_that_are_hard() {
    let slab = |sides: Point| 2.0 * (sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0]);
    let cases = [
        ("sliver", [100.0, 100.0, 1e-4]),
        ("long sliver", [1e4, 1e-3, 1.0]),
        ("cube of 1e-6", [1e-6; 3]),
        ("cube of 1e4", [1e4; 3]),
    ];
    for (name, sides) in cases {
        check(name, cuboid(sides).bytes(), &[(6, Plane)], 12, slab(sides), sides.iter().product());
    }
    check_open("open shell", synth::fixtures::open_box([10.0; 3]), &[(5, Plane)], 8, 500.0);
    check("void", synth::fixtures::hollow_block([20.0; 3], 5.0), &[(12, Plane)], 24, 3000.0, 7000.0);

    let mut text = StepText::in_millimetres();
    let (sin, cos) = 0.1_f64.sin_cos();
    let corners = [X, [cos, sin, 0.0]];
    let vertices = corners.map(|at| text.vertex(at));
    let arc = circle_edge(&mut text, vertices, [UP, X], [0.0; 3], 1.0);
    let chord = text.straight_edge(vertices, corners);
    let axes = text.axes([0.0; 3], UP, X);
    let plane = text.add(format!("PLANE('',#{axes})"));
    let face = text.face(plane, ".T.", &[(arc, ".T."), (chord, ".F.")]);
    check_open("lens", open(text, &[face]), &[(1, Plane)], 0, 0.5 * (0.1 - sin));
}

#[test]
fn inner_loops_that_touch() {
    let mut text = StepText::in_millimetres();
    let axes = text.axes([0.0; 3], UP, X);
    let plane = text.add(format!("PLANE('',#{axes})"));
    let corners: [Point; 9] =
        [[0., 0.], [10., 0.], [10., 10.], [0., 10.], [5., 5.], [2., 4.], [2., 6.], [8., 6.], [8., 4.]]
            .map(|[x, y]| [x, y, 0.0]);
    let vertices = corners.map(|at| text.vertex(at));
    let loops: [&[usize]; 3] = [&[0, 1, 2, 3], &[4, 5, 6], &[4, 7, 8]];
    let bounds: Vec<usize> = loops
        .iter()
        .map(|walk| {
            let uses: Vec<usize> = (0..walk.len())
                .map(|i| {
                    let [a, b] = [walk[i], walk[(i + 1) % walk.len()]];
                    let edge = text.straight_edge([vertices[a], vertices[b]], [corners[a], corners[b]]);
                    text.add(format!("ORIENTED_EDGE('',*,*,#{edge},.T.)"))
                })
                .collect();
            let edges = text.add(format!("EDGE_LOOP('',({}))", references(&uses)));
            text.add(format!("FACE_BOUND('',#{edges},.T.)"))
        })
        .collect();
    let face = text.add(format!("ADVANCED_FACE('',({}),#{plane},.T.)", references(&bounds)));
    check_open("inner loops touching", open(text, &[face]), &[(1, Plane)], 0, 100.0 - 6.0);
}

/// The corners of two unit cubes, the second moved, and their polygons over one list of corners.
fn two_cubes(motion: Point) -> (Vec<Point>, Vec<Vec<usize>>) {
    let mut corners = box_corners([1.0; 3]).to_vec();
    let second = box_corners([1.0; 3]).map(|corner| [0, 1, 2].map(|axis| corner[axis] + motion[axis])).map(|corner| {
        corners.iter().position(|&known| known == corner).unwrap_or_else(|| {
            corners.push(corner);
            corners.len() - 1
        })
    });
    let moved = CUBE_POLYGONS.map(|polygon| polygon.iter().map(|&i| second[i]).collect());
    (corners, CUBE_POLYGONS.iter().map(|polygon| polygon.to_vec()).chain(moved).collect())
}

#[test]
fn edges_that_more_than_two_faces_share() {
    let faces = |text: &mut StepText, motion| {
        let (corners, polygons) = two_cubes(motion);
        let polygons: Vec<&[usize]> = polygons.iter().map(Vec::as_slice).collect();
        text.polyhedron(&corners, &polygons)
    };
    let mut text = StepText::in_millimetres();
    let all = faces(&mut text, [1.0, 1.0, 0.0]);
    text.solid(&all);
    check("non-manifold edge", text.bytes(), &[(12, Plane)], 28, 12.0, 2.0);
    assert_eq!(shape_of("non-manifold edge", &text.bytes()).flags.non_manifold_edges, 1);

    let mut text = StepText::in_millimetres();
    let all = faces(&mut text, [1.0, 0.0, 0.0]);
    text.solid(&all[..6]);
    text.solid(&all[6..]);
    check("edges shared between shells", text.bytes(), &[(12, Plane)], 24, 12.0, 2.0);
}

#[test]
fn several_contexts_have_their_own_units() {
    let mut text = cuboid([1.0; 3]);
    let centimetre = text.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.CENTI.,.METRE.))");
    let context = text.add(format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#{centimetre},#3))REPRESENTATION_CONTEXT('',''))"
    ));
    let faces = text.polyhedron(&box_corners([1.0; 3]), &CUBE_POLYGONS);
    let shell = text.add(format!("CLOSED_SHELL('',({}))", references(&faces)));
    let solid = text.add(format!("MANIFOLD_SOLID_BREP('',#{shell})"));
    text.add(format!("ADVANCED_BREP_SHAPE_REPRESENTATION('',(#{solid}),#{context})"));
    check("several contexts", text.bytes(), &[(12, Plane)], 24, 606.0, 1001.0);
}

#[test]
fn units_of_every_kind() {
    let slant = PI * 17.0 * 7_f64.hypot(20.0);
    let volume = PI * 20.0 / 3.0 * (144.0 + 60.0 + 25.0);
    let text = synth::fixtures::frustum(12.0, 5.0, 20.0, FullTurn::Seamed, Angle::Degree);
    check("degrees", text, &[(2, Plane), (1, Cone)], 2, slant + 169.0 * PI, volume);
    for length in [Length::Millimetre, Length::Inch, Length::Metre] {
        check_plate(
            &format!("{length:?}"),
            synth::fixtures::plate_with_hole(50.0, 6.0, 12.0, FullTurn::Seamed, length),
        );
    }
}

#[track_caller]
fn check_plate(name: &str, text: impl AsRef<[u8]>) {
    let disc = 144.0 * PI;
    let area = 2.0 * (2500.0 - disc) + 1200.0 + 144.0 * PI;
    check(name, text, &[(6, Plane), (1, Cylinder)], 14, area, 6.0 * (2500.0 - disc));
}

#[test]
fn texts_as_exporters_write_them() {
    let plate = synth::fixtures::plate_with_hole(50.0, 6.0, 12.0, FullTurn::Seamed, Length::Millimetre);
    let (header, data) = plate.split_at(plate.find("DATA;").unwrap());
    check_plate("$", header.to_owned() + &data.replace("''", "$"));
    check_plate("comments", plate.replace('=', "/**/=/* = */").replace("\n#", "\n/* it's; #1=PLANE( */#"));
    check_plate("huge ids", header.to_owned() + &data.replace('#', "#900000000000000"));
    check_plate("1990s line breaks", header.to_owned() + &data.replace(',', " ,\r\n   ").replace('(', " ( "));
    let mut bytes = header.as_bytes().to_vec();
    bytes.extend(
        data.replace("''", "'@'").bytes().flat_map(|b| if b == b'@' { vec![0xc3, 0xa9, 0xe9, 0xff] } else { vec![b] }),
    );
    check_plate("non-ASCII", bytes);
    for schema in ["CONFIG_CONTROL_DESIGN", "AUTOMOTIVE_DESIGN", "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF"] {
        let start = header.find("FILE_SCHEMA").unwrap();
        check_plate(schema, format!("{}FILE_SCHEMA(('{schema}'));\nENDSEC;\n{data}", &header[..start]));
    }
    let mut lines: Vec<&str> = data.lines().filter(|line| line.starts_with('#')).collect();
    lines.reverse();
    check_plate("entities backwards", format!("{header}DATA;\n{}\nENDSEC;\nEND-ISO-10303-21;\n", lines.join("\n")));
}

/// A cylinder whose wall is a closed rational B-spline, its partial entities in an order.
fn spline_cylinder(order: impl Fn(&mut Vec<String>)) -> String {
    let mut text = cylinder(2.0, 3.0);
    let around = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]];
    let rows = around.map(|[x, y]| {
        let row = [0.0, 3.0].map(|z| text.point([2.0 * f64::from(x), 2.0 * f64::from(y), z]));
        format!("({})", references(&row))
    });
    let weights = around.map(|[x, y]| if x * y == 0 { "(1.,1.)" } else { "(0.7071067811865476,0.7071067811865476)" });
    let mut partials = vec![
        "BOUNDED_SURFACE()".to_owned(),
        format!("B_SPLINE_SURFACE(2,1,({}),.UNSPECIFIED.,.T.,.F.,.F.)", rows.join(",")),
        "B_SPLINE_SURFACE_WITH_KNOTS((3,2,2,2,3),(2,2),(0.,1.,2.,3.,4.),(0.,1.),.UNSPECIFIED.)".to_owned(),
        "GEOMETRIC_REPRESENTATION_ITEM()".to_owned(),
        format!("RATIONAL_B_SPLINE_SURFACE(({}))", weights.join(",")),
        "REPRESENTATION_ITEM('')".to_owned(),
        "SURFACE()".to_owned(),
    ];
    order(&mut partials);
    let text = String::from_utf8(text.bytes()).unwrap();
    let start = text.find("CYLINDRICAL_SURFACE").unwrap();
    let end = start + text[start..].find(';').unwrap();
    format!("{}({}){}", &text[..start], partials.concat(), &text[end..])
}

#[test]
fn a_closed_spline_in_every_order_of_its_partial_entities() {
    let types = [(2, Plane), (1, Bspline)];
    for turn in 0..7 {
        let text = spline_cylinder(|partials| partials.rotate_left(turn));
        check(&format!("complex instance turned by {turn}"), text, &types, 2, 20.0 * PI, 12.0 * PI);
        let text = spline_cylinder(|partials| {
            partials.reverse();
            partials.rotate_left(turn);
        });
        check(&format!("complex instance backwards, turned by {turn}"), text, &types, 2, 20.0 * PI, 12.0 * PI);
    }
}

#[test]
fn a_spline_one_side_of_which_is_a_point() {
    let mut text = StepText::in_millimetres();
    let corners = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
    let poles = [0, 1, 0, 2].map(|i: usize| text.point(corners[i]));
    let spline = text.add(format!(
        "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,(({}),({})),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.)",
        references(&poles[..2]),
        references(&poles[2..])
    ));
    let vertices = corners.map(|at| text.vertex(at));
    let walk = [[0, 1], [1, 2], [2, 0]]
        .map(|ends| (text.straight_edge(ends.map(|i| vertices[i]), ends.map(|i| corners[i])), ".F."));
    let face = text.face(spline, ".T.", &[walk[2], walk[1], walk[0]]);
    check_open("degenerate B-spline", open(text, &[face]), &[(1, Bspline)], 0, 2.0);
}

#[test]
fn edges_off_their_surface() {
    let mut text = cuboid([10.0; 3]);
    let axes = text.axes([0.0, 0.0, 10.01], UP, X);
    let text = String::from_utf8(text.bytes()).unwrap();
    let top = text.match_indices("PLANE('',#").nth(1).unwrap().0;
    let end = top + text[top..].find(';').unwrap();
    let text = format!("{}PLANE('',#{axes}){}", &text[..top], &text[end..]);
    check("edges off their surface", text, &[(6, Plane)], 12, 600.0, 1000.0);
}

#[test]
fn boards_of_many_bodies() {
    check(
        "several solids in one representation",
        synth::fixtures::two_blocks([10.0; 3]),
        &[(12, Plane)],
        24,
        1200.0,
        2000.0,
    );
    check("coloured faces", synth::fixtures::coloured_cuboid([10.0; 3]), &[(6, Plane)], 12, 600.0, 1000.0);
}
