//! Tests cylinders, cones, spheres and tori: seams, poles, vertices as boundaries, boundaries that wind.

use super::*;
use FaceType::{Cone, Cylinder, Plane, Revolution, Sphere, Torus};
use partprobe_synth::fixtures::FullTurn;
use std::f64::consts::{PI, TAU};

#[test]
fn full_turns_with_and_without_seams() {
    for (turn, n) in [
        (FullTurn::Seamed, 1),
        (FullTurn::Seamless, 1),
        (FullTurn::Halved, 2),
    ] {
        let name = |kind: &str| format!("{kind} {turn:?}");
        let both = 2 * n + if n == 2 { 2 } else { 0 };
        let text = partprobe_synth::fixtures::cylinder(10.0, 25.0, turn);
        check(
            &name("cylinder"),
            text,
            &[(2, Plane), (n, Cylinder)],
            [both, 3],
            700.0 * PI,
            2500.0 * PI,
        );
        let side = PI * 12.0 * 12_f64.hypot(20.0);
        let text = partprobe_synth::fixtures::cone(12.0, 20.0, turn);
        let edges = n + if n == 2 { 2 } else { 0 };
        check(
            &name("cone"),
            text,
            &[(1, Plane), (n, Cone)],
            [edges, 2],
            side + 144.0 * PI,
            960.0 * PI,
        );
        let text = partprobe_synth::fixtures::sphere(15.0, turn);
        let edges = if n == 2 { 2 } else { 0 };
        check(
            &name("sphere"),
            text,
            &[(n, Sphere)],
            [edges, 1],
            900.0 * PI,
            4500.0 * PI,
        );
    }
    let text = partprobe_synth::fixtures::torus(20.0, 5.0);
    check(
        "torus with seams",
        text,
        &[(1, Torus)],
        [0, 1],
        400.0 * PI * PI,
        1000.0 * PI * PI,
    );
}

/// A whole torus that is bounded by a vertex, with its area and volume in closed form, from the angle at which its tube meets the
/// axis.
fn full_torus(entity: &str, [major, minor]: [f64; 2]) -> (StepText, [f64; 2]) {
    let mut text = StepText::in_millimeters();
    let axes = text.axes([0.0; 3], UP, X);
    let surface = text.add(entity.replace('@', &format!("#{axes}")));
    let end = (-major / minor).clamp(-1.0, 1.0).acos();
    let vertex = text.vertex(if major > minor {
        [major + minor, 0.0, 0.0]
    } else {
        [0.0, 0.0, minor * end.sin()]
    });
    let vertex = text.add(format!("VERTEX_LOOP('',#{vertex})"));
    let bound = text.add(format!("FACE_BOUND('',#{vertex},.T.)"));
    let face = text.add(format!("ADVANCED_FACE('',(#{bound}),#{surface},.T.)"));
    text.solid(&[face]);
    let (sin, double) = (end.sin(), end + end.sin() * end.cos());
    let area = 2.0 * TAU * minor * (major * end + minor * sin);
    let squares = 2.0 * major * major * sin + 2.0 * major * minor * double;
    (
        text,
        [
            area,
            PI * minor * (squares + minor * minor * (2.0 * sin - 2.0 / 3.0 * sin.powi(3))),
        ],
    )
}

#[test]
fn horn_apple_and_lemon_tori() {
    let cases = [
        (
            "torus bounded by a vertex",
            "TOROIDAL_SURFACE('',@,5.,2.)",
            [5.0, 2.0],
        ),
        ("horn torus", "TOROIDAL_SURFACE('',@,2.,2.)", [2.0, 2.0]),
        (
            "apple torus",
            "DEGENERATE_TOROIDAL_SURFACE('',@,1.,2.,.T.)",
            [1.0, 2.0],
        ),
        (
            "lemon torus by its sign",
            "TOROIDAL_SURFACE('',@,-1.,2.)",
            [-1.0, 2.0],
        ),
        (
            "lemon torus",
            "DEGENERATE_TOROIDAL_SURFACE('',@,1.,2.,.F.)",
            [-1.0, 2.0],
        ),
    ];
    for (name, entity, radii) in cases {
        let (text, [area, volume]) = full_torus(entity, radii);
        check(name, text.bytes(), &[(1, Torus)], [0, 1], area, volume);
    }
}

