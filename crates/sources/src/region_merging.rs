//! Merges the smallest regions of a mesh along their common borders until few enough are left.

use partprobe_carrier::{Mesh, Partition, WeldedMesh, distance, nearest_points, weld};
use std::collections::{BTreeMap, BTreeSet};

/// The common side of two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Border {
    /// The two triangles. The lower one comes first.
    pub between: [u32; 2],
    /// The two welded vertices at the ends of the side, the lower one first. In a cloud, they are the two points themselves.
    pub side: [u32; 2],
    /// Length of the side. It is 1 in a cloud.
    pub length: f64,
}

/// At sides with more triangles than this, each triangle is a neighbor of the next one only.
///
/// All pairs would be too many where thousands of triangles without area meet at one side.
const MAX_ALL_PAIRS: usize = 16;

/// The number of nearest points that are the neighbors of a point of a cloud.
const N_NEIGHBORS: usize = 8;

/// The pairs of triangles that share a side of the welded mesh, or the pairs of neighboring points of a cloud.
pub(crate) fn borders_of(mesh: &Mesh) -> Vec<Border> {
    if mesh.is_cloud() {
        borders_of_points(mesh)
    } else {
        welded_borders(&weld(mesh))
    }
}

/// The pairs of points in which one point is among the nearest points of the other.
fn borders_of_points(cloud: &Mesh) -> Vec<Border> {
    let points: Vec<_> = cloud
        .triangles
        .iter()
        .map(|&[vertex, ..]| cloud.vertices[vertex as usize])
        .collect();
    let mut pairs: Vec<[u32; 2]> = (0u32..)
        .zip(nearest_points(&points, N_NEIGHBORS))
        .flat_map(|(own, others)| {
            others
                .into_iter()
                .map(move |other| [own.min(other), own.max(other)])
        })
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    let border = |between| Border {
        between,
        side: between,
        length: 1.0,
    };
    pairs.into_iter().map(border).collect()
}

/// The pairs of triangles that share a side, in the order of the sides' vertices.
///
/// A side with more than two triangles gives all pairs of them, and a side with more than 16 triangles gives a chain of pairs.
#[must_use]
pub fn welded_borders(mesh: &WeldedMesh) -> Vec<Border> {
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * mesh.triangles.len());
    for (triangle, &[a, b, c]) in (0u32..).zip(&mesh.triangles) {
        sides.extend(
            [[a, b], [b, c], [c, a]].map(|[from, to]| ([from.min(to), from.max(to)], triangle)),
        );
    }
    sides.sort_unstable();
    let mut borders = Vec::new();
    for around in sides.chunk_by(|a, b| a.0 == b.0) {
        let side = around[0].0;
        let [from, to] = side;
        let length = distance(mesh.vertices[from as usize], mesh.vertices[to as usize]);
        let n_others = if around.len() > MAX_ALL_PAIRS {
            1
        } else {
            around.len()
        };
        for (n, &(_, first)) in around.iter().enumerate() {
            let others = around[n + 1..]
                .iter()
                .take(n_others)
                .filter(|&&(_, second)| second != first);
            borders.extend(others.map(|&(_, second)| Border {
                between: [first, second],
                side,
                length,
            }));
        }
    }
    borders
}

/// A connected piece of surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Region {
    pub(crate) area: f64,
    /// The length of the common border with each neighbor.
    pub(crate) neighbors: BTreeMap<u32, f64>,
}

impl Region {
    /// The regions that consist of these pieces of triangles.
    pub(crate) fn of_pieces(
        pieces: &Partition,
        triangle_areas: &[f64],
        borders: &[Border],
    ) -> Vec<Self> {
        let mut regions = vec![Self::default(); pieces.n_parts() as usize];
        for (&piece, &area) in pieces.parts().iter().zip(triangle_areas) {
            regions[piece as usize].area += area;
        }
        for border in borders {
            let [a, b] = border
                .between
                .map(|triangle| pieces.parts()[triangle as usize]);
            if a != b {
                *regions[a as usize].neighbors.entry(b).or_insert(0.0) += border.length;
                *regions[b as usize].neighbors.entry(a).or_insert(0.0) += border.length;
            }
        }
        regions
    }

