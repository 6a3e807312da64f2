//! Makes walls. A profile that is swept along a path gives one face per side of the profile and step of the path.
//!
//! Extrusions, drafts, chamfers, fillets, holes, bosses, pockets and turned parts are all sweeps of this kind.

use crate::frame::{Frame, Planar, from_to, length, moved, planar_unit, right_of};
use crate::geometry::{Curve, Surface};
use crate::path::Path;
use crate::profile::Profile;
use crate::shell::{Direction, Face, Loop, Ring, Shell, Walk, walks};
use crate::side::{PlacedSide, Side};
use crate::spline;

/// The side of its path on which a wall has the material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Run {
    /// The path leaves a face upward, as for the wall of a block or a boss. It may come down again inside a cup.
    Up,
    /// The path leaves a face downward, as for the wall of a hole or a pocket.
    Down,
}

impl Run {
    fn sign(self) -> f64 {
        match self {
            Self::Up => 1.0,
            Self::Down => -1.0,
        }
    }

    /// The direction in which a wall walks its first ring. A face that closes the last ring walks it in this direction, too.
    pub(crate) fn walks_first(self) -> Direction {
        match self {
            Self::Up => Direction::Forward,
            Self::Down => Direction::Backward,
        }
    }

    /// The direction in which a wall walks its last ring. The face at the first ring walks that ring in this direction, too.
    pub(crate) fn walks_last(self) -> Direction {
        match self {
            Self::Up => Direction::Backward,
            Self::Down => Direction::Forward,
        }
    }
}

/// The result of a sweep.
#[derive(Clone, Debug)]
pub(crate) struct Swept {
    pub(crate) first: Ring,
    pub(crate) last: Ring,
    /// The faces of each step, one per side. A horizontal step has one face.
    pub(crate) walls: Vec<Vec<usize>>,
}

/// A profile, its plane, and the direction of its walls.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sweep<'a> {
    pub(crate) plane: &'a Frame,
    pub(crate) profile: &'a Profile,
    pub(crate) run: Run,
}

impl Shell {
    /// Adds the walls of a sweep. The caller adds the faces at its two ends.
    pub(crate) fn sweep(&mut self, sweep: Sweep<'_>, path: &Path) -> Swept {
        let first = self.ring(&sweep, path.stations[0]);
        let mut last = first.clone();
        let mut walls = Vec::new();
        for i in 0..path.steps.len() {
            let step = path.step(i);
            let next = self.ring(&sweep, step.end);
            walls.push(if is_level(&step) {
                vec![self.shelf(&sweep, &step, [&last, &next])]
            } else {
                self.walls(&sweep, &step, [&last, &next])
            });
            let slice = |t: f64| sweep.profile.offset(step.point(t)[0]).area() * step.slope(t)[1];
            self.volume += sweep.run.sign() * spline::integral(step.n_pieces(), slice);
            last = next;
        }
        Swept { first, last, walls }
    }

    /// Adds the profile's edges at an offset and a height.
    fn ring(&mut self, sweep: &Sweep<'_>, [out, z]: Planar) -> Ring {
        let profile = sweep.profile.offset(out);
        if let Some(point) = vanishing_point(&profile) {
            let apex = self.vertex(sweep.plane.point(point, z));
            return Ring {
                corners: vec![apex; profile.n_sides()],
                edges: Vec::new(),
                area: 0.0,
            };
        }
        let corners: Vec<usize> = profile
            .points
            .iter()
            .map(|&p| self.vertex(sweep.plane.point(p, z)))
            .collect();
        let n = corners.len();
        let edges = (0..n)
            .map(|i| {
                self.edge(
                    corners[i],
                    corners[(i + 1) % n],
                    ring_curve(sweep.plane, &profile.side(i), z),
                )
            })
            .collect();
        Ring {
            corners,
            edges,
            area: profile.area(),
        }
    }

