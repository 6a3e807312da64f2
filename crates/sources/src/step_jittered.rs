//! Moves the boundaries of STEP-Parts by a radius: `step-jittered-<PERMILLE>`.
//!
//! The parts and their neighbors remain, but the positions of the boundaries are wrong. At each common boundary of two parts, one
//! of them at random loses the region within the radius to the other. Distances are Euclidean: if a wall is thinner than the
//! radius, its far side can be lost, too.

use crate::degraded::step_parts;
use crate::factory::SourceFactory;
use crate::region_merging::welded_borders;
use crate::source::{PointRule, SourceLabels};
use partprobe_carrier::{Carrier, IGNORE, Point, Rng, ShapeKind, dot, keyed_rng, subtract, weld};
use rand::Rng as _;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// The radius is in thousandths of the diagonal of the bounding box. Points that are wrong at a smaller radius are
/// wrong at a larger one.
pub(crate) const STEP_JITTERED: SourceFactory = SourceFactory::numbered_rule(
    "step-jittered-<PERMILLE>",
    "step-parts with boundaries moved by PERMILLE thousandths of the diagonal",
    0..=200,
    |carrier, permille, seed| {
        let mut rng = keyed_rng(seed, &["step-jittered", &carrier.meta().id]);
        let radius = f64::from(permille) / 1000.0 * carrier.mesh().diagonal();
        let rule = MovedBoundaries::new(carrier, radius, &mut rng);
        Ok(SourceLabels::on_points(carrier.mesh(), Arc::new(rule)))
    },
)
.needing(ShapeKind::Brep);

/// A piece of a boundary at which one part loses a region to another one.
#[derive(Clone, Copy, Debug)]
struct Front {
    from: Point,
    to: Point,
    winner: u32,
}

impl Front {
    fn squared_distance(&self, point: Point) -> f64 {
        let along = subtract(self.to, self.from);
        let offset = subtract(point, self.from);
        let length = dot(along, along);
        let at = if length > 0.0 {
            (dot(offset, along) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let rest = subtract(offset, along.map(|x| at * x));
        dot(rest, rest)
    }

    /// A cheap test: whether the box around the piece is nearer than the radius on every axis.
    fn may_reach(&self, point: Point, radius: f64) -> bool {
        (0..3).all(|axis| {
            let (low, high) = (
                self.from[axis].min(self.to[axis]),
                self.from[axis].max(self.to[axis]),
            );
            low - radius <= point[axis] && point[axis] <= high + radius
        })
    }
}

#[derive(Debug)]
struct MovedBoundaries {
    part_of_triangle: Vec<u32>,
    /// For each part, the fronts at which it loses a region.
    fronts: Vec<Vec<Front>>,
    radius: f64,
}

impl MovedBoundaries {
    fn new(carrier: &Carrier, radius: f64, rng: &mut Rng) -> Self {
        let parts = step_parts(carrier);
        let mesh = carrier.mesh();
        let part_of_triangle: Vec<u32> = mesh
            .tri_face
            .iter()
            .map(|&face| parts.parts()[face as usize])
            .collect();

        let welded = weld(mesh);
        let parts_beside = |between: [u32; 2]| {
            let [a, b] = between.map(|triangle| part_of_triangle[triangle as usize]);
            [a.min(b), a.max(b)]
        };
        let borders: Vec<_> = welded_borders(&welded)
            .into_iter()
            .map(|border| (parts_beside(border.between), border.side))
            .filter(|&([a, b], _)| a != b)
            .collect();

        let pairs: BTreeSet<[u32; 2]> = borders.iter().map(|&(pair, _)| pair).collect();
        let loses_first: BTreeMap<[u32; 2], bool> = pairs
            .into_iter()
            .map(|pair| (pair, rng.next_u64() & 1 == 0))
            .collect();
        let mut fronts = vec![Vec::new(); parts.n_parts() as usize];
        for (pair, side) in borders {
            let [from, to] = side.map(|vertex| welded.vertices[vertex as usize]);
            let [loser, winner] = if loses_first[&pair] {
                pair
            } else {
                [pair[1], pair[0]]
            };
            fronts[loser as usize].push(Front { from, to, winner });
        }
        Self {
            part_of_triangle,
            fronts,
            radius,
        }
    }

    /// The part that wins at the nearest front within the radius, or the part itself.
    fn winner(&self, part: u32, point: Point) -> u32 {
        let near = self.fronts[part as usize]
            .iter()
            .filter(|front| front.may_reach(point, self.radius));
        let distances = near.map(|front| (front.squared_distance(point), front.winner));
        let within = distances.filter(|&(squared, _)| squared < self.radius * self.radius);
        within
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(part, |(_, winner)| winner)
    }
}

impl PointRule for MovedBoundaries {
    fn label(&self, triangle: u32, point: Point) -> i32 {
        let part = self.part_of_triangle.get(triangle as usize).copied();
        part.map_or(IGNORE, |part| self.winner(part, point) as i32)
    }
}
