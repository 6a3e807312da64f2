//! Turned parts: an outline that is one circle, and a path that tells the radius at each height.

use super::plates::{draw_rim, up};
use crate::draft::{Draft, Host, cells};
use crate::feature::{Feature, Rim, draw_hole};
use crate::outline::Outline;
use crate::path::{Leaves, Path};
use std::f64::consts::FRAC_PI_3;

/// A shaft of cylinders, cones, shoulders, fillets, and sometimes a spherical end.
pub(super) fn shaft(draft: &mut Draft) {
    let mut radius = draft.length(5.0, 12.0);
    let base = radius;
    let mut path = Path::at(0.0);
    let n_sections = draft.count(1, (draft.target / 2).clamp(1, 8));
    for _ in 0..n_sections {
        let (length, next) = (draft.length(6.0, 30.0), draft.length(5.0, 22.0));
        let change: f64 = next - radius;
        path = path.by(0.0, length);
        path = match draft.count(0, 4) {
            _ if change.abs() < 1.0 => path,
            0 => path.by(change, 1.5 * change.abs()),
            1 if change < 0.0 => path
                .round(0.6 * change, -0.6 * change, Leaves::Upright)
                .by(0.4 * change, 0.0),
            1 => path
                .by(0.4 * change, 0.0)
                .round(0.6 * change, 0.6 * change, Leaves::Upright),
            2 if change < 0.0 => {
                path.by(0.5 * change, 0.0)
                    .round(0.5 * change, -0.5 * change, Leaves::Flat)
            }
            _ => path.by(change, 0.0),
        };
        radius = path.stations[path.stations.len() - 1][0] + base;
    }
    path = path.by(0.0, draft.length(4.0, 15.0));
    let end = draft.count(0, 3);
    path = match end {
        0 => path.round(-radius, radius, Leaves::Upright),
        1 => path.by(-0.2 * radius, 0.2 * radius),
        2 => path.by(-radius, draft.fraction(0.6, 2.0) * radius),
        _ => path,
    };
    let plane = draft.plane;
    let block = draft.block(&plane, &draft.round(base), &path);
    let center_hole = draft.chance(0.5);
    let host = Host {
        depth: 6.0,
        ..block.bottom_host(&plane)
    };
    if center_hole && draft.wanted() > 1 {
        let hole = draw_hole(draft, &host, 0.6 * base);
        hole.place(&mut draft.shell, &host, [0.0; 2]);
    }
}

/// A wheel with a V or round groove in its rim and a stepped bore.
pub(super) fn pulley(draft: &mut Draft) {
    let (radius, land) = (draft.length(18.0, 50.0), draft.length(2.0, 6.0));
    let (depth, mouth) = (draft.fraction(0.15, 0.35) * radius, draft.length(6.0, 14.0));
    let mut path = Path::at(0.0).by(0.0, land);
    for _ in 0..draft.count(1, 3) {
        let flat = draft.fraction(0.15, 0.4) * mouth;
        path = match draft.count(0, 2) {
            0 => path
                .by(-depth, (mouth - flat) / 2.0)
                .by(0.0, flat)
                .by(depth, (mouth - flat) / 2.0),
            1 => path.by(-depth, 0.0).by(0.0, mouth).by(depth, 0.0),
            _ => {
                let [out, z] = path.stations[path.stations.len() - 1];
                path.arc_to([out, z + mouth], [out, z + mouth / 2.0], false)
            }
        };
        path = path.by(0.0, land);
    }
    let plane = draft.plane;
    let block = draft.block(&plane, &draft.round(radius), &path);
    let Some(mut host) = block.top_host(&plane) else {
        return;
    };
    let inner = radius - depth;
    if draft.chance(0.5) {
        let hub = Feature::boss(
            &draft.round(0.6 * inner),
            draft.length(2.0, 8.0),
            Rim::Sharp,
            0.0,
        );
        host = hub.place(&mut draft.shell, &host, [0.0; 2]).unwrap_or(host);
    }
    let bore = draw_hole(draft, &host, 0.4 * inner);
    bore.place(&mut draft.shell, &host, [0.0; 2]);
}

