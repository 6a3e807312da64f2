//! Makes massive parts: nuts, knobs, enclosures and manifold blocks.

use super::plates::{draw_rim, furnish, up};
use crate::feature::{Feature, Rim, draw_hole};
use crate::frame::polar;
use crate::part_builder::{Host, PartBuilder, cells, wall_plane};
use crate::path::{Leaves, Path};
use crate::profile::{Profile, scalloped};
use crate::side::Side;
use std::f64::consts::TAU;

/// A nut: a regular prism with a washer face and a countersunk bore.
pub(super) fn nut(builder: &mut PartBuilder) {
    let apothem = builder.length(5.0, 25.0);
    let height = builder.length(3.0, 20.0);
    let n_sides = builder.count(4, 8);
    let turn = builder.fraction(0.0, 1.0);
    let profile = Profile::regular([0.0; 2], apothem, n_sides, turn);
    let plane = builder.plane;
    let rim = draw_rim(builder, 0.12 * apothem.min(height));
    let block = builder.block(&plane, &profile, &up(height, rim));
    let Some(mut host) = block.top_host(&plane) else {
        return;
    };
    if builder.chance(0.5) {
        let washer = Feature::boss(
            &builder.round(0.85 * apothem),
            builder.length(0.5, 3.0),
            Rim::Sharp,
            0.0,
        );
        host = washer
            .place(&mut builder.shell, &host, [0.0; 2])
            .unwrap_or(host);
    }
    let bore = builder.length(0.35 * apothem, 0.65 * apothem);
    let mouth = builder.fraction(0.08, 0.2) * bore;
    let bored = Profile::circle([0.0; 2], bore, builder.circle).reversed();
    let low = block.levels[0];
    let high = low + host.depth;
    // Both ends are countersunk: from bottom to top, the bore becomes narrower and then wider again.
    let path = match builder.chance(0.6) {
        true => Path::at(low)
            .by(mouth, mouth)
            .by(0.0, high - low - 2.0 * mouth)
            .by(-mouth, mouth),
        false => Path::at(low).by(0.0, high - low),
    };
    builder.bore(&plane, &bored, &path, [block.bottom, host.face]);
}

/// A knob with scallops or lobes, a blind socket, and a stem.
pub(super) fn knob(builder: &mut PartBuilder) {
    let radius = builder.length(12.0, 35.0);
    let height = builder.length(8.0, 25.0);
    let n = builder.count(3, 8);
    let profile = match builder.chance(0.5) {
        true => scalloped(
            radius,
            builder.fraction(0.15, 0.6) * radius * 2.0 / f64::from(n),
            n,
        ),
        false => {
            let lobes = Profile::regular([0.0; 2], radius, n, 0.0);
            Profile::rounded(&lobes.points, &vec![0.4 * radius; n as usize])
        }
    };
    let smooth = profile.sides.contains(&Side::Line);
    let rim = if smooth {
        draw_rim(builder, 0.25 * height.min(radius))
    } else {
        Rim::Sharp
    };
    let plane = builder.plane;
    let block = builder.block(&plane, &profile, &up(height, rim));
    let inner = 0.5 * radius;
    let below = Host {
        depth: 0.35 * height,
        ..block.bottom_host(&plane)
    };
    let stem = Feature::boss(
        &builder.round(0.8 * inner),
        builder.length(4.0, 15.0),
        draw_rim(builder, 2.0),
        0.0,
    );
    if let Some(end) = stem.place(&mut builder.shell, &below, [0.0; 2]) {
        let socket = draw_hole(builder, &end, 0.4 * inner);
        socket.place(&mut builder.shell, &end, [0.0; 2]);
    }
    if let Some(top) = block
        .top_host(&plane)
        .filter(|_| builder.n_missing_parts() > 1)
    {
        let top = Host {
            depth: 0.4 * height,
            through: None,
            ..top
        };
        let dimple = draw_hole(builder, &top, inner);
        dimple.place(&mut builder.shell, &top, [0.0; 2]);
    }
}

/// An open box with thin walls, standoffs on its floor and windows in its walls.
pub(super) fn enclosure(builder: &mut PartBuilder) {
    let shape = EnclosureShape::drawn(builder);
    let profile = match shape.is_round {
        true => Profile::rounded_rectangle([0.0; 2], shape.size, shape.corner),
        false => Profile::rectangle([0.0; 2], shape.size),
    };
    let path = shape.path(builder);
    let plane = builder.plane;
    let block = builder.block(&plane, &profile, &path);
    let Some(face) = block.top else { return };
    let floor = Host {
        plane: plane.lifted(shape.floor),
        face,
        depth: shape.floor,
        through: Some(block.bottom),
    };
    shape.add_standoffs(builder, &floor);
}

/// The lengths of an open box.
struct EnclosureShape {
    /// Width and depth.
    size: [f64; 2],
    height: f64,
    /// The thickness of the walls.
    wall: f64,
    /// The thickness of the floor.
    floor: f64,
    is_round: bool,
    /// The radius of round corners.
    corner: f64,
}