/// The surface of a revolved circle of this radius around `[reach, 0, 0]`, and edges from tip to tip at 0° and 90°: the outer
/// arc, which runs up, or the inner arc, which runs down.
fn revolved_circle(
    text: &mut StepText,
    [reach, radius]: [f64; 2],
    is_outer: bool,
) -> (usize, [usize; 2], [usize; 2]) {
    let height = (radius * radius - reach * reach).sqrt();
    let tips = [-height, height].map(|z| text.vertex([0.0, 0.0, z]));
    let ends = if is_outer { tips } else { [tips[1], tips[0]] };
    let arcs = [([0.0, -1.0, 0.0], X), (X, [0.0, 1.0, 0.0])].map(|(z, x): (Point, Point)| {
        circle_edge(
            text,
            ends,
            [z, x],
            x.map(|coordinate| reach * coordinate),
            radius,
        )
    });
    let axes = text.axes([reach, 0.0, 0.0], [0.0, -1.0, 0.0], X);
    let circle = text.add(format!("CIRCLE('',#{axes},{radius:?})"));
    let (origin, up) = (text.point([0.0; 3]), text.direction(UP));
    let axis = text.add(format!("AXIS1_PLACEMENT('',#{origin},#{up})"));
    (
        text.add(format!("SURFACE_OF_REVOLUTION('',#{circle},#{axis})")),
        arcs,
        tips,
    )
}

/// Area and volume of one revolved arc of a torus with these radii. For the inner arc, `reach` is negative.
fn fully_revolved([reach, radius]: [f64; 2]) -> [f64; 2] {
    let end = (-reach / radius).acos();
    let (sin, double) = (end.sin(), end + end.sin() * end.cos());
    let squares = 2.0 * reach * reach * sin + 2.0 * reach * radius * double;
    let volume = PI * radius * (squares + radius * radius * (2.0 * sin - 2.0 / 3.0 * sin.powi(3)));
    [2.0 * TAU * radius * (reach * end + radius * sin), volume]
}

#[test]
fn apples_and_lemons_of_revolution() {
    for (name, is_outer, sense) in [("apple", true, ".T."), ("lemon", false, ".F.")] {
        let mut text = StepText::in_millimeters();
        let (surface, [seam, _], _) = revolved_circle(&mut text, [1.0, 2.0], is_outer);
        let face = text.face(surface, sense, &[(seam, ".T."), (seam, ".F.")]);
        text.solid(&[face]);
        let [area, volume] = fully_revolved([if is_outer { 1.0 } else { -1.0 }, 2.0]);
        check(
            &format!("{name} of revolution"),
            text.bytes(),
            &[(1, Revolution)],
            [0, 1],
            area,
            volume,
        );

        let mut text = StepText::in_millimeters();
        let (surface, _, [tip, _]) = revolved_circle(&mut text, [1.0, 2.0], is_outer);
        let vertex = text.add(format!("VERTEX_LOOP('',#{tip})"));
        let bound = text.add(format!("FACE_BOUND('',#{vertex},.T.)"));
        let face = text.add(format!("ADVANCED_FACE('',(#{bound}),#{surface},{sense})"));
        text.solid(&[face]);
        check(
            &format!("{name} bounded by a tip"),
            text.bytes(),
            &[(1, Revolution)],
            [0, 1],
            area,
            volume,
        );
    }
    let mut text = StepText::in_millimeters();
    let (surface, [first, second], tips) = revolved_circle(&mut text, [1.0, 2.0], true);
    let height = 3_f64.sqrt();
    let line = text.straight_edge(tips, [[0.0, 0.0, -height], [0.0, 0.0, height]]);
    let flat =
        [([0.0, -1.0, 0.0], X), ([-1.0, 0.0, 0.0], [0.0, 1.0, 0.0])].map(|(normal, along)| {
            let axes = text.axes([0.0; 3], normal, along);
            text.add(format!("PLANE('',#{axes})"))
        });
    let faces = [
        text.face(surface, ".T.", &[(first, ".F."), (second, ".T.")]),
        text.face(flat[0], ".T.", &[(first, ".T."), (line, ".F.")]),
        text.face(flat[1], ".T.", &[(second, ".F."), (line, ".T.")]),
    ];
    text.solid(&faces);
    let [area, volume] = fully_revolved([1.0, 2.0]).map(|whole| whole / 4.0);
    // Each flat end is the fraction of a disc beyond a chord at distance 1 from its middle.
    let area = area + 2.0 * (4.0 * (2.0 * PI / 3.0) + height);
    check(
        "quarter of an apple",
        text.bytes(),
        &[(1, Revolution), (2, Plane)],
        [3, 3],
        area,
        volume,
    );
}