    /// Adds the planar face between two rings at one height.
    fn shelf(
        &mut self,
        sweep: &Sweep<'_>,
        step: &PlacedSide<'_>,
        [first, last]: [&Ring; 2],
    ) -> usize {
        let faces_up = sweep.run.sign() * (step.start[0] - step.end[0]) > 0.0;
        let level = sweep.plane.lifted(step.start[1]);
        let mut loops = vec![first.walked(sweep.run.walks_first())];
        if !last.edges.is_empty() {
            loops.push(last.walked(sweep.run.walks_last()));
        }
        if last.area.abs() > first.area.abs() {
            loops.reverse();
        }
        self.face(Face {
            surface: Surface::Plane(if faces_up { level } else { level.flipped() }),
            same_sense: true,
            loops,
            area: Some((first.area.abs() - last.area.abs()).abs()),
        })
    }

    /// Adds the faces between two rings, one per side.
    fn walls(&mut self, sweep: &Sweep<'_>, step: &PlacedSide<'_>, rings: [&Ring; 2]) -> Vec<usize> {
        let n = sweep.profile.n_sides();
        let seamless = sweep.profile.seamless && n == 1;
        let rails: Vec<usize> = match seamless {
            true => Vec::new(),
            false => (0..n)
                .map(|i| self.rail(sweep, step, [rings[0].corners[i], rings[1].corners[i]], i))
                .collect(),
        };
        let areas = wall_areas(sweep.profile, step);
        (0..n)
            .map(|i| {
                let (surface, same_sense) = wall_surface(sweep, &sweep.profile.side(i), step);
                let loops = if seamless {
                    seamless_loops(sweep.run, rings)
                } else {
                    vec![panel(sweep.run, rings, [rails[i], rails[(i + 1) % n]], i)]
                };
                self.face(Face {
                    surface,
                    same_sense,
                    loops,
                    area: Some(areas[i]),
                })
            })
            .collect()
    }

    /// Adds the edge that a corner of the profile follows along a step.
    fn rail(
        &mut self,
        sweep: &Sweep<'_>,
        step: &PlacedSide<'_>,
        [start, end]: [usize; 2],
        corner: usize,
    ) -> usize {
        let (miter, foot) = (sweep.profile.miter(corner), sweep.profile.points[corner]);
        let at = |[out, z]: Planar| sweep.plane.point(moved(foot, miter, out), z);
        let curve = match step.side {
            Side::Line => Curve::Line,
            Side::Spline(controls) => Curve::Spline(controls.iter().copied().map(at).collect()),
            Side::Arc { center, ccw } => {
                let along = planar_unit(miter);
                let upright = Frame::new(
                    at(*center),
                    sweep.plane.vector([along[1], -along[0], 0.0]),
                    sweep.plane.vector([along[0], along[1], 0.0]),
                );
                let frame = if *ccw { upright } else { upright.flipped() };
                round_rail(frame, length(from_to(*center, step.start)), length(miter))
            }
        };
        self.edge(start, end, curve)
    }
}

/// A circle, or an ellipse if the corner is mitered.
fn round_rail(frame: Frame, radius: f64, stretch: f64) -> Curve {
    if stretch < 1.0 + 1e-9 {
        Curve::Circle { frame, radius }
    } else {
        Curve::Ellipse {
            frame,
            along_x: radius * stretch,
            along_y: radius,
        }
    }
}

fn is_level(step: &PlacedSide<'_>) -> bool {
    *step.side == Side::Line && step.start[1] == step.end[1]
}

/// The center of a profile that an offset has shrunk to a point. Returns `None` for other profiles.
fn vanishing_point(profile: &Profile) -> Option<Planar> {
    let gone = |i| matches!(profile.sides[i], Side::Arc { center, .. } if length(from_to(center, profile.points[i])) < 1e-9);
    (0..profile.n_sides()).all(gone).then(|| profile.points[0])
}

