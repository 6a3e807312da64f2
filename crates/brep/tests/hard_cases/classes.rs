//! Tests curves and surfaces of every class as edges and faces, and edges that have no curve in space.

use super::files::mirrored;
use super::*;
use FaceType::{Bspline, Cylinder, Extrusion, Offset, Other, Plane, Sphere};
use fixtures::{cuboid, cylinder};
use std::f64::consts::{PI, TAU};

const DOWN: Point = [0.0, 0.0, -1.0];
const Y: Point = [0.0, 1.0, 0.0];
const HEIGHT: f64 = 2.0;

/// A prism over the region between a curve from its first to its last point and their chord: bottom, top, the wall of the
/// extruded curve, and the wall of the chord. `curve` writes the curve at a height.
fn prism(
    curve: impl Fn(&mut StepText, f64) -> usize,
    runs_along: bool,
    [from, to]: [[f64; 2]; 2],
) -> Vec<u8> {
    let mut text = StepText::in_millimeters();
    let corners = [from, to].map(|[x, y]| [0.0, HEIGHT].map(|z| [x, y, z]));
    let [[a, b], [c, d]] = corners;
    let [[va, vb], [vc, vd]] = corners.map(|pair| pair.map(|at| text.vertex(at)));
    let sense = if runs_along { ".T." } else { ".F." };
    let curves = [0.0, HEIGHT].map(|z| curve(&mut text, z));
    let low = text.add(format!("EDGE_CURVE('',#{va},#{vc},#{},{sense})", curves[0]));
    let high = text.add(format!("EDGE_CURVE('',#{vb},#{vd},#{},{sense})", curves[1]));
    let chords = [
        text.straight_edge([vc, va], [c, a]),
        text.straight_edge([vd, vb], [d, b]),
    ];
    let posts = [
        text.straight_edge([va, vb], [a, b]),
        text.straight_edge([vc, vd], [c, d]),
    ];
    let planes = [
        ([0.0; 3], DOWN),
        ([0.0, 0.0, HEIGHT], UP),
        (a, [from[1] - to[1], to[0] - from[0], 0.0]),
    ];
    let planes = planes.map(|(at, normal)| {
        let axes = text.axes(at, normal, partprobe_shape::cross(normal, [0.3, 0.7, 0.2]));
        text.add(format!("PLANE('',#{axes})"))
    });
    let up = text.direction(UP);
    let up = text.add(format!("VECTOR('',#{up},1.)"));
    let wall = text.add(format!(
        "SURFACE_OF_LINEAR_EXTRUSION('',#{},#{up})",
        curves[0]
    ));
    let faces = [
        text.face(planes[0], ".T.", &[(chords[0], ".F."), (low, ".F.")]),
        text.face(planes[1], ".T.", &[(high, ".T."), (chords[1], ".T.")]),
        text.face(
            wall,
            sense,
            &[
                (low, ".T."),
                (posts[1], ".T."),
                (high, ".F."),
                (posts[0], ".F."),
            ],
        ),
        text.face(
            planes[2],
            ".T.",
            &[
                (chords[0], ".T."),
                (posts[0], ".T."),
                (chords[1], ".F."),
                (posts[1], ".F."),
            ],
        ),
    ];
    text.solid(&faces);
    text.bytes()
}

/// Checks a prism against the curve's formula, which returns the point at a fraction of the curve.
#[track_caller]
fn check_prism(
    name: &str,
    curve: impl Fn(&mut StepText, f64) -> usize,
    runs_along: bool,
    formula: impl Fn(f64) -> [f64; 2],
) {
    const N: usize = 6000;
    let places: Vec<[f64; 2]> = (0..=N).map(|i| formula(i as f64 / N as f64)).collect();
    let ends = [places[0], places[N]];
    let side = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]).hypot(b[1] - a[1]);
    let length: f64 = places.windows(2).map(|pair| side(pair[0], pair[1])).sum();
    let next = places.iter().cycle().skip(1);
    let base: f64 = places
        .iter()
        .zip(next)
        .map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0]))
        .sum();
    let area = 2.0 * base + HEIGHT * (length + side(ends[1], ends[0]));
    let text = prism(curve, runs_along, ends);
    check(
        name,
        &text,
        &[(3, Plane), (1, Extrusion)],
        [6, 4],
        area,
        HEIGHT * base,
    );
    let text = mirrored(&String::from_utf8(text).unwrap());
    check(
        &format!("{name} in a mirror"),
        text,
        &[(3, Plane), (1, Extrusion)],
        [6, 4],
        area,
        HEIGHT * base,
    );
}