/// A point of the torus of radii 5 and 2 at angles in degrees.
fn on_torus([u, v]: [f64; 2]) -> Point {
    let ((sin_u, cos_u), (sin_v, cos_v)) = (u.to_radians().sin_cos(), v.to_radians().sin_cos());
    [
        (5.0 + 2.0 * cos_v) * cos_u,
        (5.0 + 2.0 * cos_v) * sin_u,
        2.0 * sin_v,
    ]
}

#[test]
fn holes_all_around_a_torus() {
    // Two windows that overlap along the circles, so that every meridian meets one of them, with seams as exporters write them.
    let mut text = StepText::in_millimeters();
    let mut vertices = std::collections::BTreeMap::new();
    let mut vertex = |text: &mut StepText, at: [i32; 2]| {
        let key = at.map(|degrees| degrees.rem_euclid(360));
        *vertices
            .entry(key)
            .or_insert_with(|| text.vertex(on_torus(key.map(f64::from))))
    };
    let mut line = |text: &mut StepText, [from, to]: [[i32; 2]; 2]| {
        let ends = [from, to].map(|at| vertex(text, at));
        let [u, v] = from.map(|degrees| f64::from(degrees).to_radians());
        if from[1] == to[1] {
            circle_edge(
                text,
                ends,
                [UP, X],
                [0.0, 0.0, 2.0 * v.sin()],
                5.0 + 2.0 * v.cos(),
            )
        } else {
            let out = [u.cos(), u.sin(), 0.0];
            circle_edge(
                text,
                ends,
                [[u.sin(), -u.cos(), 0.0], out],
                out.map(|coordinate| 5.0 * coordinate),
                2.0,
            )
        }
    };
    // One window at 0°..200° and 20°..60°, the other at 180°..380° and 100°..140°, a seam at 190° and one at 0°.
    let sides = [
        [[190, 0], [550, 0]],
        [[190, 0], [190, 20]],
        [[0, 20], [190, 20]],
        [[0, 20], [0, 60]],
        [[0, 60], [190, 60]],
        [[190, 60], [190, 100]],
        [[180, 100], [190, 100]],
        [[180, 100], [180, 140]],
        [[180, 140], [190, 140]],
        [[190, 140], [190, 360]],
        [[190, 140], [380, 140]],
        [[380, 100], [380, 140]],
        [[190, 100], [380, 100]],
        [[190, 60], [200, 60]],
        [[200, 20], [200, 60]],
        [[190, 20], [200, 20]],
    ];
    let edges = sides.map(|side| line(&mut text, side));
    let walk = [
        (0, ".T."),
        (1, ".T."),
        (2, ".F."),
        (3, ".T."),
        (4, ".T."),
        (5, ".T."),
        (6, ".F."),
        (7, ".T."),
        (8, ".T."),
        (9, ".T."),
        (0, ".F."),
        (9, ".F."),
        (10, ".T."),
        (11, ".F."),
        (12, ".F."),
        (5, ".F."),
        (13, ".T."),
        (14, ".F."),
        (15, ".F."),
        (1, ".F."),
    ]
    .map(|(i, flag)| (edges[i], flag));
    let axes = text.axes([0.0; 3], UP, X);
    let torus = text.add(format!("TOROIDAL_SURFACE('',#{axes},5.,2.)"));
    let face = text.face(torus, ".T.", &walk);
    let window = |from: f64, to: f64| {
        let [from, to] = [from, to].map(f64::to_radians);
        200_f64.to_radians() * 2.0 * (5.0 * (to - from) + 2.0 * (to.sin() - from.sin()))
    };
    let area = 40.0 * PI * PI - window(20.0, 60.0) - window(100.0, 140.0);
    check_open(
        "windows all around a torus",
        open(text, &[face]),
        &[(1, Torus)],
        [0, 1],
        area,
    );
}

