//! Tests faces whose flags give the wrong side: patches of surfaces that close in one direction only, holes whose bounds run like
//! outer ones, shells in any order. The surface, the triangles and the nesting decide what they bound.

use super::*;
use fixtures::{CUBE_POLYGONS, box_corners};
use partprobe_synth::{SynthSettings, part};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// A meridian: a Bézier curve whose points are distances from the axis and heights.
type Meridian = [[f64; 2]];

const OPEN: &Meridian = &[[5.0, 0.0], [7.0, 0.0], [9.0, 3.0], [10.0, 8.0]];
const DOME: &Meridian = &[[0.0, 0.0], [4.0, 0.0], [9.0, 3.0], [10.0, 8.0]];
const DOME_FROM_RIM: &Meridian = &[[10.0, 0.0], [9.0, 4.0], [4.0, 7.0], [0.0, 7.0]];
const WALL: &Meridian = &[[5.0, 1.0], [5.0, 4.0]];
const FUNNEL: &Meridian = &[[5.0, 0.0], [7.0, 3.0]];
const ANNULUS: &Meridian = &[[3.0, 2.0], [6.0, 2.0]];
const CONE: &Meridian = &[[5.0, 0.0], [0.0, 6.0]];
const DISC: &Meridian = &[[0.0, 2.0], [4.0, 2.0]];

/// How a file writes the surface of a revolved meridian.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Written {
    /// Revolved around the axis, or around the same axis pointing downward.
    Revolution { is_downward: bool },
    /// A rational spline that is closed in u or in v.
    Spline { is_transposed: bool },
    /// A cylinder, for a meridian parallel to the axis.
    Cylinder,
    /// The same cylinder as an extruded circle.
    Extrusion,
}

/// Which flags are wrong.
#[derive(Clone, Copy, Debug)]
struct Wrong {
    sense: bool,
    bound: bool,
    hole: bool,
}

fn place(meridian: &Meridian, t: f64) -> [f64; 2] {
    let mut row = meridian.to_vec();
    while row.len() > 1 {
        row = row
            .windows(2)
            .map(|pair| [0, 1].map(|i| pair[0][i] + t * (pair[1][i] - pair[0][i])))
            .collect();
    }
    row[0]
}

fn revolved([reach, height]: [f64; 2], angle: f64) -> Point {
    [reach * angle.cos(), reach * angle.sin(), height]
}

/// The area of one radian between two points of the meridian.
fn area_per_radian(meridian: &Meridian, [from, to]: [f64; 2]) -> f64 {
    let n = 500;
    let at = |i: f64| place(meridian, from + (to - from) * i / f64::from(n));
    let piece = |i: u32| {
        let (a, b) = (at(f64::from(i)), at(f64::from(i + 1)));
        at(f64::from(i) + 0.5)[0] * (b[0] - a[0]).hypot(b[1] - a[1])
    };
    (0..n).map(piece).sum()
}

fn flag(is_true: bool) -> &'static str {
    if is_true { ".T." } else { ".F." }
}

/// A face on a revolved meridian under construction.
struct RevolvedFace<'a> {
    text: StepText,
    meridian: &'a Meridian,
    vertices: BTreeMap<[i64; 3], usize>,
}

