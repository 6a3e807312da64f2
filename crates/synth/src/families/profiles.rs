//! Extruded profiles: brackets, channels, stairs, heat sinks, gears and cams.

use super::plates::{furnish, up};
use crate::draft::{Draft, Host, wall_plane};
use crate::feature::{Feature, Rim, draw_hole};
use crate::frame::{Planar, polar};
use crate::outline::{Outline, scalloped, toothed};
use crate::path::Path;
use crate::side::Side;
use std::f64::consts::TAU;

/// Puts features on a wall, inside a margin; `through` is the parallel wall behind it.
fn furnish_wall(draft: &mut Draft, outline: &Outline, wall: Wall, faces: &[usize]) {
    let host = Host {
        plane: wall_plane(&draft.plane, outline, wall.side, 0.0),
        face: faces[wall.side],
        depth: wall.thickness,
        through: wall.behind.map(|side| faces[side]),
    };
    let length = outline.side(wall.side).length();
    if length > 3.0 * wall.margin && wall.height > 3.0 * wall.margin {
        furnish(
            draft,
            &host,
            [wall.margin; 2],
            [length - wall.margin, wall.height - wall.margin],
        );
    }
}

/// A straight wall of an extrusion that takes features.
#[derive(Clone, Copy)]
struct Wall {
    side: usize,
    behind: Option<usize>,
    thickness: f64,
    height: f64,
    margin: f64,
}

/// An L bracket with a fillet in its corner and features on both legs.
pub(super) fn bracket(draft: &mut Draft) {
    let (foot, leg) = (draft.length(30.0, 80.0), draft.length(25.0, 70.0));
    let (thickness, width) = (draft.length(3.0, 8.0), draft.length(20.0, 60.0));
    let fillet = draft.length(1.5, 8.0);
    let corners = [
        [0.0, 0.0],
        [foot, 0.0],
        [foot, thickness],
        [thickness, thickness],
        [thickness, leg],
        [0.0, leg],
    ];
    let bend = if draft.chance(0.5) {
        fillet + thickness
    } else {
        0.0
    };
    let outline = Outline::rounded(&corners, &[bend, 0.0, 0.0, fillet, 0.0, 0.0]);
    let plane = draft.plane;
    let block = draft.block(&plane, &outline, &up(width, Rim::Sharp));
    let walls = &block.swept.walls[0];
    // A rounded first corner puts an arc before the foot's underside.
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
    furnish_leg(draft, &outline, inner_foot, walls, bend.max(fillet));
    if draft.wanted() > 2 {
        furnish_leg(draft, &outline, inner_leg, walls, bend.max(fillet));
    }
}

/// Puts features on the inner face of a leg, at a distance from the bend.
fn furnish_leg(draft: &mut Draft, outline: &Outline, wall: Wall, faces: &[usize], bend: f64) {
    let host = Host {
        plane: wall_plane(&draft.plane, outline, wall.side, 0.0),
        face: faces[wall.side],
        depth: wall.thickness,
        through: wall.behind.map(|side| faces[side]),
    };
    let length = outline.side(wall.side).length() - bend;
    // The inner foot runs towards the bend, the inner leg away from it.
    let runs_away = outline.side(wall.side - 1).side != &Side::Line;
    let start = if runs_away { bend } else { wall.margin };
    let end = if runs_away {
        bend + length - wall.margin
    } else {
        length
    };
    if end - start > 2.0 * wall.margin {
        furnish(
            draft,
            &host,
            [start, wall.margin],
            [end, wall.height - wall.margin],
        );
    }
}

/// A U, T or Z section with features on its base.
pub(super) fn channel(draft: &mut Draft) {
    let (width, height) = (draft.length(25.0, 70.0), draft.length(12.0, 40.0));
    let (wall, length) = (draft.length(2.5, 5.0), draft.length(25.0, 110.0));
    let (corners, inner): (Vec<Planar>, Vec<usize>) = match draft.count(0, 2) {
        0 => {
            let (w, h, t) = (width, height, wall);
            (
                vec![
                    [0.0, 0.0],
                    [w, 0.0],
                    [w, h],
                    [w - t, h],
                    [w - t, t],
                    [t, t],
                    [t, h],
                    [0.0, h],
                ],
                vec![4, 5],
            )
        }
        1 => {
            let (w, h, t, m) = (width, height, wall, width / 2.0);
            let (a, b) = (m + t / 2.0, m - t / 2.0);
            (
                vec![
                    [0.0, 0.0],
                    [w, 0.0],
                    [w, t],
                    [a, t],
                    [a, t + h],
                    [b, t + h],
                    [b, t],
                    [0.0, t],
                ],
                vec![3, 6],
            )
        }
        _ => {
            let (w, h, t) = (width, height, wall);
            (
                vec![
                    [0.0, 0.0],
                    [w, 0.0],
                    [w, h],
                    [2.0 * w, h],
                    [2.0 * w, h + t],
                    [w - t, h + t],
                    [w - t, t],
                    [0.0, t],
                ],
                vec![2, 6],
            )
        }
    };
    let fillet = if draft.chance(0.6) {
        draft.fraction(0.3, 0.9) * wall
    } else {
        0.0
    };
    let radii: Vec<f64> = (0..corners.len())
        .map(|i| if inner.contains(&i) { fillet } else { 0.0 })
        .collect();
    let outline = Outline::rounded(&corners, &radii);
    let plane = draft.plane;
    let block = draft.block(&plane, &outline, &up(length, Rim::Sharp));
    let walls = block.swept.walls[0].clone();
    let underside = Wall {
        side: 0,
        behind: None,
        thickness: wall,
        height: length,
        margin: 1.5 * wall,
    };
    furnish_wall(draft, &outline, underside, &walls);
}

