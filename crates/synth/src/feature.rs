//! Draws features of planar faces: holes, bores, bosses, pockets and grooves. A feature that was drawn once can be placed
//! several times.

use crate::frame::{Planar, length};
use crate::part_builder::{Host, PartBuilder};
use crate::path::{Leaves, Path};
use crate::profile::{Circle, Profile};
use crate::shell::Shell;
use crate::side::Side;
use crate::sweep::{Run, Sweep};
use std::f64::consts::PI;

/// How a feature ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// In the face opposite to its host.
    Through,
    /// In a plane of its own.
    Floor,
    /// In a point.
    Point,
}

/// A feature. Its profile is centered on the origin, and its host face is at height 0.
#[derive(Clone, Debug)]
pub(crate) struct Feature {
    profile: Profile,
    path: Path,
    run: Run,
    end: End,
}

impl Feature {
    /// Puts the feature on its host. Returns the plane in which it ends as the next host, if it has one.
    pub(crate) fn place(&self, shell: &mut Shell, host: &Host, center: Planar) -> Option<Host> {
        let plane = host.plane.moved(center);
        let swept = shell.sweep(
            Sweep {
                plane: &plane,
                profile: &self.profile,
                run: self.run,
            },
            &self.path,
        );
        shell.open(host.face, &swept.first, self.run.walks_last());
        match self.end {
            End::Point => None,
            End::Through => {
                let far = host.through?;
                shell.open(far, &swept.last, self.run.walks_first());
                None
            }
            End::Floor => {
                let height = self.path.end()[1];
                let floor = plane.lifted(height);
                let face = shell.cap(&floor, &swept.last, self.run.walks_first());
                Some(Host {
                    plane: floor,
                    face,
                    depth: host.depth + height,
                    through: host.through,
                })
            }
        }
    }

    /// The radius of the free circle around the center of the plane in which the feature ends.
    pub(crate) fn end_room(&self) -> f64 {
        let end = self.profile.offset(self.path.end()[0]);
        let nearest = |i| length(end.side(i).point(0.5)).min(length(end.points[i]));
        (0..end.n_sides())
            .map(nearest)
            .fold(f64::INFINITY, f64::min)
    }

    fn sunk(profile: &Profile, path: Path, end: End) -> Self {
        Self {
            profile: profile.reversed(),
            path,
            run: Run::Down,
            end,
        }
    }

    /// A hole of this profile through the whole thickness of the host.
    pub(crate) fn through(profile: &Profile, depth: f64) -> Self {
        Self::sunk(profile, Path::at(0.0).by(0.0, -depth), End::Through)
    }

    /// A straight-walled pocket of this profile with a flat floor.
    pub(crate) fn pocket(profile: &Profile, depth: f64) -> Self {
        Self::sunk(profile, Path::at(0.0).by(0.0, -depth), End::Floor)
    }

    /// A pocket with a fillet between its floor and its walls. The corner radii of the profile must exceed the fillet's.
    pub(crate) fn filleted_pocket(profile: &Profile, depth: f64, fillet: f64) -> Self {
        let path = Path::at(0.0)
            .by(0.0, fillet - depth)
            .round(fillet, -fillet, Leaves::Upright);
        Self::sunk(profile, path, End::Floor)
    }

    /// A pocket with drafted walls. Its floor is smaller by `taper` on all sides.
    pub(crate) fn drafted_pocket(profile: &Profile, depth: f64, taper: f64) -> Self {
        Self::sunk(profile, Path::at(0.0).by(taper, -depth), End::Floor)
    }

    /// A drilled blind hole: a cylinder and a cone of this half angle.
    pub(crate) fn drilled(profile: &Profile, radius: f64, depth: f64, half_angle: f64) -> Self {
        let tip = radius / libm::tan(half_angle);
        Self::sunk(
            profile,
            Path::at(0.0).by(0.0, tip - depth).by(radius, -tip),
            End::Point,
        )
    }

    /// A blind hole with a spherical bottom.
    pub(crate) fn ball_ended(profile: &Profile, radius: f64, depth: f64) -> Self {
        let path = Path::at(0.0)
            .by(0.0, radius - depth)
            .round(radius, -radius, Leaves::Upright);
        Self::sunk(profile, path, End::Point)
    }