impl RevolvedFace<'_> {
    fn vertex(&mut self, t: f64, angle: f64) -> usize {
        let at = revolved(place(self.meridian, t), angle);
        let text = &mut self.text;
        *self
            .vertices
            .entry(at.map(|x| (1e6 * x).round() as i64))
            .or_insert_with(|| text.vertex(at))
    }

    fn meridian_curve(&mut self, angle: f64) -> usize {
        let poles: Vec<Point> = self
            .meridian
            .iter()
            .map(|&pole| revolved(pole, angle))
            .collect();
        if let [from, to] = poles[..] {
            let (origin, direction) = (
                self.text.point(from),
                self.text.direction(partprobe_shape::subtract(to, from)),
            );
            let length = partprobe_shape::distance(from, to);
            let vector = self.text.add(format!("VECTOR('',#{direction},{length:?})"));
            return self.text.add(format!("LINE('',#{origin},#{vector})"));
        }
        let n = poles.len();
        let poles: Vec<usize> = poles
            .into_iter()
            .map(|pole| self.text.point(pole))
            .collect();
        let poles = references(&poles);
        self.text.add(format!(
            "B_SPLINE_CURVE_WITH_KNOTS('',{},({poles}),.UNSPECIFIED.,.F.,.F.,({n},{n}),(0.,1.),.UNSPECIFIED.)",
            n - 1
        ))
    }

    /// An edge along the meridian. Both ends are one vertex if they are at the same point.
    fn upward(&mut self, angle: f64, [from, to]: [f64; 2]) -> usize {
        let curve = self.meridian_curve(angle);
        let ends = [self.vertex(from, angle), self.vertex(to, angle)];
        self.text.add(format!(
            "EDGE_CURVE('',#{},#{},#{curve},.T.)",
            ends[0], ends[1]
        ))
    }

    /// An edge along a circle. Returns `None` if the meridian meets the axis there.
    fn around(&mut self, t: f64, [from, to]: [f64; 2]) -> Option<usize> {
        let [reach, height] = place(self.meridian, t);
        let ends = [self.vertex(t, from), self.vertex(t, to)];
        (reach > 0.0).then(|| circle_edge(&mut self.text, ends, [UP, X], [0.0, 0.0, height], reach))
    }

    /// The bound of a rectangle of angle and meridian parameter, counter-clockwise.
    fn rectangle(&mut self, turn: [f64; 2], along: [f64; 2], is_right: bool) -> usize {
        let [low, high] = along.map(|t| self.around(t, turn));
        let [first, last] = turn.map(|angle| self.upward(angle, along));
        let walk = [
            low.map(|low| (low, true)),
            Some((last, true)),
            high.map(|high| (high, false)),
            Some((first, false)),
        ];
        self.bound(&walk.into_iter().flatten().collect::<Vec<_>>(), is_right)
    }

    fn bound(&mut self, walk: &[(usize, bool)], is_right: bool) -> usize {
        let use_ = |&(edge, forward): &(usize, bool)| {
            self.text
                .add(format!("ORIENTED_EDGE('',*,*,#{edge},{})", flag(forward)))
        };
        let uses: Vec<usize> = walk.iter().map(use_).collect();
        let edge_loop = self
            .text
            .add(format!("EDGE_LOOP('',({}))", references(&uses)));
        self.text
            .add(format!("FACE_BOUND('',#{edge_loop},{})", flag(is_right)))
    }

    /// The surface, and whether its normal is the cross product of the circle's direction and the meridian's direction.
    fn surface(&mut self, written: Written) -> (usize, bool) {
        match written {
            Written::Revolution { is_downward } => {
                let curve = self.meridian_curve(if is_downward { 1.0 } else { 0.0 });
                let (origin, up) = (
                    self.text.point([0.0; 3]),
                    if is_downward { [0.0, 0.0, -1.0] } else { UP },
                );
                let up = self.text.direction(up);
                let axis = self
                    .text
                    .add(format!("AXIS1_PLACEMENT('',#{origin},#{up})"));
                (
                    self.text
                        .add(format!("SURFACE_OF_REVOLUTION('',#{curve},#{axis})")),
                    !is_downward,
                )
            }
            Written::Spline { is_transposed } => (self.spline(is_transposed), !is_transposed),
            Written::Cylinder | Written::Extrusion => {
                let axes = self.text.axes([0.0; 3], UP, X);
                let radius = self.meridian[0][0];
                if written == Written::Cylinder {
                    return (
                        self.text
                            .add(format!("CYLINDRICAL_SURFACE('',#{axes},{radius:?})")),
                        true,
                    );
                }
                let circle = self.text.add(format!("CIRCLE('',#{axes},{radius:?})"));
                let up = self.text.direction(UP);
                let vector = self.text.add(format!("VECTOR('',#{up},1.)"));
                (
                    self.text.add(format!(
                        "SURFACE_OF_LINEAR_EXTRUSION('',#{circle},#{vector})"
                    )),
                    true,
                )
            }
        }
    }

    /// The surface as a spline, whose circles are four rational arcs.
    fn spline(&mut self, is_transposed: bool) -> usize {
        let n = self.meridian.len();
        let half = (PI / 4.0).cos();
        let pole = |i: usize, j: usize| {
            let [reach, height] = self.meridian[j];
            revolved(
                [if i % 2 == 1 { reach / half } else { reach }, height],
                PI / 4.0 * i as f64,
            )
        };
        let grid: Vec<Vec<(usize, f64)>> = (0..9)
            .map(|i| {
                (0..n)
                    .map(|j| {
                        (
                            self.text.point(pole(i, j)),
                            if i % 2 == 1 { half } else { 1.0 },
                        )
                    })
                    .collect()
            })
            .collect();
        let grid = if is_transposed {
            (0..n)
                .map(|j| grid.iter().map(|row| row[j]).collect())
                .collect()
        } else {
            grid
        };
        let rows = |cell: &dyn Fn(&(usize, f64)) -> String| {
            let row = |row: &Vec<(usize, f64)>| {
                format!("({})", row.iter().map(cell).collect::<Vec<_>>().join(","))
            };
            grid.iter().map(row).collect::<Vec<_>>().join(",")
        };
        let (poles, weights) = (
            rows(&|(pole, _)| format!("#{pole}")),
            rows(&|(_, weight)| format!("{weight:?}")),
        );
        let mut sides = [
            (
                "2".to_owned(),
                "(3,2,2,2,3)".to_owned(),
                "(0.,0.25,0.5,0.75,1.)",
            ),
            ((n - 1).to_string(), format!("({n},{n})"), "(0.,1.)"),
        ];
        if is_transposed {
            sides.reverse();
        }
        let [(degree_u, times_u, knots_u), (degree_v, times_v, knots_v)] = sides;
        self.text.add(format!(
            "(BOUNDED_SURFACE()B_SPLINE_SURFACE({degree_u},{degree_v},({poles}),.UNSPECIFIED.,.F.,.F.,.F.)\
             B_SPLINE_SURFACE_WITH_KNOTS({times_u},{times_v},{knots_u},{knots_v},.UNSPECIFIED.)\
             GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_SURFACE(({weights}))REPRESENTATION_ITEM('')SURFACE())"
        ))
    }
}

