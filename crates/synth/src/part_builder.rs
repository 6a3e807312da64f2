//! Builds one part: its random numbers, its shell, and the planar faces that can still take features.

use crate::frame::{Frame, Planar, right_of, scaled};
use crate::path::Path;
use crate::profile::{Circle, Profile};
use crate::shell::{Ring, Shell};
use crate::side::Side;
use crate::sweep::{Run, Sweep, Swept};
use partprobe_carrier::Rng;
use rand::RngExt as _;
use std::f64::consts::TAU;

/// A part under construction.
pub(crate) struct PartBuilder {
    rng: Rng,
    pub(crate) shell: Shell,
    /// The position and orientation of the part in space.
    pub(crate) plane: Frame,
    /// The form in which full circles of this part are written.
    pub(crate) circle: Circle,
    /// The target number of STEP parts. Families stop adding features when they are near it.
    pub(crate) target: u32,
}

/// A planar face that features can be put on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Host {
    /// Its z axis points out of the solid, and its origin is on the face.
    pub(crate) plane: Frame,
    pub(crate) face: usize,
    /// The thickness of the material behind the face.
    pub(crate) depth: f64,
    /// The parallel face at that depth, if a hole may go through to it.
    pub(crate) through: Option<usize>,
}

/// The faces of a sweep with both ends closed.
pub(crate) struct Block {
    pub(crate) bottom: usize,
    /// `None` if the sweep ends in a point.
    pub(crate) top: Option<usize>,
    pub(crate) swept: Swept,
    /// Heights of the two ends.
    pub(crate) levels: [f64; 2],
}

impl PartBuilder {
    /// An empty part with a random placement.
    pub(crate) fn new(mut rng: Rng, target: u32) -> Self {
        let circle = match rng.random_range(0..20) {
            0..9 => Circle::Halved,
            9..16 => Circle::Seamed,
            _ => Circle::Seamless,
        };
        let plane = random_placement(&mut rng);
        Self {
            rng,
            shell: Shell::default(),
            plane,
            circle,
            target,
        }
    }

    /// A random length between two bounds, in multiples of 0.05 mm.
    pub(crate) fn length(&mut self, low: f64, high: f64) -> f64 {
        let drawn = (self.fraction(low, high) * 20.0).round() / 20.0;
        if drawn < low || drawn > high {
            self.fraction(low, high)
        } else {
            drawn
        }
    }

    /// A random number between two bounds.
    pub(crate) fn fraction(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.rng.random_range(0.0..1.0)
    }

    /// A random integer between two bounds, both included.
    pub(crate) fn count(&mut self, low: u32, high: u32) -> u32 {
        self.rng.random_range(low..=high.max(low))
    }

    /// Returns `true` with this probability.
    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.fraction(0.0, 1.0) < probability
    }

    /// The number of STEP parts that are missing to the target. Every face counts as one part.
    pub(crate) fn n_missing_parts(&self) -> u32 {
        self.target
            .saturating_sub(u32::try_from(self.shell.faces.len()).unwrap_or(u32::MAX))
    }

    /// A circle around the origin, in the form in which this part's circles are written.
    pub(crate) fn round(&self, radius: f64) -> Profile {
        Profile::circle([0.0; 2], radius, self.circle)
    }

    /// Adds a closed sweep to the part's shell.
    pub(crate) fn block(&mut self, plane: &Frame, profile: &Profile, path: &Path) -> Block {
        self.shell.block(plane, profile, path)
    }

    /// Sweeps a hole between two faces, which are at the ends of the path. The path runs up.
    pub(crate) fn bore(
        &mut self,
        plane: &Frame,
        profile: &Profile,
        path: &Path,
        faces: [usize; 2],
    ) -> [Ring; 2] {
        let swept = self.shell.sweep(
            Sweep {
                plane,
                profile,
                run: Run::Up,
            },
            path,
        );
        self.shell
            .open(faces[0], &swept.first, Run::Up.walks_last());
        self.shell
            .open(faces[1], &swept.last, Run::Up.walks_first());
        [swept.first, swept.last]
    }
}

