//! Makes flat parts: plates, discs, links and flanges, with patterns of features on their tops.

use crate::feature::{Feature, Rim, draw_boss, draw_hole, draw_pocket};
use crate::frame::{Planar, polar};
use crate::part_builder::{Host, PartBuilder, cells};
use crate::path::{Leaves, Path};
use crate::profile::Profile;
use std::f64::consts::{PI, TAU};

/// A path up a wall of this height, with this finish of its upper edge.
pub(super) fn up(height: f64, rim: Rim) -> Path {
    match rim {
        Rim::Sharp => Path::at(0.0).by(0.0, height),
        Rim::Chamfered(size) => Path::at(0.0).by(0.0, height - size).by(-size, size),
        Rim::Rounded(radius) => {
            Path::at(0.0)
                .by(0.0, height - radius)
                .round(-radius, radius, Leaves::Upright)
        }
        Rim::Drafted(lean) => Path::at(0.0).by(-lean, height),
    }
}

/// Draws a finish of an upper edge that removes at most this length.
pub(super) fn draw_rim(builder: &mut PartBuilder, most: f64) -> Rim {
    let size = builder.fraction(0.3, 1.0) * most;
    match builder.count(0, 5) {
        0..3 => Rim::Sharp,
        3 => Rim::Chamfered(size),
        4 => Rim::Rounded(size),
        _ => Rim::Drafted(size),
    }
}

/// Fills a rectangle of a host with rows of features, until the target number of parts is reached.
pub(super) fn furnish(builder: &mut PartBuilder, host: &Host, low: Planar, high: Planar) {
    let shorter = (high[0] - low[0]).min(high[1] - low[1]);
    let (nx, ny) = (
        along(builder, high[0] - low[0], shorter),
        along(builder, high[1] - low[1], shorter),
    );
    let (centers, room) = cells(low, high, [nx, ny]);
    let repeated = builder.chance(0.6).then(|| draw_any(builder, host, room));
    for center in centers {
        if builder.n_missing_parts() < 2 {
            break;
        }
        if builder.chance(0.85) {
            let feature = repeated
                .clone()
                .unwrap_or_else(|| draw_any(builder, host, room));
            let floor = feature.place(&mut builder.shell, host, center);
            if let Some(floor) =
                floor.filter(|_| repeated.is_none() && builder.n_missing_parts() > 2)
            {
                pierce(builder, &floor, 0.9 * feature.end_room());
            }
        }
    }
}

/// Draws the number of cells along a length. A cell is about as long as the shorter side, or half of it.
fn along(builder: &mut PartBuilder, length: f64, shorter: f64) -> u32 {
    let longest = (length / shorter * 1.5).clamp(1.0, 4.0);
    builder.count(1, longest as u32 + 1)
}

fn draw_any(builder: &mut PartBuilder, host: &Host, room: f64) -> Feature {
    match builder.count(0, 5) {
        0 => draw_boss(builder, room),
        1 | 2 => draw_pocket(builder, host, room),
        _ => draw_hole(builder, host, room),
    }
}

/// Sometimes adds a small hole in the middle of a boss or a pocket.
fn pierce(builder: &mut PartBuilder, floor: &Host, room: f64) {
    if builder.chance(0.5) {
        let hole = draw_hole(builder, floor, room);
        hole.place(&mut builder.shell, floor, [0.0; 2]);
    }
}