/// A patch over an angle of `turn`, with a hole in it. Also returns its area.
fn patch(meridian: &Meridian, written: Written, turn: f64, wrong: Wrong) -> (Vec<u8>, f64) {
    let mut face = RevolvedFace {
        text: StepText::in_millimeters(),
        meridian,
        vertices: BTreeMap::new(),
    };
    let start = 2.5;
    let hole = [start + 0.6 * turn, start + 0.9 * turn];
    let bounds = [
        face.rectangle([start, start + turn], [0.0, 1.0], !wrong.bound),
        face.rectangle(hole, [0.3, 0.6], wrong.bound != wrong.hole),
    ];
    let (surface, is_natural) = face.surface(written);
    let same_sense = flag(is_natural != wrong.sense);
    let face = {
        let list = references(&bounds);
        let id = face.text.add(format!(
            "ADVANCED_FACE('',({list}),#{surface},{same_sense})"
        ));
        open(face.text, &[id])
    };
    (
        face,
        turn * area_per_radian(meridian, [0.0, 1.0])
            - 0.3 * turn * area_per_radian(meridian, [0.3, 0.6]),
    )
}

/// Checks the area of the surface and that of the mesh.
#[track_caller]
fn check_area(name: &str, text: &[u8], expected: f64) {
    let shape = shape_of(name, text);
    assert_eq!(shape.lost, [], "{name}");
    let (area, mesh) = (
        shape.graph.faces[0].area,
        shape.mesh.triangle_areas().iter().sum::<f64>(),
    );
    assert!(
        (area - expected).abs() <= 2e-3 * expected,
        "{name}: area {area}, expected {expected}"
    );
    assert!(
        (mesh - expected).abs() <= 0.05 * expected,
        "{name}: mesh {mesh}, expected {expected}"
    );
}

#[test]
fn a_patch_stays_on_its_side_for_any_flags() {
    let revolutions = [false, true].map(|is_downward| Written::Revolution { is_downward });
    let splines = [false, true].map(|is_transposed| Written::Spline { is_transposed });
    let [upward, _] = revolutions;
    let mut cases: Vec<(&str, &Meridian, Written)> = Vec::new();
    for written in revolutions.into_iter().chain(splines) {
        cases.extend([
            ("open", OPEN, written),
            ("dome", DOME, written),
            ("dome from its rim", DOME_FROM_RIM, written),
        ]);
    }
    for (name, meridian) in [
        ("wall", WALL),
        ("funnel", FUNNEL),
        ("annulus", ANNULUS),
        ("cone", CONE),
        ("disc", DISC),
    ] {
        cases.push((name, meridian, upward));
    }
    cases.extend([
        ("cylinder", WALL, Written::Cylinder),
        ("extruded circle", WALL, Written::Extrusion),
    ]);
    for (name, meridian, written) in cases {
        for turn in [0.5, PI, 4.5] {
            for flags in 0..8 {
                let wrong = Wrong {
                    sense: flags & 1 == 1,
                    bound: flags & 2 == 2,
                    hole: flags & 4 == 4,
                };
                let (text, area) = patch(meridian, written, turn, wrong);
                check_area(
                    &format!("{name}, {written:?}, a turn of {turn}, {wrong:?}"),
                    &text,
                    area,
                );
            }
        }
    }
}

