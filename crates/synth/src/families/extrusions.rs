//! Draws extruded profiles: brackets, channels, stairs, heat sinks, gears and cams.

use super::plates::{furnish, up};
use crate::feature::{Feature, Rim, draw_hole};
use crate::frame::{Planar, polar};
use crate::part_builder::{Host, PartBuilder, wall_plane};
use crate::path::Path;
use crate::profile::{Profile, scalloped, toothed};
use crate::side::Side;
use std::f64::consts::TAU;

/// Puts features on a wall, inside a margin; `through` is the parallel wall behind it.
fn furnish_wall(builder: &mut PartBuilder, profile: &Profile, wall: Wall, faces: &[usize]) {
    let host = Host {
        plane: wall_plane(&builder.plane, profile, wall.side, 0.0),
        face: faces[wall.side],
        depth: wall.thickness,
        through: wall.behind.map(|side| faces[side]),
    };
    let length = profile.side(wall.side).length();
    if length > 3.0 * wall.margin && wall.height > 3.0 * wall.margin {
        furnish(
            builder,
            &host,
            [wall.margin; 2],
            [length - wall.margin, wall.height - wall.margin],
        );
    }
}

/// A straight wall of an extrusion on which features are placed.
#[derive(Clone, Copy)]
struct Wall {
    side: usize,
    behind: Option<usize>,
    thickness: f64,
    height: f64,
    margin: f64,
}

/// An L bracket with a fillet in its corner and features on both legs.
pub(super) fn bracket(builder: &mut PartBuilder) {
    let foot = builder.length(30.0, 80.0);
    let leg = builder.length(25.0, 70.0);
    let thickness = builder.length(3.0, 8.0);
    let width = builder.length(20.0, 60.0);
    let fillet = builder.length(1.5, 8.0);
    let corners = [
        [0.0, 0.0],
        [foot, 0.0],
        [foot, thickness],
        [thickness, thickness],
        [thickness, leg],
        [0.0, leg],
    ];
    let bend = if builder.chance(0.5) {
        fillet + thickness
    } else {
        0.0
    };
    let profile = Profile::rounded(&corners, &[bend, 0.0, 0.0, fillet, 0.0, 0.0]);
    let plane = builder.plane;
    let block = builder.block(&plane, &profile, &up(width, Rim::Sharp));
    let walls = &block.swept.walls[0];
    // If the first corner is rounded, its arc comes before the underside of the foot.
    let shift = usize::from(bend > 0.0);
    let margin = bend.max(fillet).min(0.3 * width) * 0.5 + 1.0;
    let inner_foot = Wall {
        side: 2 + shift,
        behind: Some(shift),
        thickness,
        height: width,
        margin,
    };
    let inner_leg = Wall {
        side: 4 + shift,
        behind: Some(6 + shift),
        thickness,
        height: width,
        margin,
    };
    furnish_leg(builder, &profile, inner_foot, walls, bend.max(fillet));
    if builder.n_missing_parts() > 2 {
        furnish_leg(builder, &profile, inner_leg, walls, bend.max(fillet));
    }
}

/// Puts features on the inner face of a leg, away from the bend.
fn furnish_leg(
    builder: &mut PartBuilder,
    profile: &Profile,
    wall: Wall,
    faces: &[usize],
    bend: f64,
) {
    let host = Host {
        plane: wall_plane(&builder.plane, profile, wall.side, 0.0),
        face: faces[wall.side],
        depth: wall.thickness,
        through: wall.behind.map(|side| faces[side]),
    };
    let length = profile.side(wall.side).length() - bend;
    // The side of the inner foot runs towards the bend, that of the inner leg away from it.
    let runs_away = profile.side(wall.side - 1).side != &Side::Line;
    let start = if runs_away { bend } else { wall.margin };
    let end = if runs_away {
        bend + length - wall.margin
    } else {
        length
    };
    if end - start > 2.0 * wall.margin {
        furnish(
            builder,
            &host,
            [start, wall.margin],
            [end, wall.height - wall.margin],
        );
    }
}