fn ring_curve(plane: &Frame, side: &PlacedSide<'_>, z: f64) -> Curve {
    match side.side {
        Side::Line => Curve::Line,
        Side::Arc { center, ccw } => {
            let towards = from_to(*center, side.start);
            Curve::Circle {
                frame: plane.axis_at(plane.point(*center, z), towards, *ccw),
                radius: length(towards),
            }
        }
        Side::Spline(controls) => {
            Curve::Spline(controls.iter().map(|&p| plane.point(p, z)).collect())
        }
    }
}

/// The four edges around one wall, or three edges if one ring is a point.
fn panel(run: Run, [first, last]: [&Ring; 2], [rail, next_rail]: [usize; 2], side: usize) -> Loop {
    let step = |edge: usize, forward| Walk { edge, forward };
    let below = first.edges.get(side).map(|&edge| step(edge, true));
    let above = last.edges.get(side).map(|&edge| step(edge, false));
    let mut walks: Vec<Walk> = below
        .into_iter()
        .chain([step(next_rail, true)])
        .chain(above)
        .chain([step(rail, false)])
        .collect();
    if run == Run::Down {
        walks.reverse();
        walks
            .iter_mut()
            .for_each(|walk| walk.forward = !walk.forward);
    }
    Loop::Edges(walks)
}

/// The two separate bounds of a wall without a seam.
fn seamless_loops(run: Run, [first, last]: [&Ring; 2]) -> Vec<Loop> {
    let bound = |ring: &Ring, direction| match ring.edges.is_empty() {
        true => Loop::Vertex(ring.corners[0]),
        false => ring.walked(direction),
    };
    let mut loops = vec![
        bound(first, run.walks_first()),
        bound(last, run.walks_last()),
    ];
    loops.sort_by_key(|walked| walks(walked).is_empty());
    loops
}

/// Returns the surface of one wall, and whether its normal points out of the solid.
fn wall_surface(
    sweep: &Sweep<'_>,
    side: &PlacedSide<'_>,
    step: &PlacedSide<'_>,
) -> (Surface, bool) {
    match (side.side, step.side) {
        (Side::Arc { center, ccw }, _) => round_wall(sweep, (*center, side.start, *ccw), step),
        (Side::Spline(controls), _) => {
            let controls = controls
                .iter()
                .map(|&p| sweep.plane.point(p, step.start[1]))
                .collect();
            let rises = step.end[1] > step.start[1];
            (
                Surface::Extrusion {
                    controls,
                    along: sweep.plane.z,
                },
                rises == (sweep.run == Run::Up),
            )
        }
        (Side::Line, _) => straight_wall(sweep, side, step),
    }
}

/// The wall of a straight side of the profile: a plane, or a cylinder if the step is round.
fn straight_wall(
    sweep: &Sweep<'_>,
    side: &PlacedSide<'_>,
    step: &PlacedSide<'_>,
) -> (Surface, bool) {
    let along = side.direction_at_start();
    let out = right_of(along);
    let at = |[offset, z]: Planar| sweep.plane.point(moved(side.start, out, offset), z);
    let along_3d = sweep.plane.vector([along[0], along[1], 0.0]);
    if let Side::Arc { center, .. } = step.side {
        let frame = Frame::new(
            at(*center),
            along_3d,
            sweep.plane.vector([out[0], out[1], 0.0]),
        );
        let radius = length(from_to(*center, step.start));
        return (
            Surface::Cylinder { frame, radius },
            is_convex(sweep.run, step, *center),
        );
    }
    let [offset, rise] = from_to(step.start, step.end).map(|x| x * sweep.run.sign());
    let normal = sweep.plane.vector([out[0] * rise, out[1] * rise, -offset]);
    (
        Surface::Plane(Frame::new(at(step.start), normal, along_3d)),
        true,
    )
}