/// A thin-walled cup or bush: outside up, over the rim, and down the inside.
pub(super) fn cup(draft: &mut Draft) {
    let (radius, height) = (draft.length(12.0, 40.0), draft.length(15.0, 60.0));
    let (wall, floor) = (draft.length(1.5, 4.0), draft.length(2.0, 5.0));
    let lean = if draft.chance(0.4) {
        draft.fraction(0.02, 0.2) * radius
    } else {
        0.0
    };
    let outside = match draft.count(0, 2) {
        0 => Path::at(0.0).by(lean, height),
        1 => Path::at(0.0)
            .by(lean, 0.7 * height)
            .by(2.0, 0.0)
            .by(0.0, 0.3 * height),
        _ => Path::at(0.0).by(0.0, 0.4 * height).by(lean, 0.6 * height),
    };
    let fillet = draft.fraction(0.2, 0.5) * radius.min(height - floor);
    let rim = match draft.chance(0.3) {
        true => outside.arc_to_inside(wall),
        false => outside.by(-wall, 0.0),
    };
    let [out, top] = rim.stations[rim.stations.len() - 1];
    let path = match draft.count(0, 2) {
        0 => rim.to([-wall, floor]),
        1 => rim
            .to([-wall, floor + fillet])
            .round(-fillet, -fillet, Leaves::Upright),
        _ if out > -wall => rim.by(0.0, -0.3 * (top - floor)).to([-wall - 1.0, floor]),
        _ => rim.to([-wall - 1.0, floor]),
    };
    let plane = draft.plane;
    let block = draft.block(&plane, &draft.round(radius), &path);
    let Some(face) = block.top else { return };
    if draft.wanted() > 1 && draft.chance(0.7) {
        let host = Host {
            plane: plane.lifted(floor),
            face,
            depth: floor,
            through: Some(block.bottom),
        };
        let reach = 0.28 * radius;
        let count = draft.count(1, 2);
        let (centers, room) = cells([-reach; 2], [reach; 2], [count, count]);
        let hole = draw_hole(draft, &host, room);
        for center in centers {
            hole.place(&mut draft.shell, &host, center);
        }
    }
}

impl Path {
    /// Goes over a half-round rim to the inner side of a wall this thick.
    fn arc_to_inside(self, wall: f64) -> Self {
        let [out, z] = self.stations[self.stations.len() - 1];
        self.arc_to([out - wall, z], [out - wall / 2.0, z], true)
    }
}

/// A turned part whose wall follows a spline: a surface of revolution.
pub(super) fn vase(draft: &mut Draft) {
    let (radius, height) = (draft.length(12.0, 30.0), draft.length(25.0, 80.0));
    let mut path = Path::at(0.0);
    if draft.chance(0.6) {
        path = path.by(0.0, draft.length(2.0, 8.0));
    }
    let [_, z] = path.stations[path.stations.len() - 1];
    let n = draft.count(3, 5);
    let controls: Vec<[f64; 2]> = (1..=n)
        .map(|i| {
            [
                draft.fraction(-0.5, 0.5) * radius,
                z + height * f64::from(i) / f64::from(n),
            ]
        })
        .collect();
    path = path.spline_through(&controls);
    if draft.chance(0.5) {
        path = path
            .by(draft.length(1.0, 4.0), 0.0)
            .by(0.0, draft.length(2.0, 6.0));
    }
    let plane = draft.plane;
    let block = draft.block(&plane, &draft.round(radius), &path);
    let Some(host) = block.top_host(&plane) else {
        return;
    };
    // Half of the narrowest radius that the controls allow is free everywhere.
    let hole = draw_hole(
        draft,
        &Host {
            through: None,
            depth: 0.5 * host.depth,
            ..host
        },
        0.3 * radius,
    );
    hole.place(&mut draft.shell, &host, [0.0; 2]);
    if draft.wanted() > 1 {
        let host = Host {
            depth: 0.3 * host.depth,
            ..block.bottom_host(&plane)
        };
        let hole = draw_hole(draft, &host, 0.3 * radius);
        hole.place(&mut draft.shell, &host, [0.0; 2]);
    }
}

