//! Makes small solids with known properties, for tests of programs that read STEP.
//!
//! Each function returns the text of a file. Sizes are in millimeters, even if the file is written in another unit.

use crate::feature::Feature;
use crate::frame::Frame;
use crate::geometry::{Curve, Surface};
use crate::patch::Patch;
use crate::path::{Leaves, Path};
use crate::profile::{Circle, Profile};
use crate::shell::{Face, Loop, Shell, Walk};
use crate::step::{AngleUnit, Body, Decoration, Document, LengthUnit, write};
use crate::sweep::{Run, Sweep};
use crate::wavy_block::add_wavy_block;

/// How the wall of a full turn is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FullTurn {
    /// One face with a seam edge.
    Seamed,
    /// One face with separate bounds and no seam. A bound that is a point is a `VERTEX_LOOP`.
    Seamless,
    /// Two half faces.
    Halved,
}

impl FullTurn {
    /// The three ways.
    pub const ALL: [Self; 3] = [Self::Seamed, Self::Seamless, Self::Halved];

    fn circle(self, radius: f64) -> Profile {
        let style = match self {
            Self::Seamed => Circle::Seamed,
            Self::Seamless => Circle::Seamless,
            Self::Halved => Circle::Halved,
        };
        Profile::circle([0.0; 2], radius, style)
    }
}

/// The unit of length that a file is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    /// Thousandths of a meter.
    Millimeter,
    /// A `CONVERSION_BASED_UNIT` of 25.4 mm.
    Inch,
    /// The SI unit without a prefix.
    Meter,
}

/// The unit of plane angles that a file is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Angle {
    /// The SI unit.
    Radian,
    /// A `CONVERSION_BASED_UNIT` of π/180.
    Degree,
}

const PLANE: Frame = Frame::WORLD;

fn solid(name: &str, shell: &Shell) -> String {
    write(&Document::plain(name), &[Body::Solid(shell)])
}

fn block(profile: &Profile, path: &Path) -> Shell {
    let mut shell = Shell::default();
    shell.block(&PLANE, profile, path);
    shell
}

fn cuboid_at(low: [f64; 3], size: [f64; 3]) -> Shell {
    let profile = Profile::rectangle([low[0], low[1]], [low[0] + size[0], low[1] + size[1]]);
    block(&profile, &Path::at(low[2]).by(0.0, size[2]))
}

/// A rectangular block with a corner at the origin: six planes, twelve edges at 90°.
#[must_use]
pub fn cuboid(size: [f64; 3]) -> String {
    solid("cuboid", &cuboid_at([0.0; 3], size))
}

/// A cylinder that stands on the origin.
#[must_use]
pub fn cylinder(radius: f64, height: f64, turn: FullTurn) -> String {
    solid(
        "cylinder",
        &block(&turn.circle(radius), &Path::at(0.0).by(0.0, height)),
    )
}

/// A truncated cone from `radius` to `top_radius`, written in the given angle unit.
#[must_use]
pub fn frustum(radius: f64, top_radius: f64, height: f64, turn: FullTurn, angle: Angle) -> String {
    let shell = block(
        &turn.circle(radius),
        &Path::at(0.0).by(top_radius - radius, height),
    );
    let angle = if angle == Angle::Degree {
        AngleUnit::Degree
    } else {
        AngleUnit::Radian
    };
    write(
        &Document {
            angle,
            ..Document::plain("frustum")
        },
        &[Body::Solid(&shell)],
    )
}

/// A full cone with its apex. In the `Seamless` form, a `VERTEX_LOOP` bounds the face at the apex.
#[must_use]
pub fn cone(radius: f64, height: f64, turn: FullTurn) -> String {
    solid(
        "cone",
        &block(&turn.circle(radius), &Path::at(0.0).by(-radius, height)),
    )
}