/// A U, T or Z section with features on its base.
pub(super) fn channel(builder: &mut PartBuilder) {
    let width = builder.length(25.0, 70.0);
    let height = builder.length(12.0, 40.0);
    let wall = builder.length(2.5, 5.0);
    let length = builder.length(25.0, 110.0);
    let section = match builder.count(0, 2) {
        0 => u_section(width, height, wall),
        1 => t_section(width, height, wall),
        _ => z_section(width, height, wall),
    };
    // A fillet is smaller than the wall, so that it stays within each leg.
    let fillet = if builder.chance(0.6) {
        builder.fraction(0.3, 0.9) * wall
    } else {
        0.0
    };

    let profile = section.with_fillets(fillet);
    let plane = builder.plane;
    let block = builder.block(&plane, &profile, &up(length, Rim::Sharp));
    let walls = block.swept.walls[0].clone();
    let underside = Wall {
        side: 0,
        behind: None,
        thickness: wall,
        height: length,
        margin: 1.5 * wall,
    };
    furnish_wall(builder, &profile, underside, &walls);
}

/// The corners of a section, and which of them are inner corners.
struct Section {
    corners: [Planar; 8],
    inner: [usize; 2],
}

impl Section {
    /// The profile whose inner corners have fillets of this radius.
    fn with_fillets(&self, radius: f64) -> Profile {
        let mut radii = [0.0; 8];
        for corner in self.inner {
            radii[corner] = radius;
        }
        Profile::rounded(&self.corners, &radii)
    }
}

/// A U whose walls have thickness `t`. `w` and `h` are its width and height.
fn u_section(w: f64, h: f64, t: f64) -> Section {
    Section {
        corners: [
            [0.0, 0.0],
            [w, 0.0],
            [w, h],
            [w - t, h],
            [w - t, t],
            [t, t],
            [t, h],
            [0.0, h],
        ],
        inner: [4, 5],
    }
}

/// A T that stands on its bar. `h` is the height of its stem.
fn t_section(w: f64, h: f64, t: f64) -> Section {
    let middle = w / 2.0;
    let right = middle + t / 2.0;
    let left = middle - t / 2.0;
    Section {
        corners: [
            [0.0, 0.0],
            [w, 0.0],
            [w, t],
            [right, t],
            [right, t + h],
            [left, t + h],
            [left, t],
            [0.0, t],
        ],
        inner: [3, 6],
    }
}

/// A Z of two bars of width `w`.
fn z_section(w: f64, h: f64, t: f64) -> Section {
    Section {
        corners: [
            [0.0, 0.0],
            [w, 0.0],
            [w, h],
            [2.0 * w, h],
            [2.0 * w, h + t],
            [w - t, h + t],
            [w - t, t],
            [0.0, t],
        ],
        inner: [2, 6],
    }
}

/// A staircase with steps of different sizes. Risers and treads may be split.
pub(super) fn stair(builder: &mut PartBuilder) {
    let n_steps = builder.count(2, 6);
    let (width, mut x, mut y) = (builder.length(15.0, 60.0), 0.0, 0.0);
    let mut corners = vec![[0.0, 0.0]];
    for _ in 0..n_steps {
        let tread = builder.length(6.0, 20.0);
        let riser = builder.length(4.0, 14.0);
        let lean = if builder.chance(0.25) {
            builder.fraction(0.05, 0.4) * riser.min(tread)
        } else {
            0.0
        };
        corners.extend([[x + lean, y + riser], [x + tread, y + riser]]);
        (x, y) = (x + tread, y + riser);
    }
    corners.push([x, 0.0]);
    corners.reverse();
    let mut profile = Profile::polygon(corners);
    for _ in 0..builder.count(0, 2) {
        let side = builder.count(1, profile.n_sides() as u32 - 2) as usize;
        profile = profile.split(side, builder.fraction(0.3, 0.7));
    }
    let plane = builder.plane;
    let block = builder.block(&plane, &profile, &up(width, Rim::Sharp));
    let walls = block.swept.walls[0].clone();
    let last = profile.n_sides() - 1;
    let base = Wall {
        side: last,
        behind: None,
        thickness: 3.0,
        height: width,
        margin: 4.0,
    };
    if builder.chance(0.7) {
        furnish_wall(builder, &profile, base, &walls);
    }
}