    /// The neighbor with the longest common border. If several are equal, the lowest one is returned.
    fn closest_neighbor(&self) -> Option<u32> {
        let longest =
            self.neighbors
                .iter()
                .fold(
                    None,
                    |best: Option<(u32, f64)>, (&other, &length)| match best {
                        Some((_, longest)) if length <= longest => best,
                        _ => Some((other, length)),
                    },
                );
        longest.map(|(other, _)| other)
    }
}

/// Joins the smallest region to its closest neighbor until `n_max` regions are left. Returns the final region of each region.
pub(crate) fn merge_to_at_most(mut regions: Vec<Region>, n_max: usize) -> Vec<u32> {
    let mut into: Vec<u32> = (0..).take(regions.len()).collect();
    // Areas are not negative, so their bits have the same order as the areas.
    let mut by_area: BTreeSet<(u64, u32)> = into
        .iter()
        .map(|&region| (regions[region as usize].area.to_bits(), region))
        .collect();
    while by_area.len() > n_max.max(1) {
        let Some((_, smallest)) = by_area.pop_first() else {
            break;
        };
        let closest = regions[smallest as usize].closest_neighbor();
        let Some(host) = closest.or_else(|| by_area.last().map(|&(_, largest)| largest)) else {
            break;
        };
        by_area.remove(&(regions[host as usize].area.to_bits(), host));
        absorb(&mut regions, host, smallest);
        by_area.insert((regions[host as usize].area.to_bits(), host));
        into[smallest as usize] = host;
    }
    ends_of(into)
}

/// Joins each region below this area to its closest neighbor, the smallest first. Returns the final region of each region.
///
/// A region without neighbors is kept, even if it is small.
pub(crate) fn absorb_smaller_than(mut regions: Vec<Region>, min_area: f64) -> Vec<u32> {
    let mut into: Vec<u32> = (0..).take(regions.len()).collect();
    // Areas are not negative, so their bits have the same order as the areas.
    let mut small: BTreeSet<(u64, u32)> = into
        .iter()
        .map(|&region| (regions[region as usize].area.to_bits(), region))
        .filter(|&(bits, _)| f64::from_bits(bits) < min_area)
        .collect();
    while let Some((_, smallest)) = small.pop_first() {
        let Some(host) = regions[smallest as usize].closest_neighbor() else {
            continue;
        };
        let was_small = small.remove(&(regions[host as usize].area.to_bits(), host));
        absorb(&mut regions, host, smallest);
        let area = regions[host as usize].area;
        if was_small && area < min_area {
            small.insert((area.to_bits(), host));
        }
        into[smallest as usize] = host;
    }
    ends_of(into)
}

/// Follows each region to the last region that it has joined.
fn ends_of(mut into: Vec<u32>) -> Vec<u32> {
    for region in 0..into.len() {
        let mut end = into[region];
        while into[end as usize] != end {
            end = into[end as usize];
        }
        into[region] = end;
    }
    into
}

