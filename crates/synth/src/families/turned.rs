//! Draws turned parts. The profile is a circle, and the path gives the distance of the wall from it at each height.
//!
//! Lengths are in millimeters. Their bounds are typical sizes of each kind of part. Fractions of a length keep features
//! apart from each other: a hole that is at most 0.6 of the radius of its face leaves a rim, and a step that is at most
//! half of a wall leaves material.

use super::plates::{draw_rim, up};
use crate::feature::{Feature, Rim, draw_hole};
use crate::part_builder::{Host, PartBuilder, cells};
use crate::path::{Leaves, Path};
use crate::profile::Profile;
use std::f64::consts::FRAC_PI_3;

/// A shaft of cylinders, cones, shoulders, fillets, and sometimes a spherical end.
pub(super) fn shaft(builder: &mut PartBuilder) {
    let base = builder.length(5.0, 12.0);
    let mut path = Path::at(0.0);
    // A section makes about two faces, so half as many sections as parts are needed.
    let n_sections = builder.count(1, (builder.target / 2).clamp(1, 8));
    for _ in 0..n_sections {
        path = shaft_section(builder, path, base);
    }
    let path = shaft_end(builder, path, base);

    let plane = builder.plane;
    let block = builder.block(&plane, &builder.round(base), &path);
    let has_center_hole = builder.chance(0.5);
    // A center hole is short, so that it stays within the first section, which is at least 6 mm long.
    let host = Host {
        depth: 6.0,
        ..block.bottom_host(&plane)
    };
    if has_center_hole && builder.n_missing_parts() > 1 {
        let hole = draw_hole(builder, &host, 0.6 * base);
        hole.place(&mut builder.shell, &host, [0.0; 2]);
    }
}

/// Adds a cylinder, and a random transition to the radius of the next section.
fn shaft_section(builder: &mut PartBuilder, path: Path, base: f64) -> Path {
    let radius = path.end()[0] + base;
    let length = builder.length(6.0, 30.0);
    let next = builder.length(5.0, 22.0);
    let change = next - radius;
    let path = path.by(0.0, length);
    match builder.count(0, 4) {
        // A shoulder below 1 mm would be a face as narrow as a mesh tolerance.
        _ if change.abs() < 1.0 => path,
        // A cone.
        0 => path.by(change, 1.5 * change.abs()),
        // A fillet and a shoulder; the fillet touches the thinner section.
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
        // A plain shoulder.
        _ => path.by(change, 0.0),
    }
}

/// Adds the last cylinder, which ends in a half ball, a chamfer, a cone or a plane.
fn shaft_end(builder: &mut PartBuilder, path: Path, base: f64) -> Path {
    let radius = path.end()[0] + base;
    let path = path.by(0.0, builder.length(4.0, 15.0));
    match builder.count(0, 3) {
        0 => path.round(-radius, radius, Leaves::Upright),
        1 => path.by(-0.2 * radius, 0.2 * radius),
        2 => path.by(-radius, builder.fraction(0.6, 2.0) * radius),
        _ => path,
    }
}

/// A wheel with V, square or round grooves in its rim and a stepped bore.
pub(super) fn pulley(builder: &mut PartBuilder) {
    let radius = builder.length(18.0, 50.0);
    let land = builder.length(2.0, 6.0);
    // At most about a third of the radius, so that a hub and a bore fit inside.
    let depth = builder.fraction(0.15, 0.35) * radius;
    let mouth = builder.length(6.0, 14.0);
    let mut path = Path::at(0.0).by(0.0, land);
    for _ in 0..builder.count(1, 3) {
        path = groove(builder, path, [depth, mouth]).by(0.0, land);
    }

    let plane = builder.plane;
    let block = builder.block(&plane, &builder.round(radius), &path);
    let Some(mut host) = block.top_host(&plane) else {
        return;
    };
    let inner = radius - depth;
    if builder.chance(0.5) {
        let profile = builder.round(0.6 * inner);
        let hub = Feature::boss(&profile, builder.length(2.0, 8.0), Rim::Sharp, 0.0);
        host = hub
            .place(&mut builder.shell, &host, [0.0; 2])
            .unwrap_or(host);
    }
    // A hole of 0.4 of the inner radius stays within the hub, which has 0.6 of it.
    let bore = draw_hole(builder, &host, 0.4 * inner);
    bore.place(&mut builder.shell, &host, [0.0; 2]);
}