/// A conic whose first axis is y and whose second axis is x, or −x for the opposite direction.
fn conic(text: &mut StepText, entity: &str, [x, y, z]: Point, axis: Point) -> usize {
    let axes = text.axes([x, y, z], axis, Y);
    text.add(entity.replace('@', &format!("#{axes}")))
}

fn line(text: &mut StepText, from: Point, direction: Point) -> usize {
    let (origin, direction) = (text.point(from), text.direction(direction));
    let vector = text.add(format!("VECTOR('',#{direction},1.)"));
    text.add(format!("LINE('',#{origin},#{vector})"))
}

fn trimmed(text: &mut StepText, basis: usize, from: f64, to: f64, sense: &str) -> usize {
    text.add(format!(
        "TRIMMED_CURVE('',#{basis},(PARAMETER_VALUE({from:?})),(PARAMETER_VALUE({to:?})),{sense},.PARAMETER.)"
    ))
}

#[test]
fn conics_of_every_class_bound_and_sweep() {
    let sine = |t: f64| (1.0 - 2.0 * t) * PI / 2.0;
    check_prism(
        "parabola",
        |text, z| conic(text, "PARABOLA('',@,1.)", [0.0, 0.0, z], DOWN),
        true,
        |t| [4.0 * t - 2.0, (2.0 * t - 1.0).powi(2)],
    );
    check_prism(
        "parabola against its edge",
        |text, z| conic(text, "PARABOLA('',@,1.)", [0.0, 0.0, z], UP),
        false,
        |t| [4.0 * t - 2.0, (2.0 * t - 1.0).powi(2)],
    );
    check_prism(
        "hyperbola",
        |text, z| conic(text, "HYPERBOLA('',@,1.,2.)", [0.0, 0.0, z], DOWN),
        true,
        |t| [2.0 * (2.0 * t - 1.0).sinh(), (2.0 * t - 1.0).cosh()],
    );
    check_prism(
        "ellipse",
        |text, z| conic(text, "ELLIPSE('',@,1.,3.)", [0.0, 0.0, z], UP),
        true,
        |t| [-3.0 * sine(t).sin(), -sine(t).cos()],
    );
}

#[test]
fn curves_made_of_curves_bound_and_sweep() {
    check_prism(
        "polyline",
        |text, z| {
            let points = [[-2.0, 1.0], [-1.0, 0.0], [1.0, 0.0], [2.0, 1.0]]
                .map(|[x, y]| text.point([x, y, z]));
            text.add(format!("POLYLINE('',({}))", references(&points)))
        },
        true,
        |t| {
            [
                (-2.0 + 4.0 * t),
                (2.0 * (2.0 * t - 1.0).abs() - 1.0).max(0.0),
            ]
        },
    );
    let half_circle = |t: f64| [-(PI * t).cos(), -(PI * t).sin()];
    check_prism(
        "trimmed circle",
        |text, z| {
            let circle = conic(text, "CIRCLE('',@,1.)", [0.0, 0.0, z], UP);
            trimmed(text, circle, PI / 2.0, 1.5 * PI, ".T.")
        },
        true,
        half_circle,
    );
    check_prism(
        "trimmed circle against its basis",
        |text, z| {
            let circle = conic(text, "CIRCLE('',@,1.)", [0.0, 0.0, z], DOWN);
            trimmed(text, circle, 1.5 * PI, PI / 2.0, ".F.")
        },
        true,
        half_circle,
    );
    check_prism(
        "composite",
        |text, z| {
            let [first, last] = [
                line(text, [-2.0, 1.0, z], [1.0, -1.0, 0.0]),
                line(text, [2.0, 1.0, z], [-1.0, -1.0, 0.0]),
            ];
            let circle = conic(text, "CIRCLE('',@,1.)", [0.0, 0.0, z], UP);
            let pieces = [
                (trimmed(text, first, 0.0, 2_f64.sqrt(), ".T."), ".T."),
                (trimmed(text, circle, PI / 2.0, 1.5 * PI, ".T."), ".T."),
                (trimmed(text, last, 0.0, 2_f64.sqrt(), ".T."), ".F."),
            ];
            let pieces = pieces.map(|(curve, sense)| {
                text.add(format!(
                    "COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,{sense},#{curve})"
                ))
            });
            text.add(format!("COMPOSITE_CURVE('',({}),.F.)", references(&pieces)))
        },
        true,
        |t| match 3.0 * t {
            t if t < 1.0 => [t - 2.0, 1.0 - t],
            t if t < 2.0 => half_circle(t - 1.0),
            t => [t - 1.0, t - 2.0],
        },
    );
    // Seen along the reference direction, an offset lies on the left of its basis.
    check_prism(
        "offset",
        |text, z| {
            let circle = conic(text, "CIRCLE('',@,3.)", [0.0, 0.0, z], UP);
            let up = text.direction(UP);
            text.add(format!("OFFSET_CURVE_3D('',#{circle},2.,.F.,#{up})"))
        },
        true,
        half_circle,
    );
}

