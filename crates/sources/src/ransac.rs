//! Finds connected planes, spheres, cylinders and cones by random trials: `ransac-<PERMILLE>`.
//!
//! Only the mesh is used. Random triangles close to each other propose primitives, and the primitive that covers the most area is
//! taken, until none covers PERMILLE thousandths of the surface (efficient RANSAC: Schnabel, Wahl, Klein 2007). Each connected
//! piece of the rest gets its own label.
//!
//! The publication has points and finds neighbors in an octree and components in a bitmap. A mesh has neighbors: the triangles of
//! a trial come from a random walk, and the support of a primitive is the connected piece around its first triangle. There are no
//! tori: a fillet along a bent edge is divided into pieces of other primitives, or belongs to the rest.

use crate::cone_fit::refitted_cone;
use crate::degraded::below;
use crate::factory::SourceFactory;
use crate::primitive_fit::{Facet, Primitive};
use crate::region_merging::{Region, absorb_smaller_than};
use crate::source::SourceLabels;
use crate::surface::Surface;
use partprobe_carrier::{Mesh, Partition, Point, Rng, ShapeKind, centroid, dot, keyed_rng};
use rand::Rng as _;

/// The largest distance of a triangle's corners from its primitive, as a fraction of the diagonal of the bounding box.
const MAX_DISTANCE: f64 = 0.002;

/// The largest angle between the normals of a triangle and of its primitive, in degrees.
const MAX_ANGLE_DEG: f64 = 10.0;

/// The probability that a larger primitive is overlooked.
const MISS_PROBABILITY: f64 = 0.05;

/// The lowest assumed probability that a trial that begins on a primitive stays on it. The walks are short.
const MIN_STAY_PROBABILITY: f64 = 0.25;

/// Number of trials between two selections of the best candidate.
const TRIALS: usize = 64;

/// A triangle proposes no further primitives of a type if it already lies in this number of primitives that were proposed since
/// the last one was taken.
const MAX_PROPOSALS: u8 = 3;

/// A walk has at most 2 to this power steps.
const MAX_LOG_STEPS: usize = 7;

/// A piece of the rest that is smaller than the smallest primitive joins a neighbor.
pub(crate) const RANSAC: SourceFactory = SourceFactory::numbered_rule(
    "ransac-<PERMILLE>",
    "connected planes, spheres, cylinders and cones found by random trials, each at least PERMILLE thousandths of the area",
    1..=500,
    |carrier, permille, seed| {
        let rng = keyed_rng(seed, &["ransac", &carrier.meta().id]);
        let fraction = f64::from(permille) / 1000.0;
        let regions = Search::new(carrier.mesh(), fraction, rng).regions();
        Ok(SourceLabels::of_regions(&regions))
    },
)
.needing(ShapeKind::Mesh);

/// Marks a triangle that belongs to no primitive.
const FREE: u32 = u32::MAX;

/// A primitive and the area that it covers around the triangle that proposed it.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    primitive: Primitive,
    first: u32,
    /// 1 if the outward normal of the surface is that of the primitive, -1 if it is opposite, as in a hole.
    side: f64,
    area: f64,
    /// The number of primitives that had been taken when the area was measured.
    measured_after: u32,
}

impl Candidate {
    /// The area, reduced by some percent for types with more parameters, because a plane is also nearly a cylinder.
    fn weighted_area(&self) -> f64 {
        let simplicity = match self.primitive {
            Primitive::Plane { .. } => 1.0,
            Primitive::Sphere { .. } | Primitive::Cylinder { .. } => 0.97,
            Primitive::Cone { .. } => 0.94,
        };
        simplicity * self.area
    }
}

fn kind(primitive: &Primitive) -> usize {
    match primitive {
        Primitive::Plane { .. } => 0,
        Primitive::Sphere { .. } => 1,
        Primitive::Cylinder { .. } => 2,
        Primitive::Cone { .. } => 3,
    }
}