/// A bolt: a hexagonal or round head, a shank with shoulders, a chamfered or pointed end.
pub(super) fn bolt(draft: &mut Draft) {
    let (head, head_height) = (draft.length(6.0, 16.0), draft.length(4.0, 12.0));
    let outline = match draft.count(0, 2) {
        0 => draft.round(head),
        1 => Outline::regular([0.0; 2], head, 4, 0.0),
        _ => Outline::regular([0.0; 2], head, 6, FRAC_PI_3 / 2.0),
    };
    let plane = draft.plane;
    let rim = draw_rim(draft, 0.2 * head.min(head_height));
    let rim = if let Rim::Rounded(_) = rim {
        Rim::Sharp
    } else {
        rim
    };
    let block = draft.block(&plane, &outline, &up(head_height, rim));
    let Some(host) = block.top_host(&plane) else {
        return;
    };
    let mut host = host;
    let mut radius = 0.75 * head;
    for _ in 0..draft.count(1, 3) {
        radius *= draft.fraction(0.7, 0.95);
        let rim = draw_rim(draft, 0.2 * radius);
        let section = Feature::boss(
            &draft.round(radius),
            draft.length(0.6 * radius, 4.0 * radius),
            rim,
            0.0,
        );
        radius -= 0.2 * radius;
        host = section
            .place(&mut draft.shell, &host, [0.0; 2])
            .unwrap_or(host);
    }
    let socket = Host {
        depth: head_height,
        ..block.bottom_host(&plane)
    };
    if draft.chance(0.6) {
        let outline = Outline::regular([0.0; 2], draft.length(0.3 * head, 0.55 * head), 6, 0.3);
        Feature::pocket(&outline, 0.6 * head_height).place(&mut draft.shell, &socket, [0.0; 2]);
    }
}

/// A ring: a bush, a washer, or a round of circular section, sometimes with finished edges.
pub(super) fn spacer(draft: &mut Draft) {
    let (radius, height) = (draft.length(6.0, 40.0), draft.length(1.5, 40.0));
    let wall = draft.fraction(0.15, 0.6) * radius;
    let rim = draw_rim(draft, 0.2 * wall.min(height));
    let plane = draft.plane;
    let block = draft.block(&plane, &draft.round(radius), &up(height, rim));
    let Some(host) = block.top_host(&plane) else {
        return;
    };
    let outline = draft.round(radius - wall);
    let bore = match draft.count(0, 2) {
        0 => Feature::through(&outline, height),
        1 => Feature::counterbore(
            &outline,
            0.3 * (radius - wall),
            [draft.fraction(0.3, 0.6) * height, height],
        ),
        _ => Feature::countersink(
            &outline,
            0.2 * height.min(radius - wall),
            0.2 * height,
            height,
        ),
    };
    bore.place(&mut draft.shell, &host, [0.0; 2]);
}

/// A dowel with rounded, pointed or plain ends.
pub(super) fn pin(draft: &mut Draft) {
    let (radius, length) = (draft.length(2.0, 15.0), draft.length(3.0, 80.0));
    let foot = Outline::turned_circle([0.0; 2], 0.6 * radius, draft.circle, 0.4);
    let flare = 0.4 * radius;
    let start = match draft.count(0, 2) {
        0 => Path::at(0.0).by(flare, draft.length(1.0, 20.0)),
        1 => Path::at(0.0).round(flare, flare, Leaves::Flat),
        _ => Path::at(0.0),
    };
    let [out, _] = start.stations[start.stations.len() - 1];
    let width = 0.6 * radius + out;
    let shank = if draft.chance(0.7) {
        start.by(0.0, length)
    } else {
        start
    };
    let path = match draft.count(0, 2) {
        0 => shank.round(-width, width, Leaves::Upright),
        1 => shank.by(-width, draft.fraction(0.5, 3.0) * width),
        _ => shank.by(-0.3 * width, draft.fraction(0.3, 2.0) * width),
    };
    let plane = draft.plane;
    draft.block(&plane, &foot, &path);
}

/// A pin of shoulders with exactly the wanted number of parts.
pub(super) fn stepped_pin(draft: &mut Draft) {
    let mut path = Path::at(0.0);
    let mut radius = draft.length(20.0, 30.0);
    let outline = draft.round(radius);
    let n_steps = draft.target.saturating_sub(2);
    for i in 0..n_steps {
        if i % 2 == 0 {
            path = path.by(0.0, draft.length(3.0, 12.0));
        } else {
            let shoulder = draft.fraction(0.05, 0.15) * radius;
            radius -= shoulder;
            path = path.by(-shoulder, 0.0);
        }
    }
    path = match n_steps % 2 {
        1 => path,
        _ => path.by(-radius, draft.length(5.0, 30.0)),
    };
    let plane = draft.plane;
    draft.block(&plane, &outline, &path);
}
