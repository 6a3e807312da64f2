//! Features of a planar face: holes, bores, bosses, pockets and grooves, drawn once and placed often.

use crate::draft::{Draft, Host};
use crate::frame::{Planar, length};
use crate::outline::{Circle, Outline};
use crate::path::{Leaves, Path};
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

/// A feature, centered on the origin of its host's plane; the host is at height 0.
#[derive(Clone, Debug)]
pub(crate) struct Feature {
    outline: Outline,
    path: Path,
    run: Run,
    end: End,
}

impl Feature {
    /// Puts the feature on its host; where it ends in a plane, that plane is the next host.
    pub(crate) fn place(&self, shell: &mut Shell, host: &Host, center: Planar) -> Option<Host> {
        let plane = host.plane.moved(center);
        let swept = shell.sweep(
            Sweep {
                plane: &plane,
                outline: &self.outline,
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
                let height = self.path.stations[self.path.stations.len() - 1][1];
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

    /// The radius that is free about the middle of the plane in which the feature ends.
    pub(crate) fn end_room(&self) -> f64 {
        let end = self
            .outline
            .offset(self.path.stations[self.path.stations.len() - 1][0]);
        let nearest = |i| length(end.side(i).point(0.5)).min(length(end.points[i]));
        (0..end.n_sides())
            .map(nearest)
            .fold(f64::INFINITY, f64::min)
    }

    fn sunk(outline: &Outline, path: Path, end: End) -> Self {
        Self {
            outline: outline.reversed(),
            path,
            run: Run::Down,
            end,
        }
    }

    /// A hole of this outline right through the host.
    pub(crate) fn through(outline: &Outline, depth: f64) -> Self {
        Self::sunk(outline, Path::at(0.0).by(0.0, -depth), End::Through)
    }

    /// A straight-walled pocket of this outline with a flat floor.
    pub(crate) fn pocket(outline: &Outline, depth: f64) -> Self {
        Self::sunk(outline, Path::at(0.0).by(0.0, -depth), End::Floor)
    }

    /// A pocket whose floor meets its walls in a fillet; the outline's corners are wider than the fillet.
    pub(crate) fn filleted_pocket(outline: &Outline, depth: f64, fillet: f64) -> Self {
        let path = Path::at(0.0)
            .by(0.0, fillet - depth)
            .round(fillet, -fillet, Leaves::Upright);
        Self::sunk(outline, path, End::Floor)
    }

    /// A pocket with drafted walls: its floor is smaller by `draft` all round.
    pub(crate) fn drafted_pocket(outline: &Outline, depth: f64, draft: f64) -> Self {
        Self::sunk(outline, Path::at(0.0).by(draft, -depth), End::Floor)
    }

    /// A blind hole as a drill leaves it: a cylinder and a cone of this half angle.
    pub(crate) fn drilled(outline: &Outline, radius: f64, depth: f64, half_angle: f64) -> Self {
        let tip = radius / libm::tan(half_angle);
        Self::sunk(
            outline,
            Path::at(0.0).by(0.0, tip - depth).by(radius, -tip),
            End::Point,
        )
    }

    /// A blind hole with a spherical bottom.
    pub(crate) fn ball_ended(outline: &Outline, radius: f64, depth: f64) -> Self {
        let path = Path::at(0.0)
            .by(0.0, radius - depth)
            .round(radius, -radius, Leaves::Upright);
        Self::sunk(outline, path, End::Point)
    }

    /// A hole right through, wider down to `depths[0]`, narrower by `step` from there to `depths[1]`.
    pub(crate) fn counterbore(outline: &Outline, step: f64, depths: [f64; 2]) -> Self {
        let path = Path::at(0.0)
            .by(0.0, -depths[0])
            .by(step, 0.0)
            .by(0.0, depths[0] - depths[1]);
        Self::sunk(outline, path, End::Through)
    }

    /// A hole right through with a conical mouth of this width and depth.
    pub(crate) fn countersink(outline: &Outline, width: f64, mouth_depth: f64, depth: f64) -> Self {
        let path = Path::at(0.0)
            .by(width, -mouth_depth)
            .by(0.0, mouth_depth - depth);
        Self::sunk(outline, path, End::Through)
    }

    /// A groove of this width round a core whose top is level with the host.
    pub(crate) fn groove(outline: &Outline, width: f64, depth: f64) -> Self {
        Self::sunk(
            outline,
            Path::at(0.0).by(0.0, -depth).by(width, 0.0).by(0.0, depth),
            End::Floor,
        )
    }

    /// A groove with a half-round floor.
    pub(crate) fn round_groove(outline: &Outline, radius: f64) -> Self {
        let path = Path::at(0.0).arc_to([2.0 * radius, 0.0], [radius, 0.0], true);
        Self::sunk(outline, path, End::Floor)
    }

    /// A boss; `rim` and `foot` say how its top edge and its foot are finished.
    pub(crate) fn boss(outline: &Outline, height: f64, rim: Rim, foot: f64) -> Self {
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
            outline: outline.clone(),
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
    /// Cut off by this much at 45°.
    Chamfered(f64),
    /// Rounded with this radius.
    Rounded(f64),
    /// The whole wall leans inward by this much.
    Drafted(f64),
}

/// Draws a hole that needs no more than this radius about its center.
pub(crate) fn draw_hole(draft: &mut Draft, host: &Host, room: f64) -> Feature {
    let radius = draft.length(0.35 * room, 0.85 * room);
    let turn = draft.fraction(0.0, 2.0 * PI);
    let circle = Outline::turned_circle([0.0; 2], radius, draft.circle, turn);
    let depth = host.depth;
    let n_kinds = if host.through.is_some() { 7 } else { 4 };
    match draft.count(0, n_kinds - 1) {
        0 => Feature::drilled(
            &circle,
            radius,
            blind_depth(draft, depth, radius),
            PI * 59.0 / 180.0,
        ),
        1 => {
            let sunk = draft.length(0.3 * depth, 0.7 * depth);
            Feature::pocket(&circle, sunk)
        }
        2 if depth > 1.4 * radius => {
            let sunk = draft.length(1.15 * radius, 0.9 * depth);
            Feature::ball_ended(&circle, radius, sunk)
        }
        2 | 3 if draft.chance(0.4) => {
            Feature::round_groove(&circle, draft.fraction(0.1, 0.3) * radius.min(depth))
        }
        2 | 3 => {
            let sunk = draft.length(0.2 * depth, 0.6 * depth);
            Feature::groove(&circle, draft.fraction(0.3, 0.6) * radius, sunk)
        }
        4 => {
            let (step, sunk) = (
                draft.fraction(0.25, 0.5) * radius,
                draft.length(0.25 * depth, 0.6 * depth),
            );
            Feature::counterbore(&circle, step, [sunk, depth])
        }
        5 => {
            let width = draft.fraction(0.25, 0.45) * radius.min(depth);
            Feature::countersink(&circle, width, width, depth)
        }
        _ => Feature::through(&circle, depth),
    }
}

/// A depth at which a drill of this radius leaves some material under its tip.
fn blind_depth(draft: &mut Draft, depth: f64, radius: f64) -> f64 {
    let tip = radius * 0.601;
    draft
        .fraction((0.5 * depth).max(1.1 * tip).min(0.85 * depth), 0.85 * depth)
        .max(1.05 * tip)
}

/// Draws a pocket or a through cut-out whose outline stays within this radius.
pub(crate) fn draw_pocket(draft: &mut Draft, host: &Host, room: f64) -> Feature {
    let (width, depth) = (
        draft.length(0.35 * room, 0.68 * room),
        draft.length(0.35 * room, 0.68 * room),
    );
    let corner = draft.fraction(0.3, 0.9) * width.min(depth);
    let turn = if draft.chance(0.3) {
        draft.fraction(0.0, PI)
    } else {
        0.0
    };
    let rounded =
        Outline::rounded_rectangle([-width, -depth], [width, depth], corner).turned([0.0; 2], turn);
    let sunk = draft.length(0.25 * host.depth, 0.75 * host.depth);
    match draft.count(0, 5) {
        0 => Feature::filleted_pocket(&rounded, sunk, draft.fraction(0.3, 0.8) * corner.min(sunk)),
        1 => Feature::drafted_pocket(
            &rounded,
            sunk,
            (draft.fraction(0.05, 0.3) * sunk).min(0.8 * corner),
        ),
        2 if host.through.is_some() => Feature::through(&rounded, host.depth),
        3 => {
            let (sides, apothem) = (draft.count(3, 6), draft.length(0.25 * room, 0.45 * room));
            Feature::pocket(&Outline::regular([0.0; 2], apothem, sides, turn), sunk)
        }
        4 => {
            let (half, reach) = (draft.length(0.2 * room, 0.4 * room), 0.5 * room);
            let slot =
                Outline::hull([-reach, 0.0], half, [reach, 0.0], half).turned([0.0; 2], turn);
            if host.through.is_some() {
                Feature::through(&slot, host.depth)
            } else {
                Feature::pocket(&slot, sunk)
            }
        }
        _ => Feature::pocket(
            &Outline::rectangle([-width, -depth], [width, depth]).turned([0.0; 2], turn),
            sunk,
        ),
    }
}

/// Draws a boss that stays within this radius, feet included.
pub(crate) fn draw_boss(draft: &mut Draft, room: f64) -> Feature {
    let radius = draft.length(0.45 * room, 0.85 * room);
    let height = draft.length(0.5 * radius, 1.6 * radius);
    // Rim and foot together stay within the narrowest corner of the outlines below.
    let finish = draft.fraction(0.08, 0.22) * radius;
    let rim = match draft.count(0, 4) {
        0 | 1 => Rim::Sharp,
        2 => Rim::Chamfered(finish.min(0.4 * height)),
        3 => Rim::Rounded(finish.min(0.4 * height)),
        _ => Rim::Drafted(finish.min(0.3 * height)),
    };
    let foot = if draft.chance(0.35) {
        draft.fraction(0.08, 0.2) * radius.min(height)
    } else {
        0.0
    };
    let outline = match draft.count(0, 3) {
        0 => Outline::regular(
            [0.0; 2],
            0.75 * radius,
            draft.count(4, 6),
            draft.fraction(0.0, PI),
        ),
        1 => Outline::rounded_rectangle(
            [-0.7 * radius; 2],
            [0.7 * radius, 0.5 * radius],
            0.45 * radius,
        ),
        _ => draft.round(radius),
    };
    // A round foot with mitered corners would need elliptic edges; those are kept to a few parts.
    let is_mitered = outline.sides.iter().all(|side| *side == Side::Line);
    let foot = if is_mitered && draft.circle != Circle::Halved {
        0.0
    } else {
        foot
    };
    Feature::boss(&outline, height, rim, foot)
}
