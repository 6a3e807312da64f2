//! Computes a Variational Shape Approximation of at most K connected regions that are nearly flat: `vsa-<K>`.
//!
//! Only the mesh is used. Each region has a proxy, which is a unit normal. The regions are chosen so that the normals of the
//! triangles differ little from their proxies (Cohen-Steiner, Alliez, Desbrun 2004, with the L2,1 metric of section 2.3). A flat
//! face becomes one region, and a cylinder is divided into strips.
//!
//! Two choices differ from the publication. The queue of the region growing sorts by the squared difference of the normals
//! without the area, because the triangles of a CAD mesh differ in area by orders of magnitude. The result is the regions of the
//! round with the smallest error, because a round of region growing may raise the error.

use crate::factory::SourceFactory;
use crate::source::SourceLabels;
use crate::surface::Surface;
use partprobe_carrier::{Point, Rng, dot, keyed_rng, subtract};
use rand::Rng as _;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Largest number of rounds of proxy update and region growing. Most shapes are stable after five.
const MAX_ROUNDS: usize = 20;

/// Normals with a smaller squared difference than this count as equal, because the normals of coplanar triangles differ by
/// rounding.
const FLAT: f64 = 1e-10;

/// Marks a triangle that no region has reached.
const NO_REGION: u32 = u32::MAX;

/// A flat face gets one label, so a shape with fewer flat faces than K has fewer labels.
pub(crate) const VSA: SourceFactory = SourceFactory::numbered_rule(
    "vsa-<K>",
    "connected regions of nearly equal triangle normals (Variational Shape Approximation), at most K labels",
    1..=1000,
    |carrier, n_max, seed| {
        let mut rng = keyed_rng(seed, &["vsa", &carrier.meta().id]);
        let surface = Surface::of(carrier.mesh());
        let regions = approximation(&surface, n_max as usize, &mut rng);
        Ok(SourceLabels::of_regions(&regions))
    },
);

/// The region of each triangle.
fn approximation(surface: &Surface, n_max: usize, rng: &mut Rng) -> Vec<u32> {
    let mut seeds = Seeding::new(surface).seeds(n_max, rng);
    let mut proxies: Vec<Point> = seeds
        .iter()
        .map(|&seed| surface.normals[seed as usize])
        .collect();
    let mut best = (f64::INFINITY, Vec::new());

    for _ in 0..MAX_ROUNDS {
        let regions = grown(surface, &seeds, &proxies);
        fit(surface, &regions, &mut proxies);
        let error = total_error(surface, &regions, &proxies);
        if error >= best.0 {
            break;
        }
        seeds = closest_triangles(surface, &regions, &proxies, &seeds);
        best = (error, regions);
    }

    // If a mesh has more than K components, the smaller ones join the largest one.
    let in_largest = |&region: &u32| if region == NO_REGION { 0 } else { region };
    best.1.iter().map(in_largest).collect()
}

/// The squared difference of a triangle's normal and a proxy, from 0 to 4. A triangle without an area fits every proxy.
fn difference(normal: Point, proxy: Point) -> f64 {
    if normal == [0.0; 3] {
        return 0.0;
    }
    let apart = subtract(normal, proxy);
    dot(apart, apart)
}

/// Chooses triangles one at a time, each different from the previous ones.
struct Seeding<'a> {
    surface: &'a Surface,
    seeds: Vec<u32>,
    /// For each triangle, the index of the seed with whose normal it is compared.
    nearest: Vec<u32>,
    /// The largest difference between a normal and that of the seed, on the path from the seed to the triangle.
    distance: Vec<f64>,
}

impl<'a> Seeding<'a> {
    fn new(surface: &'a Surface) -> Self {
        Self {
            surface,
            seeds: Vec::new(),
            nearest: vec![NO_REGION; surface.n_triangles()],
            distance: vec![f64::INFINITY; surface.n_triangles()],
        }
    }