/// A cylinder of radius 2 and height 3 whose wall is another entity. `@` is replaced by the original surface of the wall.
fn cylinder_with_wall(entities: &str) -> String {
    let text = String::from_utf8(cylinder(2.0, 3.0).bytes()).unwrap();
    let start = text.find("CYLINDRICAL_SURFACE").unwrap();
    let id = text[..start].rfind('#').unwrap();
    let (number, end) = (
        &text[id..start - 1],
        start + text[start..].find(";\n").unwrap() + 2,
    );
    let own = format!("#7001={}", &text[start..end]);
    let entities = entities.replace('@', "#7001").replacen("WALL", number, 1);
    format!("{}{own}{entities}{}", &text[..id], &text[end..])
}

/// Half of the cylinder's wall as a rational B-spline with two rows of poles. `half` chooses the half.
fn half_wall(first: usize, half: i32) -> String {
    let around = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0]].map(|[x, y]| [half * x, half * y]);
    let mut points = String::new();
    let rows = (0..).zip(around).map(|(i, [x, y])| {
        let ids = [first + 1 + 2 * i, first + 2 + 2 * i];
        for (id, z) in ids.iter().zip([0.0, 3.0]) {
            points += &format!(
                "#{id}=CARTESIAN_POINT('',({:?},{:?},{z:?}));\n",
                2 * x,
                2 * y
            );
        }
        format!("({})", references(&ids))
    });
    let rows = rows.collect::<Vec<_>>().join(",");
    let weights = around.map(|[x, y]| {
        if x * y == 0 {
            "(1.,1.)"
        } else {
            "(0.7071067811865476,0.7071067811865476)"
        }
    });
    format!(
        "{points}#{first}=(BOUNDED_SURFACE()B_SPLINE_SURFACE(2,1,({rows}),.U.,.F.,.F.,.F.)B_SPLINE_SURFACE_WITH_KNOTS((3,2,3),\
         (2,2),(0.,1.,2.),(0.,1.),.U.)GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_SURFACE(({}))REPRESENTATION_ITEM('')\
         SURFACE());\n",
        weights.join(",")
    )
}

fn patches(senses: [[&str; 2]; 2], parents: [usize; 2]) -> String {
    let patch = |i: usize| {
        let [u, v] = senses[i];
        format!(
            "#{}=SURFACE_PATCH(#{},.CONTINUOUS.,.CONTINUOUS.,{u},{v});\n",
            7100 + i,
            parents[i]
        )
    };
    format!(
        "{}{}WALL=RECTANGULAR_COMPOSITE_SURFACE('',((#7100),(#7101)));\n",
        patch(0),
        patch(1)
    )
}

