//! Finds which triangles of two surfaces have the same corners: channel `triangle`.
//!
//! Some tools merge vertices, drop faces or reorder them. Then triangles cannot be matched by their indices, but they can still
//! be matched by the positions of their corners.

use crate::box_tree::{Bounds, BoxTree};
use crate::surface::Surface;
use partprobe_carrier::{Point, centroid, distance};

/// For each triangle of one surface, the triangles of another with the same corners.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TriangleMatch {
    /// For each triangle, the lowest labeled triangle with the same corners, or `None`.
    pub source_of: Vec<Option<u32>>,
    /// Triangles with the same corners as several labeled triangles, and the list of these.
    pub several: Vec<(u32, Vec<u32>)>,
    /// The number of labeled triangles whose corners no triangle of the other surface has.
    pub n_unused: usize,
}

/// Finds the triangles of `labeled` that have the corners of each triangle of `target`, in any order, each corner within
/// `tolerance`.
#[must_use]
pub fn match_triangles(labeled: Surface<'_>, target: Surface<'_>, tolerance: f64) -> TriangleMatch {
    let n_labeled = labeled.triangles().len();
    let corners: Vec<[Point; 3]> = (0..n_labeled)
        .map(|triangle| labeled.corners(triangle))
        .collect();
    let bounds: Vec<Bounds> = corners
        .iter()
        .map(|&corners| Bounds::around(&[centroid(corners)]))
        .collect();
    let tree = BoxTree::new(&bounds);

    let mut is_used = vec![false; n_labeled];
    let mut matched = TriangleMatch {
        source_of: Vec::with_capacity(target.triangles().len()),
        several: Vec::new(),
        n_unused: 0,
    };
    for triangle in 0..target.triangles().len() {
        let own = target.corners(triangle);
        let mut equal = Vec::new();
        let center = centroid(own);
        // The visitor never reports a result, so the search visits every triangle whose centroid is near enough.
        let visit = |_, item: u32| {
            if same_corners(own, corners[item as usize], tolerance) {
                equal.push(item);
            }
            None
        };
        // The mean of three distances is at most the tolerance. Rounding may add a little.
        let reach = tolerance * (1.0 + 1e-9);
        tree.nearest(center, reach * reach, None, visit);

        equal.sort_unstable();
        equal.iter().for_each(|&item| is_used[item as usize] = true);
        matched.source_of.push(equal.first().copied());
        if equal.len() > 1 {
            matched.several.push((triangle as u32, equal));
        }
    }
    matched.n_unused = is_used.iter().filter(|&&used| !used).count();
    matched
}

fn same_corners(own: [Point; 3], [a, b, c]: [Point; 3], tolerance: f64) -> bool {
    let orders = [
        [a, b, c],
        [b, c, a],
        [c, a, b],
        [a, c, b],
        [c, b, a],
        [b, a, c],
    ];
    orders.iter().any(|order| {
        own.iter()
            .zip(order)
            .all(|(&corner, &other)| distance(corner, other) <= tolerance)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const VERTICES: [Point; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

    #[track_caller]
    fn check(labeled: &[[u32; 3]], target: &[[u32; 3]], expected: &TriangleMatch) {
        let moved = VERTICES.map(|[x, y, z]| [x + 1e-4, y, z - 1e-4]);
        let labeled = Surface::new(&moved, labeled).unwrap();
        let target = Surface::new(&VERTICES, target).unwrap();
        assert_eq!(&match_triangles(labeled, target, 1e-3), expected);
        let none = match_triangles(labeled, target, 1e-5);
        assert!(none.source_of.iter().all(Option::is_none));
    }

    #[test]
    fn order_and_orientation_do_not_matter() {
        let expected = TriangleMatch {
            source_of: vec![Some(1), Some(0), None],
            several: vec![],
            n_unused: 1,
        };
        check(
            &[[2, 0, 3], [1, 0, 2], [0, 1, 3]],
            &[[0, 1, 2], [0, 2, 3], [1, 2, 3]],
            &expected,
        );
    }

    #[test]
    fn a_triangle_that_is_there_twice_is_named() {
        let expected = TriangleMatch {
            source_of: vec![Some(0)],
            several: vec![(0, vec![0, 1])],
            n_unused: 0,
        };
        check(&[[0, 1, 2], [2, 1, 0]], &[[1, 2, 0]], &expected);
    }
}