    /// A through hole. From `depths[0]` to `depths[1]`, it is narrower by `step`.
    pub(crate) fn counterbore(profile: &Profile, step: f64, depths: [f64; 2]) -> Self {
        let path = Path::at(0.0)
            .by(0.0, -depths[0])
            .by(step, 0.0)
            .by(0.0, depths[0] - depths[1]);
        Self::sunk(profile, path, End::Through)
    }

    /// A through hole with a conical mouth of this width and depth.
    pub(crate) fn countersink(profile: &Profile, width: f64, mouth_depth: f64, depth: f64) -> Self {
        let path = Path::at(0.0)
            .by(width, -mouth_depth)
            .by(0.0, mouth_depth - depth);
        Self::sunk(profile, path, End::Through)
    }

    /// A groove of this width around a core. The top of the core is level with the host.
    pub(crate) fn groove(profile: &Profile, width: f64, depth: f64) -> Self {
        Self::sunk(
            profile,
            Path::at(0.0).by(0.0, -depth).by(width, 0.0).by(0.0, depth),
            End::Floor,
        )
    }

    /// A groove with a half-round floor.
    pub(crate) fn round_groove(profile: &Profile, radius: f64) -> Self {
        let path = Path::at(0.0).arc_to([2.0 * radius, 0.0], [radius, 0.0], true);
        Self::sunk(profile, path, End::Floor)
    }

    /// A boss. `rim` and `foot` are the finishes of its top edge and of its foot.
    pub(crate) fn boss(profile: &Profile, height: f64, rim: Rim, foot: f64) -> Self {
        let start = match foot > 0.0 {
            true => Path::at(0.0).round(-foot, foot, Leaves::Flat),
            false => Path::at(0.0),
        };
        let rest = height - foot;
        let path = match rim {
            Rim::Sharp => start.by(0.0, rest),
            Rim::Chamfered(size) => start.by(0.0, rest - size).by(-size, size),
            Rim::Rounded(radius) => {
                start
                    .by(0.0, rest - radius)
                    .round(-radius, radius, Leaves::Upright)
            }
            Rim::Drafted(lean) => start.by(-lean, rest),
        };
        Self {
            profile: profile.clone(),
            path,
            run: Run::Up,
            end: End::Floor,
        }
    }
}

/// How the upper edge of a boss or block is finished.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rim {
    Sharp,
    /// Cut off by this length at 45°.
    Chamfered(f64),
    /// Rounded with this radius.
    Rounded(f64),
    /// The whole wall leans inward by this length.
    Drafted(f64),
}

/// Draws a hole that stays within this radius around its center.
pub(crate) fn draw_hole(builder: &mut PartBuilder, host: &Host, room: f64) -> Feature {
    let radius = builder.length(0.35 * room, 0.85 * room);
    let turn = builder.fraction(0.0, 2.0 * PI);
    let circle = Profile::rotated_circle([0.0; 2], radius, builder.circle, turn);
    let depth = host.depth;
    let n_kinds = if host.through.is_some() { 7 } else { 4 };
    match builder.count(0, n_kinds - 1) {
        0 => Feature::drilled(
            &circle,
            radius,
            blind_depth(builder, depth, radius),
            PI * 59.0 / 180.0,
        ),
        1 => {
            let sunk = builder.length(0.3 * depth, 0.7 * depth);
            Feature::pocket(&circle, sunk)
        }
        2 if depth > 1.4 * radius => {
            let sunk = builder.length(1.15 * radius, 0.9 * depth);
            Feature::ball_ended(&circle, radius, sunk)
        }
        2 | 3 if builder.chance(0.4) => {
            Feature::round_groove(&circle, builder.fraction(0.1, 0.3) * radius.min(depth))
        }
        2 | 3 => {
            let sunk = builder.length(0.2 * depth, 0.6 * depth);
            Feature::groove(&circle, builder.fraction(0.3, 0.6) * radius, sunk)
        }
        4 => {
            let step = builder.fraction(0.25, 0.5) * radius;
            let sunk = builder.length(0.25 * depth, 0.6 * depth);
            Feature::counterbore(&circle, step, [sunk, depth])
        }
        5 => {
            let width = builder.fraction(0.25, 0.45) * radius.min(depth);
            Feature::countersink(&circle, width, width, depth)
        }
        _ => Feature::through(&circle, depth),
    }
}

