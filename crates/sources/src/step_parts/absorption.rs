//! Absorbs parts that have too few triangles (STEP-Parts, section 3.3, τ_min).
//!
//! A partition of the faces and a mesh go in, and a coarser partition comes out. The mesh is not changed.

use partprobe_carrier::{FaceGraph, Mesh, Partition, REFINE_FRACTION, refined_triangle_counts};
use std::collections::BTreeMap;

/// Absorbs parts with fewer than `tau_min` triangles on the refined carrier, smallest first.
///
/// A small part is joined to the neighbor with the longest common boundary among those that are not small. If two boundaries are
/// equally long, the part with the lower number is chosen. A part without such a neighbor is kept.
#[must_use]
pub fn absorb_small_parts(
    mesh: &Mesh,
    graph: &FaceGraph,
    partition: &Partition,
    tau_min: u32,
) -> Partition {
    let max_edge = mesh.diagonal() * REFINE_FRACTION;
    absorb_parts_below(mesh, graph, partition, tau_min, max_edge)
}

/// The same, with triangles counted on the carrier whose longest edge is `max_edge` millimeters.
///
/// If `max_edge` is infinite, the triangles of `mesh` itself are counted.
#[must_use]
pub fn absorb_parts_below(
    mesh: &Mesh,
    graph: &FaceGraph,
    partition: &Partition,
    tau_min: u32,
    max_edge: f64,
) -> Partition {
    // Counting stops at τ_min: the exact size of a large part does not matter.
    let sizes = refined_triangle_counts(mesh, partition.parts(), max_edge, tau_min);
    let absorber = absorbers(graph, partition, &sizes, tau_min);
    let labels: Vec<u32> = partition
        .parts()
        .iter()
        .map(|&part| absorber[part as usize])
        .collect();
    Partition::from_keys(&labels)
}

/// The part into which each part is absorbed.
fn absorbers(graph: &FaceGraph, partition: &Partition, sizes: &[u32], tau_min: u32) -> Vec<u32> {
    let mut borders = vec![BTreeMap::new(); sizes.len()];
    for (a, b, length) in graph.boundary_lengths(partition.parts()) {
        borders[a as usize].insert(b, length);
        borders[b as usize].insert(a, length);
    }
    let mut small: Vec<u32> = (0..partition.n_parts())
        .filter(|&part| sizes[part as usize] < tau_min)
        .collect();
    small.sort_by_key(|&part| (sizes[part as usize], part));
    let mut absorber: Vec<u32> = (0..partition.n_parts()).collect();
    // Only parts that were large from the start absorb, so the order of absorption cannot chain small parts.
    for part in small {
        let large = borders[part as usize]
            .iter()
            .filter(|&(&other, _)| tau_min <= sizes[other as usize]);
        let best = large.fold(
            None,
            |best: Option<(u32, f64)>, (&other, &length)| match best {
                Some((_, longest)) if length <= longest => best,
                _ => Some((other, length)),
            },
        );
        if let Some((other, _)) = best {
            absorber[part as usize] = other;
        }
    }
    absorber
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::{Edge, Face, FaceType};

    #[track_caller]
    fn check(sizes: &[u32], edges: &[(u32, u32, f64)], expected: &[u32]) {
        let n = sizes.len();
        let face = Face::new(0, FaceType::Plane, 1.0);
        let edges = edges
            .iter()
            .map(|&(a, b, length)| Edge {
                faces: [a, b],
                phi: 90.0,
                length,
            })
            .collect();
        let graph = FaceGraph {
            faces: vec![face; n],
            edges,
        };
        let partition = Partition::from_joined_pairs(n, []);
        assert_eq!(absorbers(&graph, &partition, sizes, 20), expected);
    }

    #[test]
    fn small_parts_go_to_the_longest_large_border() {
        check(&[30, 5, 40], &[(0, 1, 1.0), (1, 2, 2.0)], &[0, 2, 2]);
        check(&[30, 5, 40], &[(0, 1, 2.0), (1, 2, 2.0)], &[0, 0, 2]);
        check(&[30, 5, 5], &[(0, 1, 1.0), (1, 2, 9.0)], &[0, 0, 2]);
        check(&[5, 5], &[(0, 1, 1.0)], &[0, 1]);
        check(&[20, 19], &[(0, 1, 1.0)], &[0, 0]);
    }
}