/// A V groove with a flat bottom, a square groove or a round one.
fn groove(builder: &mut PartBuilder, path: Path, [depth, mouth]: [f64; 2]) -> Path {
    let flat = builder.fraction(0.15, 0.4) * mouth;
    match builder.count(0, 2) {
        0 => path
            .by(-depth, (mouth - flat) / 2.0)
            .by(0.0, flat)
            .by(depth, (mouth - flat) / 2.0),
        1 => path.by(-depth, 0.0).by(0.0, mouth).by(depth, 0.0),
        _ => {
            let [out, z] = path.end();
            path.arc_to([out, z + mouth], [out, z + mouth / 2.0], false)
        }
    }
}

/// A thin-walled cup or bush. Its path goes up the outside, over the rim, and down the inside.
pub(super) fn cup(builder: &mut PartBuilder) {
    let radius = builder.length(12.0, 40.0);
    let height = builder.length(15.0, 60.0);
    let wall = builder.length(1.5, 4.0);
    let floor = builder.length(2.0, 5.0);
    let outside = cup_outside(builder, radius, height);
    let fillet = builder.fraction(0.2, 0.5) * radius.min(height - floor);
    let rim = if builder.chance(0.3) {
        outside.arc_to_inside(wall)
    } else {
        outside.by(-wall, 0.0)
    };
    let path = cup_inside(builder, rim, [wall, floor, fillet]);

    let plane = builder.plane;
    let block = builder.block(&plane, &builder.round(radius), &path);
    let Some(face) = block.top else { return };
    if builder.n_missing_parts() > 1 && builder.chance(0.7) {
        let host = Host {
            plane: plane.lifted(floor),
            face,
            depth: floor,
            through: Some(block.bottom),
        };
        pierce_floor(builder, &host, radius);
    }
}

/// The outside of a cup: straight, with a lip, or a cylinder below a cone.
fn cup_outside(builder: &mut PartBuilder, radius: f64, height: f64) -> Path {
    let lean = if builder.chance(0.4) {
        builder.fraction(0.02, 0.2) * radius
    } else {
        0.0
    };
    match builder.count(0, 2) {
        0 => Path::at(0.0).by(lean, height),
        1 => Path::at(0.0)
            .by(lean, 0.7 * height)
            .by(2.0, 0.0)
            .by(0.0, 0.3 * height),
        _ => Path::at(0.0).by(0.0, 0.4 * height).by(lean, 0.6 * height),
    }
}

/// The inside of a cup down to its floor: straight, with a fillet, or with a step.
fn cup_inside(builder: &mut PartBuilder, rim: Path, [wall, floor, fillet]: [f64; 3]) -> Path {
    let [out, top] = rim.end();
    match builder.count(0, 2) {
        0 => rim.to([-wall, floor]),
        1 => rim
            .to([-wall, floor + fillet])
            .round(-fillet, -fillet, Leaves::Upright),
        // 1 mm more than the wall, so that the inside becomes narrower on its way down.
        _ if out > -wall => rim.by(0.0, -0.3 * (top - floor)).to([-wall - 1.0, floor]),
        _ => rim.to([-wall - 1.0, floor]),
    }
}