#[test]
fn surfaces_that_bound_or_move_others() {
    let walls = [
        (
            "rectangular trimmed surface",
            "WALL=RECTANGULAR_TRIMMED_SURFACE('',@,0.,6.3,0.,3.,.T.,.T.);\n",
            Cylinder,
        ),
        (
            "curve-bounded surface",
            "WALL=CURVE_BOUNDED_SURFACE('',@,(),.T.);\n",
            Cylinder,
        ),
        (
            "offset surface of an offset surface",
            "#7002=OFFSET_SURFACE('',@,1.5,.F.);\nWALL=OFFSET_SURFACE('',#7002,-1.5,.F.);\n",
            Offset,
        ),
    ];
    for (name, entities, face_type) in walls {
        let text = cylinder_with_wall(entities);
        check(
            name,
            &text,
            &[(2, Plane), (1, face_type)],
            [2, 3],
            20.0 * PI,
            12.0 * PI,
        );
        check(
            name,
            mirrored(&text),
            &[(2, Plane), (1, face_type)],
            [2, 3],
            20.0 * PI,
            12.0 * PI,
        );
    }
}

#[test]
fn surfaces_of_patches() {
    let halves = "#7010=RECTANGULAR_TRIMMED_SURFACE('',@,0.,3.141592653589793,0.,3.,.T.,.T.);\n\
                  #7011=RECTANGULAR_TRIMMED_SURFACE('',@,3.141592653589793,0.,0.,3.,.T.,.T.);\n";
    let splines = half_wall(7010, 1) + &half_wall(7040, -1);
    let (along, against) = ([".T.", ".T."], [".F.", ".F."]);
    let cases = [
        (
            "patches of one cylinder",
            halves.to_owned() + &patches([along, along], [7010, 7011]),
            Cylinder,
        ),
        (
            "patches of splines",
            splines.clone() + &patches([along, along], [7010, 7040]),
            Bspline,
        ),
        (
            "patches backwards",
            splines + &patches([against, against], [7040, 7010]),
            Bspline,
        ),
        (
            "patches of a spline and a cylinder",
            half_wall(7040, 1) + halves + &patches([along, along], [7040, 7011]),
            Other,
        ),
    ];
    for (name, entities, face_type) in cases {
        let text = cylinder_with_wall(&entities);
        check(
            name,
            &text,
            &[(2, Plane), (1, face_type)],
            [2, 3],
            20.0 * PI,
            12.0 * PI,
        );
        check(
            name,
            mirrored(&text),
            &[(2, Plane), (1, face_type)],
            [2, 3],
            20.0 * PI,
            12.0 * PI,
        );
    }
}

#[test]
fn a_face_on_one_patch_of_several() {
    // The lower half of the roof is the top of a cube. The other half is inclined.
    let mut text = cuboid([10.0; 3]);
    let plane = |text: &mut StepText, at: Point, normal: Point| {
        let axes = text.axes(at, normal, Y);
        let plane = text.add(format!("PLANE('',#{axes})"));
        let patch = text.add(format!(
            "RECTANGULAR_TRIMMED_SURFACE('',#{plane},-20.,20.,-30.,0.,.T.,.T.)"
        ));
        text.add(format!(
            "SURFACE_PATCH(#{patch},.CONTINUOUS.,.CONTINUOUS.,.T.,.T.)"
        ))
    };
    // The first parameter runs along y, and the second one toward −x, so the inclined half comes last.
    let level = plane(&mut text, [-5.0, 0.0, 10.0], UP);
    let leaning = plane(&mut text, [-5.0, 0.0, 10.0], [-1.0, 0.0, 1.0]);
    let composite = text.add(format!(
        "RECTANGULAR_COMPOSITE_SURFACE('',((#{level},#{leaning})))"
    ));
    let text = String::from_utf8(text.bytes()).unwrap();
    let face = text.match_indices("ADVANCED_FACE").nth(1).unwrap().0;
    let end = face + text[face..].find(';').unwrap();
    let surface = face + text[face..end].rfind('#').unwrap();
    let text = format!("{}#{composite},.T.){}", &text[..surface], &text[end..]);
    check(
        "one patch of several",
        text,
        &[(6, Plane)],
        [12, 6],
        600.0,
        1000.0,
    );
}

