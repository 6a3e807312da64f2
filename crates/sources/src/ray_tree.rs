//! Finds the first triangle that a ray meets, by a tree of bounding boxes over the triangles of a mesh.
//!
//! Takes triangles, then rays. Returns the distance and the triangle. A triangle without area or with a coordinate that is not
//! finite is never met. At equal distances, the triangle that the tree visits first is met. This is always the same one.

use partprobe_carrier::{Mesh, Point, cross, dot, subtract};

/// Largest number of triangles in a leaf of the tree.
const LEAF: usize = 4;

/// The triangle that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// The distance from the origin of the ray, in units of the length of its direction.
    pub(crate) distance: f64,
    /// The triangle of the mesh.
    pub(crate) triangle: u32,
}

/// A corner and the two sides that begin there.
#[derive(Clone, Copy, Debug)]
struct Target {
    corner: Point,
    sides: [Point; 2],
    triangle: u32,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Point,
    high: Point,
    /// The first target of a leaf, or the right child. The left child is the next node.
    at: u32,
    /// The number of targets of a leaf. It is 0 for an inner node.
    n_targets: u32,
}

/// The triangles of a mesh, sorted so that only few of them are tested per ray.
#[derive(Clone, Debug, Default)]
pub(crate) struct RayTree {
    nodes: Vec<Node>,
    targets: Vec<Target>,
}

impl RayTree {
    /// Sorts the triangles that have finite coordinates.
    pub(crate) fn of(mesh: &Mesh) -> Self {
        let target = |(triangle, corners): (u32, [Point; 3])| {
            let [a, b, c] = corners;
            let is_finite = corners.iter().flatten().all(|x| x.is_finite());
            is_finite.then(|| Target {
                corner: a,
                sides: [subtract(b, a), subtract(c, a)],
                triangle,
            })
        };
        let corners = (0..mesh.triangles.len()).map(|triangle| mesh.corners(triangle));
        let mut tree = Self {
            nodes: Vec::new(),
            targets: (0..).zip(corners).filter_map(target).collect(),
        };
        tree.build();
        tree
    }

    /// Halves the triangles repeatedly, at their middle along the longest side of their box.
    fn build(&mut self) {
        if self.targets.is_empty() {
            return;
        }
        // A range of targets, and the node whose right child it is.
        let mut open = vec![(0, self.targets.len(), None)];
        while let Some((from, to, parent)) = open.pop() {
            let idx = self.nodes.len() as u32;
            if let Some(parent) = parent {
                let parent: &mut Node = &mut self.nodes[parent as usize];
                parent.at = idx;
            }
            let targets = &mut self.targets[from..to];
            let (low, high) = bounds(targets);
            let is_leaf = targets.len() <= LEAF;
            self.nodes.push(Node {
                low,
                high,
                at: from as u32,
                n_targets: if is_leaf { targets.len() as u32 } else { 0 },
            });
            if is_leaf {
                continue;
            }
            let axis = longest_axis(low, high);
            let middle = targets.len() / 2;
            targets.select_nth_unstable_by(middle, |a, b| {
                let order = a.middle(axis).total_cmp(&b.middle(axis));
                order.then(a.triangle.cmp(&b.triangle))
            });
            // The last range that is pushed is the next node: the left child.
            open.push((from + middle, to, Some(idx)));
            open.push((from, from + middle, None));
        }
    }

    /// The nearest triangle in a direction that is farther away than `least`. One triangle is left out.
    pub(crate) fn first_hit(
        &self,
        origin: Point,
        direction: Point,
        least: f64,
        apart_from: u32,
    ) -> Option<Hit> {
        let inverse = direction.map(|x| 1.0 / x);
        let mut best: Option<Hit> = None;
        let mut open = [0u32; 64];
        let mut n_open = 1;
        while n_open > 0 {
            n_open -= 1;
            let idx = open[n_open];
            let Some(node) = self.nodes.get(idx as usize) else {
                continue;
            };
            let limit = best.map_or(f64::INFINITY, |hit| hit.distance);
            if entry(node, origin, inverse, limit).is_none() {
                continue;
            }
            if node.n_targets == 0 {
                let children = [idx + 1, node.at];
                let entries = children
                    .map(|child| entry(&self.nodes[child as usize], origin, inverse, limit));
                let is_right_nearer = match entries {
                    [Some(left), Some(right)] => right < left,
                    [left, _] => left.is_none(),
                };
                let [far, near] = if is_right_nearer { [0, 1] } else { [1, 0] };
                for side in [far, near] {
                    if entries[side].is_some() {
                        open[n_open] = children[side];
                        n_open += 1;
                    }
                }
                continue;
            }

            let from = node.at as usize;
            for target in &self.targets[from..from + node.n_targets as usize] {
                let distance = target.distance(origin, direction);
                let is_nearer = best.is_none_or(|hit| distance < hit.distance);
                if distance > least && is_nearer && target.triangle != apart_from {
                    best = Some(Hit {
                        distance,
                        triangle: target.triangle,
                    });
                }
            }
        }
        best
    }
}