#[test]
fn a_full_turn_lies_between_its_rims_for_any_bounds() {
    for meridian in [OPEN, WALL, FUNNEL, ANNULUS] {
        for flags in 0..8 {
            let [sense, low, high] = [1, 2, 4].map(|bit| flags & bit == bit);
            let mut face = RevolvedFace {
                text: StepText::in_millimeters(),
                meridian,
                vertices: BTreeMap::new(),
            };
            let rims = [0.0, 1.0].map(|t| face.around(t, [1.0, 1.0]).unwrap());
            let bounds = [
                face.bound(&[(rims[0], true)], !low),
                face.bound(&[(rims[1], false)], !high),
            ];
            let (surface, is_natural) = face.surface(Written::Revolution { is_downward: false });
            let (list, same_sense) = (references(&bounds), flag(is_natural != sense));
            let id = face.text.add(format!(
                "ADVANCED_FACE('',({list}),#{surface},{same_sense})"
            ));
            let area = TAU * area_per_radian(meridian, [0.0, 1.0]);
            check_area(
                &format!("{meridian:?}, flags {flags}"),
                &open(face.text, &[id]),
                area,
            );
        }
    }
}

/// The numbers to which an instance of the file refers.
fn named(line: &str) -> Vec<usize> {
    let pieces = line
        .split('#')
        .skip(1)
        .map(|piece| piece.split(|c: char| !c.is_ascii_digit()).next().unwrap());
    pieces.map(|digits| digits.parse().unwrap()).collect()
}

/// The same text with some bounds of each face reversed: on planes those whose index `is_reversed` selects, and on cylinders with
/// several bounds the second one.
fn with_reversed_bounds(step: &str, is_reversed: impl Fn(usize) -> bool) -> String {
    let line_of: BTreeMap<usize, &str> = step
        .lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| (named(line)[0], line))
        .collect();
    let mut reversed = Vec::new();
    for line in line_of
        .values()
        .filter(|line| line.contains("=ADVANCED_FACE("))
    {
        let ids = named(line);
        let (bounds, surface) = (&ids[1..ids.len() - 1], line_of[&ids[ids.len() - 1]]);
        let picked = |i: &usize| {
            if surface.contains("=PLANE(") {
                is_reversed(*i)
            } else {
                *i == 1
            }
        };
        if surface.contains("=PLANE(") || surface.contains("=CYLINDRICAL_SURFACE(") {
            reversed.extend((0..bounds.len()).filter(picked).map(|i| bounds[i]));
        }
    }
    let line = |line: &str| {
        let is_bound = line.starts_with('#') && reversed.contains(&named(line)[0]);
        let line = if is_bound {
            line.replace(",.T.)", ",.F.)")
        } else {
            line.to_owned()
        };
        line + "\n"
    };
    step.lines().map(line).collect()
}