/// A cylinder of radius 2 and height 3 whose wall and rims are cut in two. `write` writes the curve of an edge from its ends in
/// the parameters of the wall. (The angle is multiplied by the radius, so both parameters are lengths.)
fn halved_cylinder(write: impl Fn(&mut StepText, usize, [[f64; 2]; 2]) -> String) -> Vec<u8> {
    let mut text = StepText::in_millimeters();
    let axes = text.axes([0.0; 3], UP, X);
    let wall = text.add(format!("CYLINDRICAL_SURFACE('',#{axes},2.)"));
    let vertices =
        [[2.0, 0.0], [-2.0, 0.0]].map(|[x, y]| [0.0, 3.0].map(|z| text.vertex([x, y, z])));
    let edge = |text: &mut StepText, [from, to]: [[usize; 2]; 2], ends: [[f64; 2]; 2]| {
        let curve = write(text, wall, ends);
        let [from, to] = [from, to].map(|[i, j]| vertices[i][j]);
        text.add(format!("EDGE_CURVE('',#{from},#{to},{curve},.T.)"))
    };
    let posts = [0, 1].map(|i| {
        edge(
            &mut text,
            [[i, 0], [i, 1]],
            [[i as f64 * PI, 0.0], [i as f64 * PI, 3.0]],
        )
    });
    let mut arc = |i: usize, j: usize| {
        let (from, height) = (i as f64 * PI, 3.0 * j as f64);
        edge(
            &mut text,
            [[i, j], [1 - i, j]],
            [[from, height], [from + PI, height]],
        )
    };
    let arcs = [[arc(0, 0), arc(0, 1)], [arc(1, 0), arc(1, 1)]];
    let planes = [(0.0, DOWN), (3.0, UP)].map(|(z, normal)| {
        let axes = text.axes([0.0, 0.0, z], normal, X);
        text.add(format!("PLANE('',#{axes})"))
    });
    let halves = [0, 1].map(|i| {
        let walk = [
            (arcs[i][0], ".T."),
            (posts[1 - i], ".T."),
            (arcs[i][1], ".F."),
            (posts[i], ".F."),
        ];
        text.face(wall, ".T.", &walk)
    });
    let ends = [
        text.face(
            planes[0],
            ".T.",
            &[(arcs[1][0], ".F."), (arcs[0][0], ".F.")],
        ),
        text.face(
            planes[1],
            ".T.",
            &[(arcs[0][1], ".T."), (arcs[1][1], ".T.")],
        ),
    ];
    text.solid(&[halves[0], halves[1], ends[0], ends[1]]);
    text.bytes()
}

/// A straight `PCURVE` between two points of a surface's parameter plane.
fn pcurve(text: &mut StepText, surface: usize, [from, to]: [[f64; 2]; 2]) -> usize {
    let origin = text.add(format!("CARTESIAN_POINT('',({:?},{:?}))", from[0], from[1]));
    let direction = text.add(format!(
        "DIRECTION('',({:?},{:?}))",
        to[0] - from[0],
        to[1] - from[1]
    ));
    let vector = text.add(format!("VECTOR('',#{direction},1.)"));
    let line = text.add(format!("LINE('',#{origin},#{vector})"));
    let context = text
        .add("(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()REPRESENTATION_CONTEXT('',''))");
    let representation = text.add(format!(
        "DEFINITIONAL_REPRESENTATION('',(#{line}),#{context})"
    ));
    text.add(format!("PCURVE('',#{surface},#{representation})"))
}

#[test]
fn edges_that_have_parameter_curves_only() {
    let types = [(2, Plane), (2, Cylinder)];
    type Write = fn(&mut StepText, usize, [[f64; 2]; 2]) -> String;
    let writers: [(&str, Write); 3] = [
        ("pcurve as edge geometry", |text, wall, ends| {
            format!("#{}", pcurve(text, wall, ends))
        }),
        (
            "surface curve without a curve of space",
            |text, wall, ends| {
                let pcurve = pcurve(text, wall, ends);
                format!(
                    "#{}",
                    text.add(format!("SURFACE_CURVE('',$,(#{pcurve}),.PCURVE_S1.)"))
                )
            },
        ),
        (
            "surface curve whose curve of space is missing",
            |text, wall, ends| {
                let pcurve = pcurve(text, wall, ends);
                format!(
                    "#{}",
                    text.add(format!(
                        "SEAM_CURVE('',#99999,(#{wall},#{pcurve}),.PCURVE_S1.)"
                    ))
                )
            },
        ),
    ];
    for (name, write) in writers {
        let text = halved_cylinder(write);
        check(name, &text, &types, [6, 3], 20.0 * PI, 12.0 * PI);
        let text = mirrored(&String::from_utf8(text).unwrap());
        check(
            &format!("{name}, in a mirror"),
            text,
            &types,
            [6, 3],
            20.0 * PI,
            12.0 * PI,
        );
    }
}