/// A rectangular, rounded or chamfered plate. Some of its walls are split into coplanar faces.
pub(super) fn plate(builder: &mut PartBuilder) {
    let width = builder.length(30.0, 120.0);
    let depth = builder.length(25.0, 90.0);
    let thickness = builder.length(3.0, 18.0);
    let high = [width, depth];
    let corner = builder.fraction(0.1, 0.3) * width.min(depth);
    let mut profile = match builder.count(0, 3) {
        0 => Profile::rounded_rectangle([0.0; 2], high, corner),
        1 => {
            let [w, d] = high;
            Profile::polygon(vec![
                [corner, 0.0],
                [w, 0.0],
                [w, d - corner],
                [w - corner, d],
                [0.0, d],
                [0.0, corner],
            ])
        }
        _ => Profile::rectangle([0.0; 2], high),
    };
    for _ in 0..builder.count(0, 2) {
        let side = builder.count(0, profile.n_sides() as u32 - 1) as usize;
        profile = profile.split(side, builder.fraction(0.3, 0.7));
    }
    let rim = draw_rim(builder, 0.3 * thickness.min(corner));
    let plane = builder.plane;
    let block = builder.block(&plane, &profile, &up(thickness, rim));
    let margin = 0.35 * corner + 0.35 * thickness.min(corner) + 0.5;
    if let Some(host) = block.top_host(&plane) {
        furnish(
            builder,
            &host,
            [margin; 2],
            [width - margin, depth - margin],
        );
    }
}

/// A plate with parallel drafted ribs, and holes between them.
pub(super) fn ribbed_plate(builder: &mut PartBuilder) {
    let width = builder.length(40.0, 110.0);
    let depth = builder.length(30.0, 80.0);
    let thickness = builder.length(3.0, 8.0);
    let height = builder.length(6.0, 25.0);
    let n_ribs = builder.count(1, 4);
    let plane = builder.plane;
    let block = builder.block(
        &plane,
        &Profile::rectangle([0.0; 2], [width, depth]),
        &up(thickness, Rim::Sharp),
    );
    let Some(host) = block.top_host(&plane) else {
        return;
    };
    let bay = width / f64::from(n_ribs);
    let half = builder.fraction(0.08, 0.15) * bay.min(depth);
    let (rib, reach) = (builder.chance(0.4), 0.3 * depth);
    let profile = match rib {
        true => Profile::hull([0.0, -reach], half, [0.0, reach], half),
        false => Profile::rectangle([-half, -reach], [half, reach]),
    };
    let rim = match builder.count(0, 2) {
        0 => Rim::Sharp,
        1 => Rim::Drafted((builder.fraction(0.03, 0.12) * height).min(0.7 * half)),
        _ => Rim::Rounded(0.5 * half),
    };
    let feature = Feature::boss(&profile, height, rim, 0.0);
    let hole_room = 0.2 * bay.min(depth);
    let hole = draw_hole(builder, &host, hole_room);
    for i in 0..n_ribs {
        let left = bay * f64::from(i);
        feature.place(&mut builder.shell, &host, [left + 0.3 * bay, depth / 2.0]);
        if builder.n_missing_parts() > 1 {
            let y = builder.length(hole_room + 1.0, depth - hole_room - 1.0);
            hole.place(&mut builder.shell, &host, [left + 0.75 * bay, y]);
        }
    }
}

/// A disc with bent slots around a bore.
pub(super) fn slotted_disc(builder: &mut PartBuilder) {
    let radius = builder.length(18.0, 60.0);
    let thickness = builder.length(3.0, 14.0);
    let plane = builder.plane;
    let rim = draw_rim(builder, 0.35 * thickness);
    let block = builder.block(&plane, &builder.round(radius), &up(thickness, rim));
    let Some(host) = block.top_host(&plane) else {
        return;
    };
    let bore = builder.length(0.12 * radius, 0.25 * radius);
    let mut center = draw_hole(builder, &host, bore);
    if builder.chance(0.5) {
        center = draw_boss(builder, 1.4 * bore);
    }
    center.place(&mut builder.shell, &host, [0.0; 2]);
    let (n_slots, half) = (builder.count(2, 5), builder.fraction(0.05, 0.1) * radius);
    let pitch = TAU / f64::from(n_slots);
    let sweep = builder.fraction(0.3, 0.6) * pitch;
    let depth = builder.length(0.3 * thickness, 0.6 * thickness);
    let is_through = builder.chance(0.6);
    for i in 0..n_slots {
        let profile =
            Profile::bent_slot([0.0; 2], 0.62 * radius, half, pitch * f64::from(i), sweep);
        let slot = match is_through {
            true => Feature::through(&profile, thickness),
            false => Feature::pocket(&profile, depth),
        };
        slot.place(&mut builder.shell, &host, [0.0; 2]);
    }
}