struct Search<'a> {
    mesh: &'a Mesh,
    surface: Surface,
    rng: Rng,
    max_distance: f64,
    max_radius: f64,
    min_area: f64,
    /// The primitive of each triangle, or [`FREE`].
    owner: Vec<u32>,
    n_taken: u32,
    /// The cumulative area of the free triangles up to each triangle.
    cumulative: Vec<f64>,
    candidates: Vec<Candidate>,
    /// For each triangle, the number of recent candidates of each type in which it lies.
    covered: Vec<[u8; 4]>,
    /// The number of the last support for which each triangle was tested.
    seen: Vec<u32>,
    n_supports: u32,
}

impl<'a> Search<'a> {
    fn new(mesh: &'a Mesh, min_fraction: f64, rng: Rng) -> Self {
        let surface = Surface::of(mesh);
        let n_triangles = surface.n_triangles();
        let total: f64 = surface.areas.iter().sum();
        let diagonal = mesh.diagonal();
        Self {
            mesh,
            rng,
            max_distance: MAX_DISTANCE * diagonal,
            max_radius: diagonal,
            min_area: min_fraction * total,
            owner: vec![FREE; n_triangles],
            n_taken: 0,
            cumulative: Vec::new(),
            candidates: Vec::new(),
            covered: vec![[0; 4]; n_triangles],
            seen: vec![0; n_triangles],
            n_supports: 0,
            surface,
        }
    }

    /// The region of each triangle: a primitive, or a piece of the rest.
    fn regions(mut self) -> Vec<u32> {
        self.take_primitives();
        let of = |triangle: u32| self.owner[triangle as usize];
        let inside = self.surface.borders.iter().map(|border| border.between);
        let pieces = Partition::from_joined_pairs(
            self.surface.n_triangles(),
            inside.filter(|&[a, b]| of(a) == of(b)),
        );

        let regions = Region::of_pieces(&pieces, &self.surface.areas, &self.surface.borders);
        let ends = absorb_smaller_than(regions, self.min_area);
        pieces
            .parts()
            .iter()
            .map(|&piece| ends[piece as usize])
            .collect()
    }

    fn take_primitives(&mut self) {
        let mut n_trials = 0;
        let mut free_area = self.count_free();
        while free_area >= self.min_area && free_area > 0.0 {
            for _ in 0..TRIALS {
                self.propose(free_area);
            }
            n_trials += TRIALS;

            let best = self.best();
            let worth_taking = best.filter(|candidate| candidate.area >= self.min_area);
            let area = worth_taking.map_or(self.min_area, |candidate| candidate.area);
            let overlooked = (1.0 - MIN_STAY_PROBABILITY * area / free_area)
                .max(0.0)
                .powf(n_trials as f64);
            match worth_taking {
                _ if overlooked > MISS_PROBABILITY => {}
                Some(candidate) => {
                    self.take(&candidate);
                    free_area = self.count_free();
                }
                None => break,
            }
        }
    }

    /// Adds up the area of the free triangles.
    fn count_free(&mut self) -> f64 {
        let mut sum = 0.0;
        self.cumulative.clear();
        for (&area, &owner) in self.surface.areas.iter().zip(&self.owner) {
            sum += if owner == FREE { area } else { 0.0 };
            self.cumulative.push(sum);
        }
        sum
    }