#[test]
fn parameter_curves_that_go_round() {
    // A helical band of two turns between two straight lines of the parameter plane.
    let mut text = StepText::in_millimeters();
    let axes = text.axes([0.0; 3], UP, X);
    let wall = text.add(format!("CYLINDRICAL_SURFACE('',#{axes},10.)"));
    let corners = [[0.0, 0.0], [2.0 * TAU, 10.0], [2.0 * TAU, 12.0], [0.0, 2.0]];
    let vertices = corners.map(|[u, v]| text.vertex([10.0 * u.cos(), 10.0 * u.sin(), v]));
    let walk = [0, 1, 2, 3].map(|i| {
        let j = (i + 1) % 4;
        let curve = pcurve(&mut text, wall, [corners[i], corners[j]]);
        (
            text.add(format!(
                "EDGE_CURVE('',#{},#{},#{curve},.T.)",
                vertices[i], vertices[j]
            )),
            ".T.",
        )
    });
    let face = text.face(wall, ".T.", &walk);
    check_open(
        "helical band of parameter curves",
        open(text, &[face]),
        &[(1, Cylinder)],
        [0, 1],
        80.0 * PI,
    );

    // Both rims of a wall are whole circles.
    let mut text = StepText::in_millimeters();
    let axes = text.axes([0.0; 3], UP, X);
    let wall = text.add(format!("CYLINDRICAL_SURFACE('',#{axes},2.)"));
    let rims = [0.0, 3.0].map(|z| {
        let vertex = text.vertex([2.0, 0.0, z]);
        let curve = pcurve(&mut text, wall, [[0.0, z], [TAU, z]]);
        text.add(format!("EDGE_CURVE('',#{vertex},#{vertex},#{curve},.T.)"))
    });
    let bounds = [(rims[0], ".T."), (rims[1], ".F.")].map(|(rim, flag)| {
        let rim = text.add(format!("ORIENTED_EDGE('',*,*,#{rim},{flag})"));
        let rim = text.add(format!("EDGE_LOOP('',(#{rim}))"));
        text.add(format!("FACE_BOUND('',#{rim},.T.)"))
    });
    let face = text.add(format!(
        "ADVANCED_FACE('',({}),#{wall},.T.)",
        references(&bounds)
    ));
    check_open(
        "rims of parameter curves",
        open(text, &[face]),
        &[(1, Cylinder)],
        [0, 1],
        12.0 * PI,
    );
}

#[test]
fn edges_without_a_curve_are_straight_or_lost_by_name() {
    let text = String::from_utf8(cuboid([10.0; 3]).bytes()).unwrap();
    let without = |text: &str, rewrite: &dyn Fn(&str) -> String| -> String {
        let line = |line: &str| match line.split_once("=EDGE_CURVE(") {
            Some((id, attributes)) => format!("{id}={}\n", rewrite(attributes)),
            None => format!("{line}\n"),
        };
        text.lines().map(line).collect()
    };
    let vertices = |attributes: &str| {
        attributes
            .split(',')
            .skip(1)
            .take(2)
            .collect::<Vec<_>>()
            .join(",")
    };
    let as_edge = without(&text, &|attributes| {
        format!("EDGE('',{});", vertices(attributes))
    });
    check(
        "edges of vertices alone",
        as_edge,
        &[(6, Plane)],
        [12, 6],
        600.0,
        1000.0,
    );
    let as_curve = without(&text, &|attributes| {
        format!("EDGE_CURVE('',{},$,.T.);", vertices(attributes))
    });
    check(
        "edges whose curve is left out",
        as_curve,
        &[(6, Plane)],
        [12, 6],
        600.0,
        1000.0,
    );

    let text = halved_cylinder(|_, _, _| "$".to_owned());
    let shape = shape_of("curved edges without a curve", &text);
    let walls = shape.lost.iter().filter(|loss| {
        loss.reason
            .ends_with("it has no curve, and a straight one would leave the surface")
    });
    assert_eq!(
        (walls.count(), shape.graph.faces.len()),
        (2, 2),
        "{:?}",
        shape.lost
    );
}