/// A full sphere around the origin: one lune from pole to pole, or two.
///
/// The seamless form is one face, bounded by a `VERTEX_LOOP` at its north pole.
#[must_use]
pub fn sphere(radius: f64, turn: FullTurn) -> String {
    let mut shell = Shell::default();
    if turn == FullTurn::Seamless {
        let pole = shell.vertex([0.0, 0.0, radius]);
        let surface = Surface::Sphere {
            frame: PLANE,
            radius,
        };
        shell.face(Face {
            surface,
            same_sense: true,
            loops: vec![Loop::Vertex(pole)],
            area: None,
        });
        return solid("sphere", &shell);
    }
    // The profile is the equator, and the path goes from the south pole to the north pole.
    let path = Path {
        stations: vec![[-radius, -radius]],
        steps: Vec::new(),
    }
    .arc_to([-radius, radius], [-radius, 0.0], true);
    shell.sweep(
        Sweep {
            plane: &PLANE,
            profile: &turn.circle(radius),
            run: Run::Up,
        },
        &path,
    );
    solid("sphere", &shell)
}

/// A half ball on a disc.
#[must_use]
pub fn hemisphere(radius: f64, turn: FullTurn) -> String {
    solid(
        "hemisphere",
        &block(
            &turn.circle(radius),
            &Path::at(0.0).round(-radius, radius, Leaves::Upright),
        ),
    )
}

/// A full torus around the z axis: one face whose two closed edges are both seams.
#[must_use]
pub fn torus(major: f64, minor: f64) -> String {
    let mut shell = Shell::default();
    let vertex = shell.vertex([major + minor, 0.0, 0.0]);
    let equator = shell.edge(
        vertex,
        vertex,
        Curve::Circle {
            frame: PLANE,
            radius: major + minor,
        },
    );
    let tube = Frame::new([major, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]);
    let meridian = shell.edge(
        vertex,
        vertex,
        Curve::Circle {
            frame: tube,
            radius: minor,
        },
    );
    let walks = [
        (equator, true),
        (meridian, true),
        (equator, false),
        (meridian, false),
    ];
    let walks = walks.map(|(edge, forward)| Walk { edge, forward }).to_vec();
    let surface = Surface::Torus {
        frame: PLANE,
        major,
        minor,
    };
    shell.face(Face {
        surface,
        same_sense: true,
        loops: vec![Loop::Edges(walks)],
        area: None,
    });
    solid("torus", &shell)
}

/// A block with rounded upright edges of radius `corner` and a fillet around its top.
#[must_use]
pub fn filleted_block(size: [f64; 3], corner: f64, fillet: f64) -> String {
    let profile = Profile::rounded_rectangle([0.0; 2], [size[0], size[1]], corner);
    let path = Path::at(0.0)
        .by(0.0, size[2] - fillet)
        .round(-fillet, fillet, Leaves::Upright);
    solid("filleted-block", &block(&profile, &path))
}

/// A block whose top edges are cut off at 45°. Its corners are mitered, so all faces are planes.
#[must_use]
pub fn chamfered_block(size: [f64; 3], chamfer: f64) -> String {
    let profile = Profile::rectangle([0.0; 2], [size[0], size[1]]);
    let path = Path::at(0.0)
        .by(0.0, size[2] - chamfer)
        .by(-chamfer, chamfer);
    solid("chamfered-block", &block(&profile, &path))
}

/// A square plate with a hole through its middle, in the given unit of length.
#[must_use]
pub fn plate_with_hole(
    side: f64,
    thickness: f64,
    radius: f64,
    turn: FullTurn,
    length: Length,
) -> String {
    let mut shell = Shell::default();
    let profile = Profile::rectangle([-side / 2.0; 2], [side / 2.0; 2]);
    let body = shell.block(&PLANE, &profile, &Path::at(0.0).by(0.0, thickness));
    if let Some(host) = body.top_host(&PLANE) {
        Feature::through(&turn.circle(radius), thickness).place(&mut shell, &host, [0.0; 2]);
    }
    let length = match length {
        Length::Millimeter => LengthUnit::Millimeter,
        Length::Inch => LengthUnit::Inch,
        Length::Meter => LengthUnit::Meter,
    };
    write(
        &Document {
            length,
            ..Document::plain("plate-with-hole")
        },
        &[Body::Solid(&shell)],
    )
}