#[test]
fn a_boundary_through_an_apex() {
    // A cone whose side lacks a sector from the apex down to half its height.
    for (radius, turn) in [(3.0, 0.5_f64), (3.0, 1.9), (3.0, 3.0), (3.1, 4.5)] {
        let height = 5.0;
        let mut text = StepText::in_millimeters();
        let corners = [
            [radius, 0.0, 0.0],
            [0.0, 0.0, height],
            [radius / 2.0, 0.0, height / 2.0],
        ];
        let last = [
            radius / 2.0 * turn.cos(),
            radius / 2.0 * turn.sin(),
            height / 2.0,
        ];
        let [foot, apex, from] = corners.map(|at| text.vertex(at));
        let to = text.vertex(last);
        let rim = circle_edge(&mut text, [foot; 2], [UP, X], [0.0; 3], radius);
        let down = text.straight_edge([apex, from], [corners[1], corners[2]]);
        let across = circle_edge(
            &mut text,
            [from, to],
            [UP, X],
            [0.0, 0.0, height / 2.0],
            radius / 2.0,
        );
        let back = text.straight_edge([to, apex], [last, corners[1]]);
        let seam = text.straight_edge([foot, from], [corners[0], corners[2]]);
        let axes = text.axes([0.0; 3], UP, X);
        let angle = (radius / height).atan();
        let cone = text.add(format!(
            "CONICAL_SURFACE('',#{axes},{radius:?},{:?})",
            -angle
        ));
        let walk = [
            (rim, ".T."),
            (seam, ".T."),
            (down, ".F."),
            (back, ".F."),
            (across, ".F."),
            (seam, ".F."),
        ];
        let face = text.face(cone, ".T.", &walk);
        let side = radius * radius.hypot(height);
        let area = PI * side - 0.5 * turn * side / 4.0;
        check_open(
            &format!("sector of {turn} cut from an apex"),
            open(text, &[face]),
            &[(1, Cone)],
            [0, 1],
            area,
        );
    }
}

/// A circle of radius 2 around `at`. It touches the axis at the origin.
fn tube_section(text: &mut StepText, axis: Point, at: Point, vertex: usize) -> usize {
    circle_edge(text, [vertex; 2], [axis, at.map(|x| -x / 2.0)], at, 2.0)
}

/// A quarter of a horn torus between two discs that touch its axis, in the octants where x and y are positive.
pub(crate) fn horn_bend() -> String {
    let mut text = StepText::in_millimeters();
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
    check(
        "bend of a horn torus",
        horn_bend(),
        &[(2, Plane), (1, Torus)],
        [2, 3],
        area,
        4.0 * PI * PI,
    );
}

#[test]
fn a_cap_on_the_inner_sheet_of_a_torus() {
    // The sheet of a negative major radius, in a file that writes the radius as positive.
    let mut text = StepText::in_millimeters();
    let (reach, height): (f64, f64) = (3.0, 24_f64.sqrt());
    let vertex = text.vertex([reach - 1.0, 0.0, height]);
    let rim = circle_edge(
        &mut text,
        [vertex; 2],
        [UP, X],
        [0.0, 0.0, height],
        reach - 1.0,
    );
    let axes = text.axes([0.0; 3], UP, X);
    let torus = text.add(format!(
        "TOROIDAL_SURFACE('',#{axes},1.,{:?})",
        (reach * reach + height * height).sqrt()
    ));
    let face = text.face(torus, ".F.", &[(rim, ".T.")]);
    // 2π∫ρ ds along the meridian from the rim to the tip, with ρ = r·cos t − 1.
    let minor = (reach * reach + height * height).sqrt();
    let [from, to] = [(reach / minor).acos(), (1.0 / minor).acos()];
    let area = TAU * minor * (minor * (to.sin() - from.sin()) - (to - from));
    check_open(
        "cap on the inner sheet of a torus",
        open(text, &[face]),
        &[(1, Torus)],
        [0, 1],
        area,
    );
}