/// A row of fins on a base. Some heat sinks have drafted or stepped fins.
pub(super) fn heat_sink(builder: &mut PartBuilder) {
    let n_fins = builder.count(2, 9);
    let fin = builder.length(1.5, 4.0);
    let gap = builder.length(2.5, 6.0);
    let base = builder.length(3.0, 8.0);
    let height = builder.length(8.0, 30.0);
    let length = builder.length(20.0, 80.0);
    let lean = if builder.chance(0.4) {
        builder.fraction(0.05, 0.25) * fin
    } else {
        0.0
    };
    let mut corners = Vec::new();
    for i in 0..n_fins {
        let left = f64::from(i) * (fin + gap);
        corners.extend([
            [left, base],
            [left + lean, base + height],
            [left + fin - lean, base + height],
        ]);
        corners.push([left + fin, base]);
    }
    let width = f64::from(n_fins) * (fin + gap) - gap;
    // The outermost flanks go down to the underside.
    corners.remove(0);
    corners.pop();
    corners.extend([[width, 0.0], [0.0, 0.0]]);
    corners.reverse();
    let profile = Profile::polygon(corners);
    let plane = builder.plane;
    let block = builder.block(&plane, &profile, &up(length, Rim::Sharp));
    let walls = block.swept.walls[0].clone();
    let underside = Wall {
        side: 0,
        behind: None,
        thickness: 0.8 * base,
        height: length,
        margin: 2.0,
    };
    if builder.chance(0.6) {
        furnish_wall(builder, &profile, underside, &walls);
    }
}

/// A toothed wheel with a bore, a hub, or both.
pub(super) fn gear(builder: &mut PartBuilder) {
    let (n_teeth, thickness) = (builder.count(4, 9), builder.length(4.0, 18.0));
    let root = builder.length(12.0, 40.0);
    let tip = root * builder.fraction(1.15, 1.4);
    let profile = toothed(root, tip, n_teeth, builder.fraction(0.35, 0.6));
    let plane = builder.plane;
    let block = builder.block(&plane, &profile, &up(thickness, Rim::Sharp));
    let Some(mut host) = block.top_host(&plane) else {
        return;
    };
    if builder.chance(0.5) {
        let radius = builder.length(0.35 * root, 0.6 * root);
        let hub = Feature::boss(
            &builder.round(radius),
            builder.length(2.0, 10.0),
            Rim::Sharp,
            0.0,
        );
        host = hub
            .place(&mut builder.shell, &host, [0.0; 2])
            .unwrap_or(host);
    }
    let bore = draw_hole(builder, &host, 0.3 * root);
    bore.place(&mut builder.shell, &host, [0.0; 2]);
}

/// A cam plate with a profile of splines or scallops. It is drilled and sometimes stepped.
pub(super) fn cam(builder: &mut PartBuilder) {
    let radius = builder.length(15.0, 40.0);
    let thickness = builder.length(4.0, 15.0);
    let profile = match builder.chance(0.7) {
        true => spline_profile(builder, radius),
        false => scalloped(
            radius,
            builder.fraction(0.15, 0.3) * radius,
            builder.count(3, 6),
        ),
    };
    let plane = builder.plane;
    let mut path = Path::at(0.0).by(0.0, thickness);
    if builder.chance(0.4) {
        path = path.by(0.0, builder.length(2.0, 8.0));
    }
    let block = builder.block(&plane, &profile, &path);
    let Some(host) = block.top_host(&plane) else {
        return;
    };
    let inner = 0.35 * radius;
    furnish(builder, &host, [-inner; 2], [inner; 2]);
}

/// Splines between points about a circle, with straight sides between some of them.
fn spline_profile(builder: &mut PartBuilder, radius: f64) -> Profile {
    let n = builder.count(2, 4);
    let pitch = TAU / f64::from(n);
    let (mut points, mut sides) = (Vec::new(), Vec::new());
    for i in 0..n {
        let from = pitch * f64::from(i);
        let to = from + 0.7 * pitch;
        let bulge = builder.fraction(0.9, 1.25) * radius;
        let controls: Vec<Planar> = [
            (0.0, radius),
            (0.3, bulge),
            (0.55, 0.95 * bulge),
            (0.8, bulge),
            (1.0, radius),
        ]
        .map(|(t, r)| polar([0.0; 2], r, from + t * (to - from)))
        .to_vec();
        points.extend([controls[0], controls[4]]);
        sides.extend([Side::Spline(controls), Side::Line]);
    }
    Profile::of_sides(points, sides)
}