/// Two eyes of different sizes, joined by tangents, with bores and raised pads.
pub(super) fn link(builder: &mut PartBuilder) {
    let large = builder.length(9.0, 25.0);
    let small = builder.length(5.0, 9.0);
    let distance = builder.length(1.3 * (large + small), 3.0 * (large + small));
    let thickness = builder.length(4.0, 15.0);
    let profile = Profile::hull([0.0; 2], large, [distance, 0.0], small);
    let rim = draw_rim(builder, 0.3 * thickness.min(small));
    let plane = builder.plane;
    let block = builder.block(&plane, &profile, &up(thickness, rim));
    let Some(host) = block.top_host(&plane) else {
        return;
    };
    for (center, room) in [([0.0; 2], 0.65 * large), ([distance, 0.0], 0.65 * small)] {
        let mut eye = host;
        eye.plane = host.plane.moved(center);
        if builder.chance(0.4) {
            let pad = Feature::boss(
                &builder.round(room),
                builder.length(1.0, 4.0),
                Rim::Sharp,
                0.0,
            );
            eye = pad.place(&mut builder.shell, &eye, [0.0; 2]).unwrap_or(eye);
        }
        let hole = draw_hole(builder, &eye, 0.9 * room);
        hole.place(&mut builder.shell, &eye, [0.0; 2]);
    }
    if builder.n_missing_parts() > 3 {
        let (from, to) = (1.15 * large, distance - 1.3 * small);
        let half = builder.fraction(0.3, 0.6) * small;
        if to - from > 3.0 * half {
            let slot = Profile::hull([from + half, 0.0], half, [to - half, 0.0], half);
            Feature::pocket(&slot, 0.3 * thickness).place(&mut builder.shell, &host, [0.0; 2]);
        }
    }
}

/// A flange: a disc with a hub, a bore through both, and a bolt circle.
pub(super) fn flange(builder: &mut PartBuilder) {
    let radius = builder.length(25.0, 70.0);
    let thickness = builder.length(4.0, 15.0);
    let plane = builder.plane;
    let rim = draw_rim(builder, 0.3 * thickness);
    let block = builder.block(&plane, &builder.round(radius), &up(thickness, rim));
    let Some(host) = block.top_host(&plane) else {
        return;
    };
    let hub = builder.length(0.3 * radius, 0.45 * radius);
    let foot = if builder.chance(0.5) {
        builder.fraction(0.05, 0.12) * radius
    } else {
        0.0
    };
    let height = builder.length(0.3 * radius, radius);
    let hub_rim = draw_rim(builder, 0.25 * hub.min(height));
    let hub_rim = if let Rim::Drafted(_) = hub_rim {
        Rim::Drafted(0.3 * hub)
    } else {
        hub_rim
    };
    let top = Feature::boss(&builder.round(hub + foot), height, hub_rim, foot).place(
        &mut builder.shell,
        &host,
        [0.0; 2],
    );
    if let Some(top) = top {
        let bore = draw_hole(builder, &top, 0.7 * hub);
        bore.place(&mut builder.shell, &top, [0.0; 2]);
    }
    let circle = 0.5 * (hub + foot + 0.9 * radius);
    let room = 0.4 * (0.9 * radius - hub - foot);
    let n_bolts = builder.count(3, 8);
    let room = room.min(0.45 * circle * 2.0 * libm::sin(PI / f64::from(n_bolts)));
    let hole = draw_hole(builder, &host, room);
    for i in 0..n_bolts {
        hole.place(
            &mut builder.shell,
            &host,
            polar([0.0; 2], circle, TAU * f64::from(i) / f64::from(n_bolts)),
        );
    }
}