impl Target {
    /// Three times the centroid's coordinate on an axis.
    fn middle(&self, axis: usize) -> f64 {
        3.0 * self.corner[axis] + self.sides[0][axis] + self.sides[1][axis]
    }

    /// The distance at which the ray meets the triangle (Möller, Trumbore 1997), or -1 if it does not.
    fn distance(&self, origin: Point, direction: Point) -> f64 {
        let [u, v] = self.sides;
        let across = cross(direction, v);
        let volume = dot(u, across);
        let inverse = 1.0 / volume;
        let from_corner = subtract(origin, self.corner);
        let s = inverse * dot(from_corner, across);
        let perpendicular = cross(from_corner, u);
        let t = inverse * dot(direction, perpendicular);
        // If the ray is parallel or there is no area, the values are NaN, and every comparison with NaN is false.
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            inverse * dot(v, perpendicular)
        } else {
            -1.0
        }
    }
}

/// The box around the triangles.
fn bounds(targets: &[Target]) -> (Point, Point) {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for target in targets {
        let [u, v] = target.sides;
        for axis in 0..3 {
            let at = target.corner[axis];
            let (second, third) = (at + u[axis], at + v[axis]);
            low[axis] = low[axis].min(at).min(second).min(third);
            high[axis] = high[axis].max(at).max(second).max(third);
        }
    }
    (low, high)
}

fn longest_axis(low: Point, high: Point) -> usize {
    let size = subtract(high, low);
    let is_first = size[0] >= size[1] && size[0] >= size[2];
    match (is_first, size[1] >= size[2]) {
        (true, _) => 0,
        (false, true) => 1,
        (false, false) => 2,
    }
}

/// The distance at which the ray enters the box. Returns `None` if this is not before the limit.
fn entry(node: &Node, origin: Point, inverse: Point, limit: f64) -> Option<f64> {
    let mut enters: f64 = 0.0;
    let mut leaves = limit;
    for axis in 0..3 {
        let a = (node.low[axis] - origin[axis]) * inverse[axis];
        let b = (node.high[axis] - origin[axis]) * inverse[axis];
        // `min` and `max` ignore NaN, so an origin on a side of the box counts as inside if the ray runs along this side.
        enters = enters.max(a.min(b));
        leaves = leaves.min(a.max(b));
    }
    // The small factor allows for rounding at a flat box.
    (enters <= leaves * (1.0 + 1e-12)).then_some(enters)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::tests::{cuboid, mesh_of};
    use proptest::prelude::*;

    #[test]
    fn a_ray_meets_the_nearest_side() {
        let mesh = mesh_of(&cuboid([0.0; 3], [1.0, 2.0, 3.0]));
        let tree = RayTree::of(&mesh);
        let distance = |direction: Point| {
            let hit = tree.first_hit([0.4, 0.5, 0.6], direction, 0.0, u32::MAX);
            hit.map(|hit| hit.distance)
        };
        let near = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-12;
        assert!(near(distance([1.0, 0.0, 0.0]), 0.6));
        assert!(near(distance([-1.0, 0.0, 0.0]), 0.4));
        assert!(near(distance([0.0, 0.0, 1.0]), 2.4));
        assert_eq!(
            tree.first_hit([2.0, 0.5, 0.6], [1.0, 0.0, 0.0], 0.0, 0),
            None
        );
    }

    #[test]
    fn a_ray_through_empty_space_meets_nothing() {
        let nothing = RayTree::of(&Mesh::default());
        assert_eq!(nothing.first_hit([0.0; 3], [1.0, 0.0, 0.0], 0.0, 0), None);
        for corners in [[[f64::NAN; 3]; 3], [[0.0; 3]; 3], [[f64::INFINITY; 3]; 3]] {
            let tree = RayTree::of(&mesh_of(&[corners]));
            assert_eq!(
                tree.first_hit([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 0.0, 5),
                None
            );
        }
    }

    fn point() -> impl Strategy<Value = Point> {
        proptest::array::uniform3(-1.0f64..1.0)
    }

    proptest! {
        #[test]
        fn the_tree_finds_what_a_search_of_all_triangles_finds(
            triangles in proptest::collection::vec(proptest::array::uniform3(point()), 1..80),
            origin in point(),
            direction in point(),
        ) {
            let mesh = mesh_of(&triangles);
            let tree = RayTree::of(&mesh);
            let all = tree.targets.iter().map(|target| target.distance(origin, direction));
            let nearest = all.filter(|&distance| distance > 0.0).min_by(f64::total_cmp);
            let found = tree.first_hit(origin, direction, 0.0, u32::MAX);
            prop_assert_eq!(found.map(|hit| hit.distance), nearest);
        }
    }
}