/// Puts one hole, or a square of four, in the floor of a cup.
fn pierce_floor(builder: &mut PartBuilder, floor: &Host, radius: f64) {
    // Half the side of the square of holes, whose corners are at 0.4 of the radius.
    let reach = 0.28 * radius;
    let count = builder.count(1, 2);
    let (centers, room) = cells([-reach; 2], [reach; 2], [count, count]);
    let hole = draw_hole(builder, floor, room);
    for center in centers {
        hole.place(&mut builder.shell, floor, center);
    }
}

impl Path {
    /// Goes over a half-round rim to the inner side of a wall of this thickness.
    fn arc_to_inside(self, wall: f64) -> Self {
        let [out, z] = self.end();
        self.arc_to([out - wall, z], [out - wall / 2.0, z], true)
    }
}

/// A turned part whose wall follows a spline: a surface of revolution.
pub(super) fn vase(builder: &mut PartBuilder) {
    let radius = builder.length(12.0, 30.0);
    let height = builder.length(25.0, 80.0);
    let path = vase_path(builder, radius, height);
    let plane = builder.plane;
    let block = builder.block(&plane, &builder.round(radius), &path);
    let Some(host) = block.top_host(&plane) else {
        return;
    };

    // Half of the smallest radius that the control points allow. The depths leave material between the two holes.
    let room = 0.3 * radius;
    let top = Host {
        through: None,
        depth: 0.5 * host.depth,
        ..host
    };
    let hole = draw_hole(builder, &top, room);
    hole.place(&mut builder.shell, &top, [0.0; 2]);
    if builder.n_missing_parts() > 1 {
        let bottom = Host {
            depth: 0.3 * host.depth,
            ..block.bottom_host(&plane)
        };
        let hole = draw_hole(builder, &bottom, room);
        hole.place(&mut builder.shell, &bottom, [0.0; 2]);
    }
}

/// The path of a spline wall, sometimes with a cylindrical foot, sometimes with a lip.
fn vase_path(builder: &mut PartBuilder, radius: f64, height: f64) -> Path {
    let mut path = Path::at(0.0);
    if builder.chance(0.6) {
        path = path.by(0.0, builder.length(2.0, 8.0));
    }
    let [_, z] = path.end();
    let n = builder.count(3, 5);
    let mut controls = Vec::new();
    for i in 1..=n {
        let offset = builder.fraction(-0.5, 0.5) * radius;
        controls.push([offset, z + height * f64::from(i) / f64::from(n)]);
    }
    path = path.spline_through(&controls);
    if builder.chance(0.5) {
        path = path
            .by(builder.length(1.0, 4.0), 0.0)
            .by(0.0, builder.length(2.0, 6.0));
    }
    path
}

/// A bolt: a hexagonal, square or round head, sometimes with a socket, and a shank with shoulders.
pub(super) fn bolt(builder: &mut PartBuilder) {
    let head = builder.length(6.0, 16.0);
    let head_height = builder.length(4.0, 12.0);
    let profile = match builder.count(0, 2) {
        0 => builder.round(head),
        1 => Profile::regular([0.0; 2], head, 4, 0.0),
        _ => Profile::regular([0.0; 2], head, 6, FRAC_PI_3 / 2.0),
    };
    // A head has no rounded rim, since it may be a polygon with sharp corners.
    let rim = match draw_rim(builder, 0.2 * head.min(head_height)) {
        Rim::Rounded(_) => Rim::Sharp,
        rim => rim,
    };

    let plane = builder.plane;
    let block = builder.block(&plane, &profile, &up(head_height, rim));
    let Some(host) = block.top_host(&plane) else {
        return;
    };
    add_shank(builder, host, 0.75 * head);
    if builder.chance(0.6) {
        let socket = Host {
            depth: head_height,
            ..block.bottom_host(&plane)
        };
        // The corners of the largest socket are at 0.64 of the head, and its floor is 0.4 of the head above the shank.
        let profile = Profile::regular([0.0; 2], builder.length(0.3 * head, 0.55 * head), 6, 0.3);
        Feature::pocket(&profile, 0.6 * head_height).place(&mut builder.shell, &socket, [0.0; 2]);
    }
}