/// A bar of pentagonal section whose two upper facets bend by this angle, in degrees, along one edge.
///
/// Below the threshold the two facets are one part. The angle is exact up to rounding.
#[must_use]
pub fn bent_top(bend_deg: f64) -> String {
    let drop = 20.0 * libm::tan(bend_deg.to_radians());
    let corners = vec![
        [0.0, 0.0],
        [40.0, 0.0],
        [40.0, 20.0 - drop],
        [20.0, 20.0],
        [0.0, 20.0],
    ];
    solid(
        "bent-top",
        &block(&Profile::polygon(corners), &Path::at(0.0).by(0.0, 30.0)),
    )
}

/// A block with one wall that is written as two coplanar faces: seven faces, six parts.
#[must_use]
pub fn split_block(size: [f64; 3]) -> String {
    let profile = Profile::rectangle([0.0; 2], [size[0], size[1]]).split(0, 0.4);
    solid(
        "split-block",
        &block(&profile, &Path::at(0.0).by(0.0, size[2])),
    )
}

/// A block without its lid, as a `SHELL_BASED_SURFACE_MODEL` of five faces.
#[must_use]
pub fn open_box(size: [f64; 3]) -> String {
    let mut shell = cuboid_at([0.0; 3], size);
    shell.faces.pop();
    write(&Document::plain("open-box"), &[Body::Open(&shell)])
}

/// A block with a block-shaped void, as a `BREP_WITH_VOIDS`. The wall has the thickness `wall` on all sides.
#[must_use]
pub fn hollow_block(size: [f64; 3], wall: f64) -> String {
    let outer = cuboid_at([0.0; 3], size);
    let inner = cuboid_at([wall; 3], size.map(|x| x - 2.0 * wall));
    write(
        &Document::plain("hollow-block"),
        &[Body::Hollow(&outer, vec![&inner])],
    )
}

/// Two blocks in one file, with a gap of 10 mm between them.
#[must_use]
pub fn two_blocks(size: [f64; 3]) -> String {
    let first = cuboid_at([0.0; 3], size);
    let second = cuboid_at([size[0] + 10.0, 0.0, 0.0], size);
    write(
        &Document::plain("two-blocks"),
        &[Body::Solid(&first), Body::Solid(&second)],
    )
}

/// A block of 40 mm × 30 mm × about 15 mm whose top is a cubic B-spline surface, and its volume in cubic millimeters.
#[must_use]
pub fn wavy_block() -> (String, f64) {
    let row = |tilt: f64| [15.0, 16.0 + tilt, 13.0, 15.0 - tilt, 14.0].to_vec();
    let heights = vec![row(0.0), row(2.0), row(-1.0), row(1.5)];
    let patch = Patch {
        frame: PLANE,
        low: [0.0; 2],
        high: [40.0, 30.0],
        heights,
    };
    let mut shell = Shell::default();
    add_wavy_block(&mut shell, &[patch]);
    (solid("wavy-block", &shell), shell.volume)
}

/// A block whose faces are named `face 0` to `face 5`. Every third face is orange.
#[must_use]
pub fn colored_cuboid(size: [f64; 3]) -> String {
    let decoration = Decoration::NamedAndColored;
    write(
        &Document {
            decoration,
            ..Document::plain("colored")
        },
        &[Body::Solid(&cuboid_at([0.0; 3], size))],
    )
}