/// A staircase with steps of different sizes; risers and treads may be split.
pub(super) fn stair(draft: &mut Draft) {
    let n_steps = draft.count(2, 6);
    let (width, mut x, mut y) = (draft.length(15.0, 60.0), 0.0, 0.0);
    let mut corners = vec![[0.0, 0.0]];
    for _ in 0..n_steps {
        let (tread, riser) = (draft.length(6.0, 20.0), draft.length(4.0, 14.0));
        let lean = if draft.chance(0.25) {
            draft.fraction(0.05, 0.4) * riser.min(tread)
        } else {
            0.0
        };
        corners.extend([[x + lean, y + riser], [x + tread, y + riser]]);
        (x, y) = (x + tread, y + riser);
    }
    corners.push([x, 0.0]);
    corners.reverse();
    let mut outline = Outline::polygon(corners);
    for _ in 0..draft.count(0, 2) {
        let side = draft.count(1, outline.n_sides() as u32 - 2) as usize;
        outline = outline.split(side, draft.fraction(0.3, 0.7));
    }
    let plane = draft.plane;
    let block = draft.block(&plane, &outline, &up(width, Rim::Sharp));
    let walls = block.swept.walls[0].clone();
    let last = outline.n_sides() - 1;
    let base = Wall {
        side: last,
        behind: None,
        thickness: 3.0,
        height: width,
        margin: 4.0,
    };
    if draft.chance(0.7) {
        furnish_wall(draft, &outline, base, &walls);
    }
}

/// A comb of fins on a base, some with drafted or stepped fins.
pub(super) fn heat_sink(draft: &mut Draft) {
    let n_fins = draft.count(2, 9);
    let (fin, gap) = (draft.length(1.5, 4.0), draft.length(2.5, 6.0));
    let (base, height, length) = (
        draft.length(3.0, 8.0),
        draft.length(8.0, 30.0),
        draft.length(20.0, 80.0),
    );
    let lean = if draft.chance(0.4) {
        draft.fraction(0.05, 0.25) * fin
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
    let outline = Outline::polygon(corners);
    let plane = draft.plane;
    let block = draft.block(&plane, &outline, &up(length, Rim::Sharp));
    let walls = block.swept.walls[0].clone();
    let underside = Wall {
        side: 0,
        behind: None,
        thickness: 0.8 * base,
        height: length,
        margin: 2.0,
    };
    if draft.chance(0.6) {
        furnish_wall(draft, &outline, underside, &walls);
    }
}

/// A toothed wheel with a bore, a hub, or both.
pub(super) fn gear(draft: &mut Draft) {
    let (n_teeth, thickness) = (draft.count(4, 9), draft.length(4.0, 18.0));
    let root = draft.length(12.0, 40.0);
    let tip = root * draft.fraction(1.15, 1.4);
    let outline = toothed(root, tip, n_teeth, draft.fraction(0.35, 0.6));
    let plane = draft.plane;
    let block = draft.block(&plane, &outline, &up(thickness, Rim::Sharp));
    let Some(mut host) = block.top_host(&plane) else {
        return;
    };
    if draft.chance(0.5) {
        let radius = draft.length(0.35 * root, 0.6 * root);
        let hub = Feature::boss(
            &draft.round(radius),
            draft.length(2.0, 10.0),
            Rim::Sharp,
            0.0,
        );
        host = hub.place(&mut draft.shell, &host, [0.0; 2]).unwrap_or(host);
    }
    let bore = draw_hole(draft, &host, 0.3 * root);
    bore.place(&mut draft.shell, &host, [0.0; 2]);
}

/// A cam plate: an outline of splines or scallops, drilled and sometimes stepped.
pub(super) fn cam(draft: &mut Draft) {
    let (radius, thickness) = (draft.length(15.0, 40.0), draft.length(4.0, 15.0));
    let outline = match draft.chance(0.7) {
        true => spline_outline(draft, radius),
        false => scalloped(
            radius,
            draft.fraction(0.15, 0.3) * radius,
            draft.count(3, 6),
        ),
    };
    let plane = draft.plane;
    let mut path = Path::at(0.0).by(0.0, thickness);
    if draft.chance(0.4) {
        path = path.by(0.0, draft.length(2.0, 8.0));
    }
    let block = draft.block(&plane, &outline, &path);
    let Some(host) = block.top_host(&plane) else {
        return;
    };
    let inner = 0.35 * radius;
    furnish(draft, &host, [-inner; 2], [inner; 2]);
}

/// Splines between points about a circle, with straight sides between some of them.
fn spline_outline(draft: &mut Draft, radius: f64) -> Outline {
    let n = draft.count(2, 4);
    let pitch = TAU / f64::from(n);
    let (mut points, mut sides) = (Vec::new(), Vec::new());
    for i in 0..n {
        let from = pitch * f64::from(i);
        let to = from + 0.7 * pitch;
        let bulge = draft.fraction(0.9, 1.25) * radius;
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
    Outline::of_sides(points, sides)
}