#[test]
fn faces_that_name_no_surface() {
    let text = String::from_utf8(cylinder(2.0, 3.0).bytes()).unwrap();
    let without = |class: &str| {
        let start = text.find(class).unwrap();
        let id = &text[text[..start].rfind('#').unwrap()..start - 1];
        text.replace(&format!(",{id},.F.);"), ",$,.F.);")
            .replace(&format!(",{id},.T.);"), ",$,.T.);")
    };
    check(
        "disc without a plane",
        without("PLANE"),
        &[(2, Plane), (1, Cylinder)],
        [2, 3],
        20.0 * PI,
        12.0 * PI,
    );
    let shape = shape_of(
        "wall without a cylinder",
        without("CYLINDRICAL_SURFACE").as_bytes(),
    );
    assert_eq!(shape.graph.faces.len(), 2);
    assert!(
        shape.lost[0]
            .reason
            .contains("its boundary lies in no plane"),
        "{:?}",
        shape.lost
    );
}

/// A geometric set of one surface.
fn set_of(entities: impl FnOnce(&mut StepText) -> usize) -> Vec<u8> {
    let mut text = StepText::in_millimeters();
    let surface = entities(&mut text);
    let set = text.add(format!("GEOMETRIC_SET('',(#{surface}))"));
    text.add(format!(
        "GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION('',(#{set}),#1)"
    ));
    text.bytes()
}

fn on_axes(text: &mut StepText, entity: &str) -> usize {
    let axes = text.axes([0.0; 3], UP, X);
    text.add(entity.replace('@', &format!("#{axes}")))
}

#[test]
fn rectangles_of_surfaces_without_topology() {
    let trimmed = |text: &mut StepText, entity: &str, ends: &str| {
        let basis = on_axes(text, entity);
        text.add(format!(
            "RECTANGULAR_TRIMMED_SURFACE('',#{basis},{ends},.T.,.T.)"
        ))
    };
    let cases = [
        (
            "rectangle of a plane",
            "PLANE('',@)",
            "-1.,2.,3.,5.",
            Plane,
            6.0,
        ),
        (
            "third of a cylinder",
            "CYLINDRICAL_SURFACE('',@,3.)",
            "5.,1.,0.,2.",
            Cylinder,
            6.0 * (TAU - 4.0),
        ),
        (
            "whole turn of a cylinder",
            "CYLINDRICAL_SURFACE('',@,3.)",
            "0.,6.283185307179586,0.,2.",
            Cylinder,
            12.0 * PI,
        ),
        (
            "octant of a sphere",
            "SPHERICAL_SURFACE('',@,2.)",
            "0.,1.5707963267948966,0.,1.5707963267948966",
            Sphere,
            2.0 * PI,
        ),
    ];
    for (name, entity, ends, face_type, area) in cases {
        check_open(
            name,
            set_of(|text| trimmed(text, entity, ends)),
            &[(1, face_type)],
            [0, 1],
            area,
        );
    }
    let ribbon = set_of(|text| {
        let halves = ["0.,1.,0.,2.", "1.,3.,0.,2."].map(|ends| {
            let half = trimmed(text, "CYLINDRICAL_SURFACE('',@,3.)", ends);
            text.add(format!(
                "SURFACE_PATCH(#{half},.CONTINUOUS.,.CONTINUOUS.,.T.,.T.)"
            ))
        });
        text.add(format!(
            "RECTANGULAR_COMPOSITE_SURFACE('',((#{}),(#{})))",
            halves[0], halves[1]
        ))
    });
    check_open(
        "ribbon of two patches",
        ribbon,
        &[(1, Cylinder)],
        [0, 1],
        18.0,
    );
}