impl Shell {
    /// Sweeps a profile along a path that runs up, and closes both ends.
    pub(crate) fn block(&mut self, plane: &Frame, profile: &Profile, path: &Path) -> Block {
        let swept = self.sweep(
            Sweep {
                plane,
                profile,
                run: Run::Up,
            },
            path,
        );
        let levels = [path.start()[1], path.end()[1]];
        let bottom = self.cap(
            &plane.lifted(levels[0]).flipped(),
            &swept.first,
            Run::Up.walks_last(),
        );
        let top = (!swept.last.edges.is_empty())
            .then(|| self.cap(&plane.lifted(levels[1]), &swept.last, Run::Up.walks_first()));
        Block {
            bottom,
            top,
            swept,
            levels,
        }
    }
}

impl Block {
    /// The top as a host. Holes can pass through it to the bottom.
    pub(crate) fn top_host(&self, plane: &Frame) -> Option<Host> {
        let [low, high] = self.levels;
        let face = self.top?;
        Some(Host {
            plane: plane.lifted(high),
            face,
            depth: high - low,
            through: Some(self.bottom),
        })
    }

    /// The bottom as a host. Features cannot pass through it.
    pub(crate) fn bottom_host(&self, plane: &Frame) -> Host {
        let [low, high] = self.levels;
        Host {
            plane: plane.lifted(low).flipped(),
            face: self.bottom,
            depth: high - low,
            through: None,
        }
    }
}

/// The frame of a straight wall: x is along the side, y is up, and the origin is at the side's start.
pub(crate) fn wall_plane(plane: &Frame, profile: &Profile, side: usize, level: f64) -> Frame {
    let placed = profile.side(side);
    debug_assert!(*placed.side == Side::Line);
    let along = placed.direction_at_start();
    let out = right_of(along);
    Frame {
        origin: plane.point(placed.start, level),
        x: plane.vector([along[0], along[1], 0.0]),
        y: plane.z,
        z: plane.vector([out[0], out[1], 0.0]),
    }
}

/// The centers of a grid of cells in a rectangle, row by row, and the radius of the free circle around each center.
pub(crate) fn cells(low: Planar, high: Planar, [nx, ny]: [u32; 2]) -> (Vec<Planar>, f64) {
    let step = [
        (high[0] - low[0]) / f64::from(nx),
        (high[1] - low[1]) / f64::from(ny),
    ];
    let middle = |i: u32, j: u32| {
        [
            low[0] + (f64::from(i) + 0.5) * step[0],
            low[1] + (f64::from(j) + 0.5) * step[1],
        ]
    };
    let centers = (0..ny)
        .flat_map(|j| (0..nx).map(move |i| (i, j)))
        .map(|(i, j)| middle(i, j))
        .collect();
    // The radius is less than half of a cell, so that features of neighboring cells do not touch.
    (centers, 0.46 * step[0].min(step[1]))
}

/// Draws a placement: half of the parts have the world axes, some have exchanged axes, and the others have any orientation.
fn random_placement(rng: &mut Rng) -> Frame {
    let mut unit = || rng.random_range(0.0..1.0);
    let kind: f64 = unit();
    if kind < 0.5 {
        return Frame::WORLD;
    }
    let origin = [unit(), unit(), unit()].map(|x: f64| ((x - 0.5) * 4000.0).round() / 10.0);
    if kind < 0.65 {
        let Frame { x, y, z, .. } = Frame::WORLD;
        let z_axis = if kind < 0.55 { scaled(y, -1.0) } else { y };
        return Frame::new(origin, z_axis, if kind < 0.6 { x } else { z });
    }
    // A uniformly distributed direction, and a uniformly distributed rotation about it.
    let height = 2.0 * unit() - 1.0;
    let around = TAU * unit();
    let turn = TAU * unit();
    let across = (1.0 - height * height).sqrt();
    let z = [
        across * libm::cos(around),
        across * libm::sin(around),
        height,
    ];
    let least = (0..3)
        .min_by(|&a, &b| z[a].abs().total_cmp(&z[b].abs()))
        .unwrap_or(0);
    let mut helper = [0.0; 3];
    helper[least] = 1.0;
    let upright = Frame::new(origin, z, helper);
    Frame::new(
        origin,
        z,
        upright.vector([libm::cos(turn), libm::sin(turn), 0.0]),
    )
}