    /// First a random triangle of each component, beginning with the largest component. Then the farthest triangles, as long as
    /// there are any.
    fn seeds(mut self, n_max: usize, rng: &mut Rng) -> Vec<u32> {
        for component in largest_first(self.surface, n_max) {
            let seed = drawn_by_area(&component, &self.surface.areas, rng);
            self.add(seed);
        }
        while self.seeds.len() < n_max {
            let Some(seed) = self.farthest() else {
                break;
            };
            self.add(seed);
        }
        self.seeds
    }

    /// The triangle with the largest error in the region with the largest error. If several are equal, the lowest one is
    /// returned.
    fn farthest(&self) -> Option<u32> {
        let error_of = |triangle: usize| {
            let distance = self.distance[triangle];
            if distance.is_finite() && distance > FLAT {
                self.surface.areas[triangle] * distance
            } else {
                0.0
            }
        };
        let mut totals = vec![0.0; self.seeds.len()];
        for (triangle, &nearest) in self.nearest.iter().enumerate() {
            if nearest != NO_REGION {
                totals[nearest as usize] += error_of(triangle);
            }
        }

        let (worst, _) = first_largest(totals.into_iter())?;
        let errors = self.nearest.iter().enumerate().map(|(triangle, &nearest)| {
            if nearest as usize == worst {
                error_of(triangle)
            } else {
                0.0
            }
        });
        first_largest(errors).map(|(triangle, _)| triangle as u32)
    }

    /// Adds a seed, and assigns to it the triangles that are closer to it than to all previous seeds.
    fn add(&mut self, seed: u32) {
        let idx = self.seeds.len() as u32;
        let proxy = self.surface.normals[seed as usize];
        self.seeds.push(seed);
        let mut open = BinaryHeap::from([Reverse((0, seed))]);

        while let Some(Reverse((bits, triangle))) = open.pop() {
            let distance = f64::from_bits(bits);
            if distance >= self.distance[triangle as usize] {
                continue;
            }
            self.distance[triangle as usize] = distance;
            self.nearest[triangle as usize] = idx;

            for &other in self.surface.neighbors(triangle) {
                let step = difference(self.surface.normals[other as usize], proxy);
                let along = distance.max(step);
                if along < self.distance[other as usize] {
                    // Differences are not negative, so their bits have the same order as the differences.
                    open.push(Reverse((along.to_bits(), other)));
                }
            }
        }
    }
}

/// The index and the value of the first largest number above 0.
fn first_largest(values: impl Iterator<Item = f64>) -> Option<(usize, f64)> {
    let larger = |best: Option<(usize, f64)>, (idx, value): (usize, f64)| {
        let is_larger = value > best.map_or(0.0, |(_, value)| value);
        if is_larger { Some((idx, value)) } else { best }
    };
    values.enumerate().fold(None, larger)
}

/// The triangles of the `n_max` components with the largest areas.
fn largest_first(surface: &Surface, n_max: usize) -> Vec<Vec<u32>> {
    let components = surface.components();
    let mut members = vec![Vec::new(); components.n_parts() as usize];
    let mut areas = vec![0.0; members.len()];
    for (triangle, &component) in (0u32..).zip(components.parts()) {
        members[component as usize].push(triangle);
        areas[component as usize] += surface.areas[triangle as usize];
    }

    let mut order: Vec<usize> = (0..members.len()).collect();
    order.sort_by(|&a, &b| f64::total_cmp(&areas[b], &areas[a]));
    order.truncate(n_max);
    order
        .into_iter()
        .map(|component| std::mem::take(&mut members[component]))
        .collect()
}