/// Every fixture once, with a name.
#[must_use]
pub fn all() -> Vec<(String, String)> {
    let size = [40.0, 30.0, 20.0];
    let mut fixtures: Vec<(String, String)> = [
        ("cuboid", cuboid(size)),
        ("torus", torus(20.0, 6.0)),
        ("filleted-block", filleted_block(size, 6.0, 3.0)),
        ("chamfered-block", chamfered_block(size, 3.0)),
        ("bent-top-5", bent_top(5.0)),
        ("bent-top-8", bent_top(8.0)),
        ("bent-top-12", bent_top(12.0)),
        ("split-block", split_block(size)),
        ("open-box", open_box(size)),
        ("hollow-block", hollow_block(size, 4.0)),
        ("two-blocks", two_blocks(size)),
        ("wavy-block", wavy_block().0),
        ("colored-cuboid", colored_cuboid(size)),
        (
            "frustum-degrees",
            frustum(12.0, 5.0, 20.0, FullTurn::Seamed, Angle::Degree),
        ),
        (
            "plate-inch",
            plate_with_hole(50.8, 6.35, 12.7, FullTurn::Seamed, Length::Inch),
        ),
        (
            "plate-meter",
            plate_with_hole(50.0, 6.0, 12.0, FullTurn::Halved, Length::Meter),
        ),
    ]
    .map(|(name, step)| (name.to_owned(), step))
    .to_vec();
    for turn in FullTurn::ALL {
        let kinds = [
            ("cylinder", cylinder(10.0, 25.0, turn)),
            ("frustum", frustum(12.0, 5.0, 20.0, turn, Angle::Radian)),
            ("cone", cone(12.0, 20.0, turn)),
            ("sphere", sphere(15.0, turn)),
            ("hemisphere", hemisphere(15.0, turn)),
            (
                "plate-with-hole",
                plate_with_hole(50.0, 6.0, 12.0, turn, Length::Millimeter),
            ),
        ];
        fixtures
            .extend(kinds.map(|(name, step)| (format!("{name}-{turn:?}").to_lowercase(), step)));
    }
    fixtures
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expected;
    use std::f64::consts::PI;

    #[test]
    fn every_fixture_is_ascii_with_dense_entity_numbers() {
        for (name, step) in all() {
            crate::step_text_check(&name, &step);
        }
    }

    #[track_caller]
    fn check(shell: &Shell, n_parts: u32, volume: f64, area: f64) {
        assert_eq!(shell.defects(), Vec::<String>::new());
        assert_eq!(expected::partition(shell).n_parts(), n_parts);
        assert!(
            (shell.volume - volume).abs() < 1e-9 * volume,
            "volume {} is not {volume}",
            shell.volume
        );
        let found: f64 = shell.faces.iter().filter_map(|face| face.area).sum();
        assert!(
            (found - area).abs() < 1e-9 * area,
            "area {found} is not {area}"
        );
    }

    #[test]
    fn volumes_and_areas_are_those_of_the_textbook() {
        check(&cuboid_at([1.0; 3], [4.0, 3.0, 2.0]), 6, 24.0, 52.0);
        for turn in FullTurn::ALL {
            let up = Path::at(0.0);
            let disc = turn.circle(3.0);
            check(
                &block(&disc, &up.clone().by(0.0, 2.0)),
                3,
                18.0 * PI,
                30.0 * PI,
            );
            check(
                &block(&disc, &up.clone().by(-3.0, 4.0)),
                2,
                12.0 * PI,
                24.0 * PI,
            );
            check(
                &block(&disc, &up.clone().by(-2.0, 2.0)),
                3,
                26.0 * PI / 3.0,
                (10.0 + 8.0 * 2.0_f64.sqrt()) * PI,
            );
            check(
                &block(&disc, &up.clone().round(-3.0, 3.0, Leaves::Upright)),
                2,
                18.0 * PI,
                27.0 * PI,
            );
            // Half a torus on a ring: a half-round groove in the top of a disc, by Pappus' theorem.
            let groove = up
                .by(0.0, 3.0)
                .by(-1.0, 0.0)
                .arc_to([-2.0, 3.0], [-1.5, 3.0], false);
            let half_tube = PI * 0.125 * 2.0 * PI * 1.5;
            let area = 27.0 * PI + 5.0 * PI + PI * PI * 1.5 + PI;
            check(&block(&disc, &groove), 5, 27.0 * PI - half_tube, area);
        }
    }

    #[test]
    fn a_split_wall_and_a_slight_bend_are_one_part() {
        let path = Path::at(0.0).by(0.0, 2.0);
        check(
            &block(
                &Profile::rectangle([0.0; 2], [4.0, 3.0]).split(0, 0.4),
                &path,
            ),
            6,
            24.0,
            52.0,
        );
        for (bend, n_parts) in [(5.0, 6), (8.0, 6), (8.001, 7), (12.0, 7)] {
            let drop = libm::tan(f64::to_radians(bend));
            let corners = vec![
                [0.0, 0.0],
                [2.0, 0.0],
                [2.0, 2.0 - drop],
                [1.0, 2.0],
                [0.0, 2.0],
            ];
            let shell = block(&Profile::polygon(corners), &path);
            assert_eq!(expected::partition(&shell).n_parts(), n_parts, "at {bend}°");
        }
    }
}