#[test]
fn reversed_bounds_change_nothing() {
    let settings = SynthSettings {
        seed: 11,
        min_parts: 4,
        max_parts: 30,
    };
    let mut n_reversed = 0;
    for index in 0..40 {
        let part = part(&settings, index);
        let right = shape_of(&part.name, part.step.as_bytes());
        let holes = with_reversed_bounds(&part.step, |i| i > 0);
        let outer = with_reversed_bounds(&part.step, |i| i == 0);
        let every_other = with_reversed_bounds(&part.step, |i| i % 2 == 1);
        n_reversed += usize::from(holes != part.step);
        for text in [holes, outer, every_other] {
            let wrong = shape_of(&part.name, text.as_bytes());
            let parts = |shape: &Tessellation| {
                partition_by_type_and_angle(&shape.graph, THETA_DEG)
                    .parts()
                    .to_vec()
            };
            assert_eq!(
                (wrong.lost.as_slice(), parts(&wrong)),
                ([].as_slice(), parts(&right)),
                "{}",
                part.name
            );
            assert_eq!(wrong.graph.edges, right.graph.edges, "{}", part.name);
            for (wrong, right) in wrong.graph.faces.iter().zip(&right.graph.faces) {
                assert!(
                    (wrong.area - right.area).abs() <= 1e-4 * right.area,
                    "{}: {}",
                    part.name,
                    wrong.area
                );
            }
            let mesh = solid_mesh(&wrong.mesh, &weld(&wrong.mesh), |_| true);
            assert!(mesh.watertight, "{} is open", part.name);
            let (true_volume, volume) = (wrong.solid_volumes[0], right.solid_volumes[0]);
            assert!(
                (true_volume - volume).abs() <= 1e-4 * volume,
                "{}: {true_volume} is not {volume}",
                part.name
            );
            assert!(
                (mesh.volume - volume).abs() <= 0.03 * volume,
                "{}: mesh {}",
                part.name,
                mesh.volume
            );
        }
    }
    assert!(n_reversed > 10, "only {n_reversed} parts have holes");
}

/// A solid of boxes, in this order. Each box is a shell between two corners.
fn boxes(shells: &[[Point; 2]], are_reversed: bool) -> Vec<u8> {
    let mut text = StepText::in_millimeters();
    let mut ids = Vec::new();
    for &[low, high] in shells {
        let corners = box_corners(partprobe_shape::subtract(high, low))
            .map(|corner| [0, 1, 2].map(|i| corner[i] + low[i]));
        let faces = text.polyhedron(&corners, &CUBE_POLYGONS);
        let shell = text.add(format!("CLOSED_SHELL('',({}))", references(&faces)));
        ids.push(if are_reversed {
            text.add(format!("ORIENTED_CLOSED_SHELL('',*,#{shell},.F.)"))
        } else {
            shell
        });
    }
    let solid = text.add(format!(
        "BREP_WITH_VOIDS('',#{},({}))",
        ids[0],
        references(&ids[1..])
    ));
    text.add(format!(
        "ADVANCED_BREP_SHAPE_REPRESENTATION('',(#{solid}),#1)"
    ));
    text.bytes()
}

#[test]
fn shells_are_nested_by_what_lies_in_what() {
    let cube = |low: f64, high: f64| [[low; 3], [high; 3]];
    let cases: [(&str, &[[Point; 2]], f64); 8] = [
        ("a void", &[cube(0.0, 10.0), cube(2.0, 5.0)], 973.0),
        ("the void first", &[cube(2.0, 5.0), cube(0.0, 10.0)], 973.0),
        ("side by side", &[cube(0.0, 10.0), cube(20.0, 30.0)], 2000.0),
        (
            "an island in a void",
            &[cube(0.0, 10.0), cube(2.0, 8.0), cube(4.0, 5.0)],
            785.0,
        ),
        (
            "the island first",
            &[cube(4.0, 5.0), cube(2.0, 8.0), cube(0.0, 10.0)],
            785.0,
        ),
        (
            "a void in an island",
            &[
                cube(3.0, 7.0),
                cube(0.0, 10.0),
                cube(4.0, 5.0),
                cube(2.0, 8.0),
            ],
            847.0,
        ),
        (
            "two that touch",
            &[cube(0.0, 10.0), [[10.0, 0.0, 0.0], [12.0, 10.0, 10.0]]],
            1200.0,
        ),
        (
            "a void at the wall",
            &[cube(0.0, 10.0), [[0.0, 2.0, 2.0], [4.0, 4.0, 4.0]]],
            984.0,
        ),
    ];
    for (name, shells, volume) in cases {
        for are_reversed in [false, true] {
            let shape = shape_of(name, &boxes(shells, are_reversed));
            let mesh = solid_mesh(&shape.mesh, &weld(&shape.mesh), |_| true);
            assert!(
                (mesh.volume - volume).abs() < 1e-9,
                "{name}: mesh {}, expected {volume}",
                mesh.volume
            );
            assert!(
                (shape.solid_volumes[0] - volume).abs() < 1e-9,
                "{name}: volume {}",
                shape.solid_volumes[0]
            );
            assert!(mesh.watertight, "{name}");
        }
    }
}