/// One of these triangles, with a probability proportional to its area, or the first one if no triangle has an area.
fn drawn_by_area(triangles: &[u32], areas: &[f64], rng: &mut Rng) -> u32 {
    let area_of = |triangle: &u32| areas[*triangle as usize];
    let total: f64 = triangles.iter().map(area_of).sum();
    // 53 bits fill the mantissa of a number below 1.
    let fraction = (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let mut rest = fraction * total;
    let drawn = triangles.iter().find(|triangle| {
        rest -= area_of(triangle);
        rest < 0.0
    });
    drawn.or(triangles.first()).copied().unwrap_or(0)
}

/// Grows all regions at once from their seeds. The next triangle is always the one that differs least from an adjacent region.
fn grown(surface: &Surface, seeds: &[u32], proxies: &[Point]) -> Vec<u32> {
    let mut regions = vec![NO_REGION; surface.n_triangles()];
    let mut open = BinaryHeap::new();
    for (region, &seed) in (0u32..).zip(seeds) {
        regions[seed as usize] = region;
    }
    for (region, &seed) in (0u32..).zip(seeds) {
        propose_neighbors(surface, &regions, (seed, region), proxies, &mut open);
    }

    while let Some(Reverse((_, triangle, region))) = open.pop() {
        if regions[triangle as usize] == NO_REGION {
            regions[triangle as usize] = region;
            propose_neighbors(surface, &regions, (triangle, region), proxies, &mut open);
        }
    }
    regions
}

/// A difference as bits, a triangle, and the region that it may join.
type Candidate = Reverse<(u64, u32, u32)>;

fn propose_neighbors(
    surface: &Surface,
    regions: &[u32],
    (triangle, region): (u32, u32),
    proxies: &[Point],
    open: &mut BinaryHeap<Candidate>,
) {
    for &other in surface.neighbors(triangle) {
        if regions[other as usize] == NO_REGION {
            let normal = surface.normals[other as usize];
            let bits = difference(normal, proxies[region as usize]).to_bits();
            open.push(Reverse((bits, other, region)));
        }
    }
}

/// Sets the proxy of each region to its mean normal, weighted by area. A region whose normals cancel keeps its proxy.
fn fit(surface: &Surface, regions: &[u32], proxies: &mut [Point]) {
    let mut sums = vec![[0.0; 3]; proxies.len()];
    for (triangle, &region) in regions.iter().enumerate() {
        if region != NO_REGION {
            let (normal, area) = (surface.normals[triangle], surface.areas[triangle]);
            let sum = &mut sums[region as usize];
            *sum = [0, 1, 2].map(|axis| sum[axis] + area * normal[axis]);
        }
    }
    for (proxy, sum) in proxies.iter_mut().zip(sums) {
        let length = dot(sum, sum).sqrt();
        if length > 0.0 && length.is_finite() {
            *proxy = sum.map(|x| x / length);
        }
    }
}

/// The L2,1 error: the squared differences to the proxies, each times the triangle's area.
fn total_error(surface: &Surface, regions: &[u32], proxies: &[Point]) -> f64 {
    let of_triangle = |(triangle, &region): (usize, &u32)| match proxies.get(region as usize) {
        Some(&proxy) => surface.areas[triangle] * difference(surface.normals[triangle], proxy),
        None => 0.0,
    };
    regions.iter().enumerate().map(of_triangle).sum()
}

/// The triangle of each region that differs least from its proxy. It is the seed of the next round.
fn closest_triangles(
    surface: &Surface,
    regions: &[u32],
    proxies: &[Point],
    seeds: &[u32],
) -> Vec<u32> {
    let mut closest: Vec<(f64, u32)> = seeds.iter().map(|&seed| (f64::INFINITY, seed)).collect();
    for (triangle, &region) in (0u32..).zip(regions) {
        let normal = surface.normals[triangle as usize];
        if region == NO_REGION || normal == [0.0; 3] {
            continue;
        }
        let apart = difference(normal, proxies[region as usize]);
        let best = &mut closest[region as usize];
        if apart < best.0 {
            *best = (apart, triangle);
        }
    }
    closest.into_iter().map(|(_, triangle)| triangle).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::tests::{cuboid, mesh_of, tube};
    use partprobe_carrier::Partition;
    use proptest::prelude::*;

    fn regions_of(triangles: &[[Point; 3]], n_max: usize, seed: u64) -> (Surface, Partition) {
        let surface = Surface::of(&mesh_of(triangles));
        let regions = approximation(&surface, n_max, &mut keyed_rng(seed, &["test"]));
        (surface, Partition::from_keys(&regions))
    }

    #[track_caller]
    fn check(triangles: &[[Point; 3]], n_max: usize, n_expected: u32) {
        for seed in 0..10 {
            let (_, regions) = regions_of(triangles, n_max, seed);
            assert_eq!(regions.n_parts(), n_expected, "seed {seed}");
        }
    }

    #[test]
    fn a_flat_face_is_one_region() {
        let cube = cuboid([0.0; 3], [1.0; 3]);
        check(&cube, 6, 6);
        // Coplanar triangles are in one region, even if K exceeds the number of triangles.
        check(&cube, 1000, 6);
        check(&cube, 1, 1);
        check(&cube, 3, 3);
        let (_, regions) = regions_of(&cube, 6, 0);
        assert_eq!(regions.parts(), [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]);
    }

    #[test]
    fn each_component_has_a_region_while_there_are_enough() {
        let cubes: Vec<_> = (0..4)
            .flat_map(|n| cuboid([3.0 * f64::from(n), 0.0, 0.0], [f64::from(n + 1); 3]))
            .collect();
        check(&cubes, 100, 24);
        check(&cubes, 4, 4);
        // Two cubes without a region join the largest one, which is the last cube.
        check(&cubes, 2, 2);
        let (_, regions) = regions_of(&cubes, 2, 0);
        assert_eq!(regions.parts()[0], regions.parts()[47]);
        assert_ne!(regions.parts()[0], regions.parts()[24]);
    }

    #[test]
    fn meshes_without_area_have_regions_too() {
        check(&[], 5, 0);
        check(&[[[0.0; 3]; 3]], 5, 1);
        check(&[[[f64::NAN; 3]; 3]], 5, 1);
        let mut cube = cuboid([0.0; 3], [1.0; 3]);
        // A needle at an edge of the cube belongs to one of the sides at this edge.
        cube.push([[0.0; 3], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]]);
        check(&cube, 1000, 6);
    }

    /// Whether each region is connected.
    fn are_connected(surface: &Surface, regions: &Partition) -> bool {
        let of = |triangle: u32| regions.parts()[triangle as usize];
        let inside = surface.borders.iter().map(|border| border.between);
        let pieces = Partition::from_joined_pairs(
            surface.n_triangles(),
            inside.filter(|&[a, b]| of(a) == of(b)),
        );
        pieces.n_parts() == regions.n_parts()
    }

    proptest! {
        #[test]
        fn a_tube_has_whole_rings_and_connected_strips(n in 6u32..40, n_max in 12usize..60, seed in 0u64..50) {
            let triangles = tube(1.0, 2.0, 3.0, n);
            let (surface, regions) = regions_of(&triangles, n_max, seed);
            prop_assert!(regions.n_parts() as usize <= n_max);
            prop_assert!(are_connected(&surface, &regions));
            // The shape consists of 2 rings and 2 n flat facets.
            prop_assert_eq!(regions.n_parts() as usize, n_max.min(2 * n as usize + 2));
            for ring in [4, 6] {
                let labels = (0..n as usize).map(|idx| regions.parts()[8 * idx + ring]);
                let distinct: std::collections::BTreeSet<u32> = labels.collect();
                prop_assert_eq!(distinct.len(), 1);
            }
        }

        #[test]
        fn more_regions_leave_less_error(n in 6u32..40, seed in 0u64..50) {
            let triangles = tube(1.0, 2.0, 3.0, n);
            let error = |n_max: usize| {
                let (surface, regions) = regions_of(&triangles, n_max, seed);
                let mut proxies = vec![[0.0; 3]; regions.n_parts() as usize];
                fit(&surface, regions.parts(), &mut proxies);
                total_error(&surface, regions.parts(), &proxies)
            };
            prop_assert!(error(40) < error(8) && error(8) < error(2));
            prop_assert!(error(1000) < 1e-9);
        }
    }
}