impl EnclosureShape {
    fn drawn(builder: &mut PartBuilder) -> Self {
        Self {
            size: [builder.length(40.0, 100.0), builder.length(30.0, 80.0)],
            height: builder.length(15.0, 40.0),
            wall: builder.length(2.0, 4.0),
            floor: builder.length(2.0, 5.0),
            is_round: builder.chance(0.6),
            corner: builder.length(4.0, 9.0),
        }
    }

    /// The path goes up the outside, over the rim and down the inside to the floor, sometimes with a fillet at the floor.
    fn path(&self, builder: &mut PartBuilder) -> Path {
        let inside = up_outside(builder, self.height, self.wall).by(-0.5 * self.wall, 0.0);
        match self.is_round && builder.chance(0.5) {
            true => {
                let fillet = builder.fraction(0.3, 0.8) * (self.corner - self.wall);
                inside.to([-self.wall, self.floor + fillet]).round(
                    -fillet,
                    -fillet,
                    Leaves::Upright,
                )
            }
            false => inside.to([-self.wall, self.floor]),
        }
    }

    /// Adds a grid of standoffs with equal holes to the floor, until the target number of parts is reached.
    fn add_standoffs(&self, builder: &mut PartBuilder, floor: &Host) {
        let margin = self.wall + if self.is_round { self.corner } else { 1.0 };
        let (centers, room) = cells(
            [margin; 2],
            self.size.map(|length| length - margin),
            [2, builder.count(1, 2)],
        );
        let radius = room.min(6.0) * builder.fraction(0.5, 0.9);
        let standoff = Feature::boss(
            &builder.round(radius),
            0.5 * self.height,
            draw_rim(builder, 0.3 * radius),
            0.0,
        );
        let mut hole = None;
        for center in centers {
            if builder.n_missing_parts() < 2 {
                break;
            }
            let Some(top) = standoff.place(&mut builder.shell, floor, center) else {
                continue;
            };
            let hole = hole.get_or_insert_with(|| draw_hole(builder, &top, 0.55 * radius));
            hole.place(&mut builder.shell, &top, [0.0; 2]);
        }
    }
}

/// The path up the outside of a box: straight, with a lip, or split in two.
fn up_outside(builder: &mut PartBuilder, height: f64, wall: f64) -> Path {
    match builder.count(0, 2) {
        0 => Path::at(0.0).by(0.0, height),
        1 => Path::at(0.0)
            .by(0.0, 0.8 * height)
            .by(-0.5 * wall, 0.0)
            .by(0.0, 0.2 * height),
        _ => Path::at(0.0).by(0.0, 0.5 * height).by(0.0, 0.5 * height),
    }
}

/// A block with features on several of its faces. No feature is deep enough to meet another one.
pub(super) fn manifold(builder: &mut PartBuilder) {
    let size = [
        builder.length(25.0, 80.0),
        builder.length(25.0, 70.0),
        builder.length(20.0, 60.0),
    ];
    let profile = Profile::rectangle([0.0; 2], [size[0], size[1]]);
    let plane = builder.plane;
    let block = builder.block(&plane, &profile, &up(size[2], Rim::Sharp));
    let reach = 0.28 * size[0].min(size[1]).min(size[2]);
    let walls = block.swept.walls[0].clone();
    let mut hosts: Vec<(Host, [f64; 2])> = (0..4)
        .map(|side| {
            let plane = wall_plane(&plane, &profile, side, 0.0);
            let host = Host {
                plane,
                face: walls[side],
                depth: 0.85 * reach,
                through: None,
            };
            (host, [size[side % 2], size[2]])
        })
        .collect();
    if let Some(top) = block.top_host(&plane) {
        hosts.push((
            Host {
                depth: 0.85 * reach,
                through: None,
                ..top
            },
            [size[0], size[1]],
        ));
    }
    let first = builder.count(0, 4) as usize;
    hosts.rotate_left(first);
    for (host, [width, height]) in hosts {
        if builder.n_missing_parts() > 2 {
            furnish(builder, &host, [reach; 2], [width - reach, height - reach]);
        }
    }
    if builder.n_missing_parts() > 4 {
        add_feet(builder, &block.bottom_host(&plane), size);
    }
}

/// Equal pads on a circle under a block.
fn add_feet(builder: &mut PartBuilder, host: &Host, size: [f64; 3]) {
    let n = builder.count(2, 4);
    let circle = 0.3 * size[0].min(size[1]);
    let foot = Feature::boss(
        &builder.round(0.3 * circle),
        builder.length(1.0, 5.0),
        Rim::Sharp,
        0.0,
    );
    for i in 0..n {
        // The y axis of the bottom is opposite to that of the block.
        let [x, y] = polar([0.0; 2], circle, TAU * f64::from(i) / f64::from(n));
        foot.place(
            &mut builder.shell,
            host,
            [size[0] / 2.0 + x, y - size[1] / 2.0],
        );
    }
}