#[test]
fn poles_inside_and_on_the_boundary() {
    let mut text = StepText::in_millimeters();
    let radius = 5.0 * 3_f64.sqrt();
    let vertex = text.vertex([radius, 0.0, 5.0]);
    let rim = circle_edge(&mut text, [vertex; 2], [UP, X], [0.0, 0.0, 5.0], radius);
    let axes = text.axes([0.0; 3], UP, X);
    let sphere = text.add(format!("SPHERICAL_SURFACE('',#{axes},10.)"));
    let face = text.face(sphere, ".T.", &[(rim, ".T.")]);
    check_open(
        "pole inside",
        open(text, &[face]),
        &[(1, Sphere)],
        [0, 1],
        100.0 * PI,
    );

    let mut text = StepText::in_millimeters();
    let y = [0.0, 1.0, 0.0];
    let vertices = [X, y, UP].map(|at| text.vertex(at.map(|x| 10.0 * x)));
    let arcs = [(0, 1, UP, X), (1, 2, X, y), (2, 0, y, UP)].map(|(i, j, z, x)| {
        (
            circle_edge(
                &mut text,
                [vertices[i], vertices[j]],
                [z, x],
                [0.0; 3],
                10.0,
            ),
            ".T.",
        )
    });
    let axes = text.axes([0.0; 3], UP, X);
    let sphere = text.add(format!("SPHERICAL_SURFACE('',#{axes},10.)"));
    let face = text.face(sphere, ".T.", &arcs);
    check_open(
        "pole on the boundary",
        open(text, &[face]),
        &[(1, Sphere)],
        [0, 1],
        50.0 * PI,
    );
}