/// Adds the area and the borders of `from` to `host`.
fn absorb(regions: &mut [Region], host: u32, from: u32) {
    let gone = std::mem::take(&mut regions[from as usize]);
    regions[host as usize].area += gone.area;
    regions[host as usize].neighbors.remove(&from);
    for (other, length) in gone.neighbors {
        let neighbors_of_other = &mut regions[other as usize].neighbors;
        neighbors_of_other.remove(&from);
        if other != host {
            *neighbors_of_other.entry(host).or_insert(0.0) += length;
            *regions[host as usize].neighbors.entry(other).or_insert(0.0) += length;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(areas: &[f64], borders: &[(u32, u32, f64)], n_max: usize, expected: &[u32]) {
        assert_eq!(merge_to_at_most(regions(areas, borders), n_max), expected);
    }

    fn regions(areas: &[f64], borders: &[(u32, u32, f64)]) -> Vec<Region> {
        let pieces = Partition::from_keys(&(0..areas.len()).collect::<Vec<_>>());
        let borders: Vec<Border> = borders
            .iter()
            .map(|&(a, b, length)| Border {
                between: [a, b],
                side: [0, 0],
                length,
            })
            .collect();
        Region::of_pieces(&pieces, areas, &borders)
    }

    #[test]
    fn the_smallest_joins_its_longest_border() {
        check(&[], &[], 3, &[]);
        check(&[5.0, 1.0, 9.0], &[(0, 1, 1.0), (1, 2, 2.0)], 3, &[0, 1, 2]);
        check(&[5.0, 1.0, 9.0], &[(0, 1, 1.0), (1, 2, 2.0)], 2, &[0, 2, 2]);
        check(&[5.0, 1.0, 9.0], &[(0, 1, 2.0), (1, 2, 2.0)], 2, &[0, 0, 2]);
        // Region 1 joins 0, whose border with 2 is then 2 + 3. Region 3 is larger and remains.
        check(
            &[2.0, 1.0, 9.0, 6.0],
            &[(0, 1, 5.0), (1, 2, 2.0), (0, 2, 3.0), (0, 3, 4.0)],
            2,
            &[2, 2, 2, 3],
        );
        check(&[5.0, 1.0, 9.0], &[], 2, &[0, 2, 2]);
        check(&[5.0, 1.0, 9.0], &[], 0, &[2, 2, 2]);
    }

    #[test]
    fn what_is_too_small_joins_a_neighbor() {
        let check = |areas: &[f64], borders: &[(u32, u32, f64)], expected: &[u32]| {
            assert_eq!(absorb_smaller_than(regions(areas, borders), 3.0), expected);
        };
        check(&[], &[], &[]);
        check(&[5.0, 1.0, 9.0], &[(0, 1, 1.0), (1, 2, 2.0)], &[0, 2, 2]);
        // Two small regions together are large enough.
        check(&[2.0, 1.0, 9.0], &[(0, 1, 5.0), (0, 2, 1.0)], &[0, 0, 2]);
        check(&[1.0, 1.0, 9.0], &[(0, 1, 5.0), (1, 2, 1.0)], &[2, 2, 2]);
        check(&[1.0, 9.0], &[], &[0, 1]);
    }

    #[test]
    fn borders_are_found_across_faces_and_at_non_manifold_sides() {
        let vertices = vec![
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, -1.0, 0.0],
        ];
        let triangles = vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]];
        let borders = welded_borders(&WeldedMesh {
            vertices,
            triangles,
        });
        let pairs: Vec<[u32; 2]> = borders.iter().map(|border| border.between).collect();
        assert_eq!(pairs, [[0, 1], [0, 2], [1, 2]]);
        assert!(borders.iter().all(|border| border.length == 2.0));
    }

    proptest! {
        #[test]
        fn the_bound_holds_and_each_end_is_its_own(
            areas in proptest::collection::vec(0.0f64..9.0, 1..25),
            pairs in proptest::collection::vec((0u32..25, 0u32..25, 0.1f64..3.0), 0..60),
            n_max in 1usize..30,
        ) {
            let n = areas.len() as u32;
            let pairs: Vec<_> = pairs.into_iter().map(|(a, b, length)| (a % n, b % n, length)).collect();
            let ends = merge_to_at_most(regions(&areas, &pairs), n_max);
            let distinct: BTreeSet<u32> = ends.iter().copied().collect();
            prop_assert_eq!(distinct.len(), n_max.min(areas.len()));
            prop_assert!(ends.iter().all(|&end| ends[end as usize] == end));
        }
    }
}