/// Draws a depth at which a drill of this radius leaves some material under its tip.
fn blind_depth(builder: &mut PartBuilder, depth: f64, radius: f64) -> f64 {
    let tip = radius * 0.601;
    builder
        .fraction((0.5 * depth).max(1.1 * tip).min(0.85 * depth), 0.85 * depth)
        .max(1.05 * tip)
}

/// Draws a pocket or a through cut-out whose profile stays within this radius.
pub(crate) fn draw_pocket(builder: &mut PartBuilder, host: &Host, room: f64) -> Feature {
    let width = builder.length(0.35 * room, 0.68 * room);
    let depth = builder.length(0.35 * room, 0.68 * room);
    let corner = builder.fraction(0.3, 0.9) * width.min(depth);
    let turn = if builder.chance(0.3) {
        builder.fraction(0.0, PI)
    } else {
        0.0
    };
    let rounded = Profile::rounded_rectangle([-width, -depth], [width, depth], corner)
        .rotated([0.0; 2], turn);
    let sunk = builder.length(0.25 * host.depth, 0.75 * host.depth);
    match builder.count(0, 5) {
        0 => Feature::filleted_pocket(
            &rounded,
            sunk,
            builder.fraction(0.3, 0.8) * corner.min(sunk),
        ),
        1 => Feature::drafted_pocket(
            &rounded,
            sunk,
            (builder.fraction(0.05, 0.3) * sunk).min(0.8 * corner),
        ),
        2 if host.through.is_some() => Feature::through(&rounded, host.depth),
        3 => {
            let (sides, apothem) = (
                builder.count(3, 6),
                builder.length(0.25 * room, 0.45 * room),
            );
            Feature::pocket(&Profile::regular([0.0; 2], apothem, sides, turn), sunk)
        }
        4 => {
            let (half, reach) = (builder.length(0.2 * room, 0.4 * room), 0.5 * room);
            let slot =
                Profile::hull([-reach, 0.0], half, [reach, 0.0], half).rotated([0.0; 2], turn);
            if host.through.is_some() {
                Feature::through(&slot, host.depth)
            } else {
                Feature::pocket(&slot, sunk)
            }
        }
        _ => Feature::pocket(
            &Profile::rectangle([-width, -depth], [width, depth]).rotated([0.0; 2], turn),
            sunk,
        ),
    }
}

/// Draws a boss that stays within this radius, including its foot.
pub(crate) fn draw_boss(builder: &mut PartBuilder, room: f64) -> Feature {
    let radius = builder.length(0.45 * room, 0.85 * room);
    let height = builder.length(0.5 * radius, 1.6 * radius);
    // Rim and foot together stay within the narrowest corner of the profiles below.
    let finish = builder.fraction(0.08, 0.22) * radius;
    let rim = match builder.count(0, 4) {
        0 | 1 => Rim::Sharp,
        2 => Rim::Chamfered(finish.min(0.4 * height)),
        3 => Rim::Rounded(finish.min(0.4 * height)),
        _ => Rim::Drafted(finish.min(0.3 * height)),
    };
    let foot = if builder.chance(0.35) {
        builder.fraction(0.08, 0.2) * radius.min(height)
    } else {
        0.0
    };
    let profile = match builder.count(0, 3) {
        0 => Profile::regular(
            [0.0; 2],
            0.75 * radius,
            builder.count(4, 6),
            builder.fraction(0.0, PI),
        ),
        1 => Profile::rounded_rectangle(
            [-0.7 * radius; 2],
            [0.7 * radius, 0.5 * radius],
            0.45 * radius,
        ),
        _ => builder.round(radius),
    };
    // A round foot with mitered corners needs elliptic edges, which only a few parts should have.
    let is_mitered = profile.sides.iter().all(|side| *side == Side::Line);
    let foot = if is_mitered && builder.circle != Circle::Halved {
        0.0
    } else {
        foot
    };
    Feature::boss(&profile, height, rim, foot)
}