/// A helix of radius 10 around z as a polygon with many corners. It begins at this height and rises by 5 per turn.
fn helix(text: &mut StepText, [from, to]: [usize; 2], foot: f64, n_turns: usize) -> usize {
    let n = 256 * n_turns;
    let poles: Vec<usize> = (0..=n)
        .map(|i| {
            let angle = TAU * i as f64 / 256.0;
            text.point([
                10.0 * angle.cos(),
                10.0 * angle.sin(),
                foot + 5.0 * i as f64 / 256.0,
            ])
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
    let mut text = StepText::in_millimeters();
    let axes = text.axes([0.0; 3], UP, X);
    let side = text.add(format!("CYLINDRICAL_SURFACE('',#{axes},10.)"));
    let corners = [0.0, 10.0, 12.0, 2.0].map(|z| [10.0, 0.0, z]);
    let vertices = corners.map(|at| text.vertex(at));
    let low = helix(&mut text, [vertices[0], vertices[1]], 0.0, 2);
    let high = helix(&mut text, [vertices[3], vertices[2]], 2.0, 2);
    let ends = [[1, 2], [3, 0]]
        .map(|ends| text.straight_edge(ends.map(|i| vertices[i]), ends.map(|i| corners[i])));
    let face = text.face(
        side,
        ".T.",
        &[
            (low, ".T."),
            (ends[0], ".T."),
            (high, ".F."),
            (ends[1], ".T."),
        ],
    );
    check_open(
        "helical band of two turns",
        open(text, &[face]),
        &[(1, Cylinder)],
        [0, 1],
        80.0 * PI,
    );

    let mut text = StepText::in_millimeters();
    let axes = text.axes([0.0; 3], UP, X);
    let side = text.add(format!("CYLINDRICAL_SURFACE('',#{axes},10.)"));
    let corners = [0.0, 5.0, 10.0].map(|z| [10.0, 0.0, z]);
    let vertices = corners.map(|at| text.vertex(at));
    let rim = circle_edge(&mut text, [vertices[0]; 2], [UP, X], [0.0; 3], 10.0);
    let thread = helix(&mut text, [vertices[1], vertices[2]], 5.0, 1);
    let step = text.straight_edge([vertices[2], vertices[1]], [corners[2], corners[1]]);
    let seam = text.straight_edge([vertices[0], vertices[1]], [corners[0], corners[1]]);
    let walk = [
        (rim, ".T."),
        (seam, ".T."),
        (step, ".F."),
        (thread, ".F."),
        (seam, ".F."),
    ];
    let face = text.face(side, ".T.", &walk);
    check_open(
        "one winding thread above a rim",
        open(text, &[face]),
        &[(1, Cylinder)],
        [0, 1],
        150.0 * PI,
    );

    // This boundary is not closed, so the face ends at a straight line across the parameter plane.
    let mut text = StepText::in_millimeters();
    let axes = text.axes([0.0; 3], UP, X);
    let side = text.add(format!("CYLINDRICAL_SURFACE('',#{axes},10.)"));
    let corners = [0.0, 5.0].map(|z| [10.0, 0.0, z]);
    let vertices = corners.map(|at| text.vertex(at));
    let thread = helix(&mut text, vertices, 0.0, 1);
    let step = text.straight_edge(vertices, corners);
    let face = text.face(side, ".T.", &[(step, ".T."), (thread, ".F.")]);
    check_open(
        "one winding loop alone",
        open(text, &[face]),
        &[(1, Cylinder)],
        [0, 1],
        50.0 * PI,
    );
}

/// How a file writes the circle that is revolved into a sphere.
#[derive(Clone, Copy, Debug)]
enum Meridian {
    /// The whole circle, from the equator or from the lower pole.
    Whole { from_pole: bool },
    /// Half of it, from the lower pole to the upper one.
    Half,
    /// The other half, from the upper pole to the lower one, or the same half against the circle.
    FallingHalf { is_backward: bool },
}

impl Meridian {
    /// The curve, and whether the normal of the revolved curve points away from the center.
    fn curve(self, text: &mut StepText, radius: f64) -> (usize, bool) {
        let begins_at = if matches!(self, Self::Whole { from_pole: false }) {
            X
        } else {
            [0.0, 0.0, -1.0]
        };
        let axes = text.axes([0.0; 3], [0.0, -1.0, 0.0], begins_at);
        let circle = text.add(format!("CIRCLE('',#{axes},{radius:?})"));
        let mut trimmed = |from: f64, to: f64, sense: &str| {
            let ends = [from, to]
                .map(|end| format!("(PARAMETER_VALUE({end:?}))"))
                .join(",");
            text.add(format!(
                "TRIMMED_CURVE('',#{circle},{ends},{sense},.PARAMETER.)"
            ))
        };
        match self {
            Self::Whole { .. } => (circle, true),
            Self::Half => (trimmed(0.0, PI, ".T."), true),
            Self::FallingHalf { is_backward: false } => (trimmed(PI, TAU, ".T."), false),
            Self::FallingHalf { is_backward: true } => (trimmed(PI, 0.0, ".F."), false),
        }
    }
}

/// An eighth of a sphere, between the equator and two meridians that meet at a pole.
fn octant(meridian: Meridian, direction: f64, is_upper: bool) -> Vec<u8> {
    const RADIUS: f64 = 2.0;
    let mut text = StepText::in_millimeters();
    let (curve, is_outward) = meridian.curve(&mut text, RADIUS);
    let (origin, along) = (text.point([0.0; 3]), text.direction([0.0, 0.0, direction]));
    let axis = text.add(format!("AXIS1_PLACEMENT('',#{origin},#{along})"));
    let surface = text.add(format!("SURFACE_OF_REVOLUTION('',#{curve},#{axis})"));

    let side = if is_upper { 1.0 } else { -1.0 };
    let (y, pole) = ([0.0, 1.0, 0.0], [0.0, 0.0, side]);
    let [a, b, c] = [X, y, pole].map(|at| text.vertex(at.map(|x| RADIUS * x)));
    let edges = [
        circle_edge(&mut text, [a, b], [UP, X], [0.0; 3], RADIUS),
        circle_edge(&mut text, [b, c], [[side, 0.0, 0.0], y], [0.0; 3], RADIUS),
        circle_edge(
            &mut text,
            [c, a],
            [[0.0, side, 0.0], pole],
            [0.0; 3],
            RADIUS,
        ),
    ];
    // Counter-clockwise seen from outside above the equator. If the surface's normal points inward, the face reverses it.
    let mut walk = edges.map(|edge| (edge, if is_upper { ".T." } else { ".F." }));
    if !is_upper {
        walk.reverse();
    }
    // If the axis points downward, the direction of revolution is reversed, and so is the normal.
    let is_natural = is_outward == (direction > 0.0);
    let face = text.face(surface, if is_natural { ".T." } else { ".F." }, &walk);
    open(text, &[face])
}

#[test]
fn spheres_of_revolution_reach_their_poles() {
    let meridians = [
        Meridian::Whole { from_pole: false },
        Meridian::Whole { from_pole: true },
        Meridian::Half,
        Meridian::FallingHalf { is_backward: false },
        Meridian::FallingHalf { is_backward: true },
    ];
    for meridian in meridians {
        for (axis, is_upper) in [(1.0, true), (1.0, false), (-1.0, true), (-1.0, false)] {
            let name = format!("octant of {meridian:?} about {axis}, upper: {is_upper}");
            check_open(
                &name,
                octant(meridian, axis, is_upper),
                &[(1, Revolution)],
                [0, 1],
                2.0 * PI,
            );
        }
    }
}

#[test]
fn thin_lunes_from_pole_to_pole() {
    let radius = 10.0;
    for width in [1e-5_f64, 1e-4, 1e-3, 0.02, 0.2, 1.0] {
        let mut text = StepText::in_millimeters();
        let (down, up) = ([0.0, 0.0, -1.0], [0.0, 0.0, radius]);
        let poles = [[0.0, 0.0, -radius], up].map(|at| text.vertex(at));
        let meridian = |text: &mut StepText, angle: f64| {
            circle_edge(
                text,
                poles,
                [[angle.sin(), -angle.cos(), 0.0], down],
                [0.0; 3],
                radius,
            )
        };
        let (first, second) = (meridian(&mut text, 0.0), meridian(&mut text, width));
        let axes = text.axes([0.0; 3], UP, X);
        let surface = text.add(format!("SPHERICAL_SURFACE('',#{axes},{radius:?})"));
        let face = text.face(surface, ".T.", &[(second, ".T."), (first, ".F.")]);
        let area = 2.0 * radius * radius * width;
        let shape = check_faces(
            &format!("lune of {width} rad"),
            open(text, &[face]),
            &[(1, Sphere)],
            [0, 1],
            area,
        );
        let mesh: f64 = shape.mesh.triangle_areas().iter().sum();
        assert!(
            (mesh - area).abs() <= 0.05 * area,
            "lune of {width} rad: mesh {mesh}, expected {area}"
        );
    }
}

#[test]
fn whole_ellipses_about_their_own_axis_cover_it_once() {
    // The areas are those of spheroids with these half axes across and along the axis.
    for ([across, along], area) in [([2.0, 3.0], 67.673), ([3.0, 1.0], 68.296)] {
        for from_pole in [false, true] {
            let mut text = StepText::in_millimeters();
            let (outward, [first, second]) = if from_pole {
                ([0.0, 0.0, -1.0], [along, across])
            } else {
                (X, [across, along])
            };
            let axes = text.axes([0.0; 3], [0.0, -1.0, 0.0], outward);
            let ellipse = text.add(format!("ELLIPSE('',#{axes},{first:?},{second:?})"));
            let (origin, up) = (text.point([0.0; 3]), text.direction(UP));
            let axis = text.add(format!("AXIS1_PLACEMENT('',#{origin},#{up})"));
            let surface = text.add(format!("SURFACE_OF_REVOLUTION('',#{ellipse},#{axis})"));
            let [low, high] = [-along, along].map(|z| text.vertex([0.0, 0.0, z]));
            let seam = text.add(format!("EDGE_CURVE('',#{low},#{high},#{ellipse},.T.)"));
            let face = text.face(surface, ".T.", &[(seam, ".T."), (seam, ".F.")]);
            text.solid(&[face]);
            let volume = 4.0 / 3.0 * PI * across * across * along;
            check(
                "spheroid",
                text.bytes(),
                &[(1, Revolution)],
                [0, 1],
                area,
                volume,
            );
        }
    }
}