/// Adds one to three sections to a bolt, each thinner than the one before.
fn add_shank(builder: &mut PartBuilder, head: Host, most: f64) {
    let mut host = head;
    let mut radius = most;
    for _ in 0..builder.count(1, 3) {
        radius *= builder.fraction(0.7, 0.95);
        // The rim takes at most 0.2 of the radius, and the next section starts inside it.
        let finish = 0.2 * radius;
        let rim = draw_rim(builder, finish);
        let length = builder.length(0.6 * radius, 4.0 * radius);
        let section = Feature::boss(&builder.round(radius), length, rim, 0.0);
        radius -= finish;
        host = section
            .place(&mut builder.shell, &host, [0.0; 2])
            .unwrap_or(host);
    }
}

/// A ring: a bush, a washer, or a ring of circular section, sometimes with finished edges.
pub(super) fn spacer(builder: &mut PartBuilder) {
    let radius = builder.length(6.0, 40.0);
    let height = builder.length(1.5, 40.0);
    let wall = builder.fraction(0.15, 0.6) * radius;
    let rim = draw_rim(builder, 0.2 * wall.min(height));
    let plane = builder.plane;
    let block = builder.block(&plane, &builder.round(radius), &up(height, rim));
    let Some(host) = block.top_host(&plane) else {
        return;
    };
    let profile = builder.round(radius - wall);
    let bore = match builder.count(0, 2) {
        0 => Feature::through(&profile, height),
        1 => Feature::counterbore(
            &profile,
            0.3 * (radius - wall),
            [builder.fraction(0.3, 0.6) * height, height],
        ),
        _ => Feature::countersink(
            &profile,
            0.2 * height.min(radius - wall),
            0.2 * height,
            height,
        ),
    };
    bore.place(&mut builder.shell, &host, [0.0; 2]);
}

/// A dowel with rounded, pointed or plain ends.
pub(super) fn pin(builder: &mut PartBuilder) {
    let radius = builder.length(2.0, 15.0);
    let length = builder.length(3.0, 80.0);
    let foot = Profile::rotated_circle([0.0; 2], 0.6 * radius, builder.circle, 0.4);
    let flare = 0.4 * radius;
    let start = match builder.count(0, 2) {
        0 => Path::at(0.0).by(flare, builder.length(1.0, 20.0)),
        1 => Path::at(0.0).round(flare, flare, Leaves::Flat),
        _ => Path::at(0.0),
    };
    let [out, _] = start.end();
    let width = 0.6 * radius + out;
    let shank = if builder.chance(0.7) {
        start.by(0.0, length)
    } else {
        start
    };
    let path = match builder.count(0, 2) {
        0 => shank.round(-width, width, Leaves::Upright),
        1 => shank.by(-width, builder.fraction(0.5, 3.0) * width),
        _ => shank.by(-0.3 * width, builder.fraction(0.3, 2.0) * width),
    };
    let plane = builder.plane;
    builder.block(&plane, &foot, &path);
}

/// A pin with shoulders that has exactly the target number of parts.
pub(super) fn stepped_pin(builder: &mut PartBuilder) {
    let mut path = Path::at(0.0);
    let mut radius = builder.length(20.0, 30.0);
    let profile = builder.round(radius);
    let n_steps = builder.target.saturating_sub(2);
    for i in 0..n_steps {
        if i % 2 == 0 {
            path = path.by(0.0, builder.length(3.0, 12.0));
        } else {
            let shoulder = builder.fraction(0.05, 0.15) * radius;
            radius -= shoulder;
            path = path.by(-shoulder, 0.0);
        }
    }
    path = match n_steps % 2 {
        1 => path,
        _ => path.by(-radius, builder.length(5.0, 30.0)),
    };
    let plane = builder.plane;
    builder.block(&plane, &profile, &path);
}