    /// One trial: the primitives through a random triangle and two close to it.
    fn propose(&mut self, free_area: f64) {
        // 53 bits fill the mantissa of a number below 1.
        let fraction = (self.rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let at = fraction * free_area;
        let first = self.cumulative.partition_point(|&sum| sum <= at) as u32;
        if self.owner.get(first as usize) != Some(&FREE) {
            return;
        }
        let second = self.walk(first);
        let third = self.walk(second);

        let facets = [first, second, third].map(|triangle| self.facet(triangle));
        let [a, b, c] = &facets;
        let proposals = [
            Some(Primitive::plane(a)),
            Primitive::sphere(a, b, self.max_radius),
            Primitive::cylinder(a, b, self.max_radius),
            Primitive::cone([a, b, c]),
        ];
        for primitive in proposals.into_iter().flatten() {
            let side = dot(primitive.normal(centroid(a.corners)), a.normal).signum();
            let needs = if kind(&primitive) == 0 { 1 } else { 3 };
            let is_shared = [first, second, third][..needs]
                .iter()
                .all(|&triangle| self.fits(&primitive, side, triangle));
            let is_new = self.covered[first as usize][kind(&primitive)]
                < if needs == 1 { 1 } else { MAX_PROPOSALS };
            if is_shared && is_new {
                self.add_candidate(primitive, first, side);
            }
        }
    }

    /// A free triangle at the end of a short random walk.
    fn walk(&mut self, from: u32) -> u32 {
        let log_steps = below(&mut self.rng, MAX_LOG_STEPS + 1);
        let n_steps = 1 + below(&mut self.rng, 1 << log_steps);
        let mut at = from;
        for _ in 0..n_steps {
            let draw = below(&mut self.rng, self.surface.neighbors(at).len());
            let next = self.surface.neighbors(at).get(draw).copied();
            at = next
                .filter(|&next| self.owner[next as usize] == FREE)
                .unwrap_or(at);
        }
        at
    }

    fn facet(&self, triangle: u32) -> Facet {
        Facet {
            corners: self.mesh.corners(triangle as usize),
            normal: self.surface.normals[triangle as usize],
        }
    }

    /// Whether a triangle is on the primitive: all its corners are close, and its normal agrees, if it has one.
    fn fits(&self, primitive: &Primitive, side: f64, triangle: u32) -> bool {
        let corners = self.mesh.corners(triangle as usize);
        let is_close = corners
            .iter()
            .all(|&corner| primitive.distance(corner) <= self.max_distance);
        let normal = self.surface.normals[triangle as usize];
        let least = MAX_ANGLE_DEG.to_radians().cos();
        let agrees = || side * dot(primitive.normal(centroid(corners)), normal) >= least;
        is_close && (normal == [0.0; 3] || agrees())
    }

    fn add_candidate(&mut self, primitive: Primitive, first: u32, side: f64) {
        let mut primitive = primitive;
        let mut support = self.support(&primitive, first, side);
        if let Some(nearer) = self.refitted(&primitive, &support) {
            let of_nearer = self.support(&nearer, first, side);
            if self.area_of(&of_nearer) > self.area_of(&support) {
                (primitive, support) = (nearer, of_nearer);
            }
        }
        for &triangle in &support {
            let n_covering = &mut self.covered[triangle as usize][kind(&primitive)];
            *n_covering = n_covering.saturating_add(1);
        }
        let area = self.area_of(&support);
        if area >= self.min_area {
            self.candidates.push(Candidate {
                primitive,
                first,
                side,
                area,
                measured_after: self.n_taken,
            });
        }
    }

    /// A cone that is fitted to all corners of its support, if it is large enough to be taken.
    fn refitted(&self, primitive: &Primitive, support: &[u32]) -> Option<Primitive> {
        let is_cone = matches!(primitive, Primitive::Cone { .. });
        if !is_cone || self.area_of(support) < self.min_area {
            return None;
        }
        let corners = support
            .iter()
            .flat_map(|&triangle| self.mesh.corners(triangle as usize));
        refitted_cone(primitive, &corners.collect::<Vec<Point>>())
    }

    /// The free triangles on the primitive that are connected with the first one by chains of neighbors.
    fn support(&mut self, primitive: &Primitive, first: u32, side: f64) -> Vec<u32> {
        self.n_supports += 1;
        let mut support = vec![first];
        self.seen[first as usize] = self.n_supports;
        let mut n_done = 0;
        while let Some(&triangle) = support.get(n_done) {
            n_done += 1;
            for idx in 0..self.surface.neighbors(triangle).len() {
                let other = self.surface.neighbors(triangle)[idx];
                if self.seen[other as usize] == self.n_supports {
                    continue;
                }
                self.seen[other as usize] = self.n_supports;
                if self.owner[other as usize] == FREE && self.fits(primitive, side, other) {
                    support.push(other);
                }
            }
        }
        support
    }

    fn area_of(&self, triangles: &[u32]) -> f64 {
        triangles
            .iter()
            .map(|&triangle| self.surface.areas[triangle as usize])
            .sum()
    }

    /// The candidate with the largest worth on the triangles that are currently free. If several are equal, the first one is
    /// returned.
    fn best(&mut self) -> Option<Candidate> {
        loop {
            let (idx, best) =
                self.candidates
                    .iter()
                    .copied()
                    .enumerate()
                    .reduce(|best, other| {
                        if other.1.weighted_area() > best.1.weighted_area() {
                            other
                        } else {
                            best
                        }
                    })?;
            if best.measured_after == self.n_taken {
                return Some(best);
            }
            // Areas only decrease, so only the best old area has to be measured again.
            let support = self.support(&best.primitive, best.first, best.side);
            self.candidates[idx].area = self.area_of(&support);
            self.candidates[idx].measured_after = self.n_taken;
        }
    }

    fn take(&mut self, candidate: &Candidate) {
        for triangle in self.support(&candidate.primitive, candidate.first, candidate.side) {
            self.owner[triangle as usize] = self.n_taken;
        }
        self.n_taken += 1;
        let (owner, min_area) = (&self.owner, self.min_area);
        self.candidates
            .retain(|other| owner[other.first as usize] == FREE && other.area >= min_area);
        self.covered.fill([0; 4]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::tests::{cuboid, mesh_of, tube};
    use proptest::prelude::*;

    fn regions_of(triangles: &[[Point; 3]], fraction: f64, seed: u64) -> Vec<u32> {
        let mesh = mesh_of(triangles);
        Search::new(&mesh, fraction, keyed_rng(seed, &["test"])).regions()
    }

    #[track_caller]
    fn check(triangles: &[[Point; 3]], fraction: f64, n_expected: u32) {
        for seed in 0..5 {
            let regions = Partition::from_keys(&regions_of(triangles, fraction, seed));
            assert_eq!(regions.n_parts(), n_expected, "seed {seed}");
        }
    }

    #[test]
    fn faces_of_bodies_are_primitives() {
        check(&cuboid([0.0; 3], [1.0, 2.0, 3.0]), 0.01, 6);
        // Two sides have less area than the fraction and join others.
        check(&cuboid([0.0; 3], [1.0, 1.0, 9.0]), 0.1, 4);
        check(&tube(1.0, 2.0, 3.0, 24), 0.01, 4);
        check(
            &[cuboid([0.0; 3], [1.0; 3]), cuboid([5.0; 3], [1.0; 3])].concat(),
            0.01,
            12,
        );
    }

    /// A frustum around the z axis with a taper of 2.3°. Its facets are alternately wide and narrow, as if a hole had divided
    /// them.
    fn tapered(n: u32, unevenness: f64) -> Vec<[Point; 3]> {
        let at = |radius: f64, idx: u32, z: f64| {
            let shift = if idx % 2 == 1 { unevenness } else { 0.0 };
            let angle = std::f64::consts::TAU * (f64::from(idx % n) + shift) / f64::from(n);
            [radius * angle.cos(), radius * angle.sin(), z]
        };
        let mut triangles = Vec::new();
        for idx in 0..n {
            let [a, b, c, d] = [
                at(1.0, idx, 0.0),
                at(1.0, idx + 1, 0.0),
                at(0.9, idx + 1, 2.5),
                at(0.9, idx, 2.5),
            ];
            let (low, high) = ([0.0, 0.0, 0.0], [0.0, 0.0, 2.5]);
            triangles.extend([[a, b, c], [a, c, d], [b, a, low], [d, c, high]]);
        }
        triangles
    }

    #[test]
    fn a_slender_cone_is_one_primitive() {
        for unevenness in [0.0, 0.3, 0.6] {
            for n in [24, 48, 120] {
                check(&tapered(n, unevenness), 0.01, 3);
            }
        }
    }

    #[test]
    fn meshes_without_area_have_regions_too() {
        check(&[], 0.01, 0);
        check(&[[[0.0; 3]; 3]], 0.01, 1);
        check(&[[[f64::NAN; 3]; 3]], 0.01, 1);
        check(&[[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]], 0.01, 1);
    }

    proptest! {
        #[test]
        fn a_tube_is_two_cylinders_and_two_rings(
            n in 18u32..60,
            inner in 0.3f64..0.8,
            height in 0.5f64..4.0,
            seed in 0u64..50,
        ) {
            let regions = regions_of(&tube(inner, 1.0, height, n), 0.005, seed);
            for facet in regions.chunks(8) {
                prop_assert_eq!(facet, &regions[..8]);
            }
            let distinct: std::collections::BTreeSet<u32> = regions.into_iter().collect();
            prop_assert_eq!(distinct.len(), 4);
        }
    }
}