/// The wall of an arc of the profile: a cylinder, cone, torus, sphere or surface of revolution. Also returns whether the
/// surface's normal points out of the solid.
fn round_wall(
    sweep: &Sweep<'_>,
    (center, start, ccw): (Planar, Planar, bool),
    step: &PlacedSide<'_>,
) -> (Surface, bool) {
    let arc = ArcOfProfile {
        plane: sweep.plane,
        center,
        towards: from_to(center, start),
        outward: if ccw { 1.0 } else { -1.0 },
    };
    let [widening, rise] = from_to(step.start, step.end);
    let faces_away = (sweep.run.sign() * rise > 0.0) == ccw;
    match step.side {
        Side::Line if widening == 0.0 => (arc.cylinder(step.start), faces_away),
        Side::Line => (arc.cone(step.start, [widening, rise]), faces_away),
        Side::Arc { center, .. } => (
            arc.torus_or_sphere(step.start, *center),
            is_convex(sweep.run, step, *center),
        ),
        Side::Spline(controls) => (arc.revolution(controls), ccw == (sweep.run == Run::Up)),
    }
}

/// An arc of a profile. The wall above it has an axis through the arc's center.
struct ArcOfProfile<'a> {
    plane: &'a Frame,
    center: Planar,
    /// From the center to the start of the arc.
    towards: Planar,
    /// 1 if an offset to the right of the profile leads away from the center, otherwise -1.
    outward: f64,
}

impl ArcOfProfile<'_> {
    fn radius_at(&self, offset: f64) -> f64 {
        length(self.towards) + self.outward * offset
    }

    /// The frame on the axis at a height. Its z axis points up or down.
    fn frame_at(&self, height: f64, up: bool) -> Frame {
        let origin = self.plane.point(self.center, height);
        self.plane.axis_at(origin, self.towards, up)
    }

    fn cylinder(&self, [offset, height]: Planar) -> Surface {
        Surface::Cylinder {
            frame: self.frame_at(height, true),
            radius: self.radius_at(offset),
        }
    }

    /// The cone that starts at this offset and height. Its z axis points to the side where it is wider.
    fn cone(&self, [offset, height]: Planar, [widening, rise]: Planar) -> Surface {
        Surface::Cone {
            frame: self.frame_at(height, self.outward * widening * rise > 0.0),
            radius: self.radius_at(offset).max(0.0),
            half_angle: libm::atan2(widening.abs(), rise.abs()),
        }
    }

    /// The surface of a round step that starts at `start` and has this center. It is a sphere if the center is on the axis.
    fn torus_or_sphere(&self, start: Planar, [offset, height]: Planar) -> Surface {
        let frame = self.frame_at(height, true);
        let minor = length(from_to([offset, height], start));
        let major = self.radius_at(offset);
        if major.abs() < 1e-9 {
            Surface::Sphere {
                frame,
                radius: minor,
            }
        } else {
            Surface::Torus {
                frame,
                major,
                minor,
            }
        }
    }

    fn revolution(&self, controls: &[Planar]) -> Surface {
        let along = planar_unit(self.towards);
        let in_space = |&[offset, height]: &Planar| {
            let foot = moved(self.center, along, self.radius_at(offset));
            self.plane.point(foot, height)
        };
        Surface::Revolution {
            controls: controls.iter().map(in_space).collect(),
            axis: self.frame_at(0.0, true),
        }
    }
}

/// Whether a round step is convex, seen from outside the solid.
fn is_convex(run: Run, step: &PlacedSide<'_>, center: Planar) -> bool {
    let [offset, rise] = step.direction_at_start();
    let away = from_to(center, step.start);
    run.sign() * (rise * away[0] - offset * away[1]) > 0.0
}

/// The areas of the walls of one step.
fn wall_areas(profile: &Profile, step: &PlacedSide<'_>) -> Vec<f64> {
    let strip = |i: usize, t: f64| {
        profile.offset(step.point(t)[0]).side(i).length() * length(step.slope(t))
    };
    (0..profile.n_sides())
        .map(|i| spline::integral(step.n_pieces(), |t| strip(i, t)))
        .collect()
}
