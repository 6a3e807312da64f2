//! Finds the nearest of many items with bounding boxes.
//!
//! The tree is a bounding volume hierarchy that halves the items at the median of their centers. It is the same for the
//! same items on any machine and for any number of threads. Equal distances go to the lowest item, so an answer does
//! not depend on the shape of the tree.

use partprobe_carrier::Point;

/// A node with at most this many items is not divided.
const MAX_LEAF: usize = 4;

/// More levels than a tree of 2³² items has.
const MAX_DEPTH: usize = 40;

/// An axis-parallel box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub(crate) low: Point,
    pub(crate) high: Point,
}

impl Bounds {
    /// The box around points; it is empty if there are none.
    pub(crate) fn around(points: &[Point]) -> Self {
        let empty = Self {
            low: [f64::INFINITY; 3],
            high: [f64::NEG_INFINITY; 3],
        };
        points.iter().fold(empty, |bounds, &point| {
            bounds.joined(&Self {
                low: point,
                high: point,
            })
        })
    }

    fn joined(&self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|axis| self.low[axis].min(other.low[axis])),
            high: std::array::from_fn(|axis| self.high[axis].max(other.high[axis])),
        }
    }

    fn center(&self, axis: usize) -> f64 {
        0.5 * (self.low[axis] + self.high[axis])
    }

    fn squared_distance(&self, point: Point) -> f64 {
        let beyond = |axis: usize| {
            let outside = (self.low[axis] - point[axis]).max(point[axis] - self.high[axis]);
            outside.max(0.0)
        };
        let [x, y, z] = [beyond(0), beyond(1), beyond(2)];
        x * x + y * y + z * z
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// A leaf: its first item in the tree's order. An inner node: its second child; the first one follows the node.
    next: u32,
    /// How many items a leaf has; 0 for an inner node.
    n_items: u32,
}

/// Items in space, found by distance.
#[derive(Clone, Debug)]
pub(crate) struct BoxTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// The nearest item so far, and its squared distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Found {
    pub(crate) item: u32,
    pub(crate) squared_distance: f64,
}

impl BoxTree {
    /// A tree over items with these boxes.
    pub(crate) fn new(bounds: &[Bounds]) -> Self {
        let mut tree = Self {
            nodes: Vec::with_capacity(bounds.len()),
            order: (0..).take(bounds.len()).collect(),
        };
        if !bounds.is_empty() {
            tree.build(bounds);
        }
        tree
    }

    fn build(&mut self, bounds: &[Bounds]) {
        // An entry is a range of items, and the node whose second child it will be.
        let mut open: Vec<(usize, usize, Option<usize>)> = vec![(0, self.order.len(), None)];
        while let Some((start, end, parent)) = open.pop() {
            let node = self.nodes.len();
            if let Some(parent) = parent {
                self.nodes[parent].next = node as u32;
            }

            let items = &mut self.order[start..end];
            let around = |all: Bounds, &item: &u32| all.joined(&bounds[item as usize]);
            let own = items.iter().fold(Bounds::around(&[]), around);
            let is_leaf = items.len() <= MAX_LEAF;
            self.nodes.push(Node {
                bounds: own,
                next: start as u32,
                n_items: if is_leaf { items.len() as u32 } else { 0 },
            });
            if is_leaf {
                continue;
            }

            let axis = widest_axis(items, bounds);
            let by_center = |a: &u32, b: &u32| {
                let [first, second] = [a, b].map(|&item| bounds[item as usize].center(axis));
                first.total_cmp(&second).then(a.cmp(b))
            };
            let half = items.len() / 2;
            items.select_nth_unstable_by(half, by_center);
            let middle = start + half;
            // The first child is taken next, so that it follows its parent.
            open.push((middle, end, Some(node)));
            open.push((start, middle, None));
        }
    }

    /// The nearest item within a squared distance. `squared_distance` says how far an item is, or `None` if it does not
    /// count.
    pub(crate) fn nearest(
        &self,
        point: Point,
        max_squared_distance: f64,
        mut squared_distance: impl FnMut(u32) -> Option<f64>,
    ) -> Option<Found> {
        let root = self.nodes.first()?;
        let mut best: Option<Found> = None;
        let mut limit = max_squared_distance;
        let mut stack = [(0u32, 0.0f64); MAX_DEPTH];
        stack[0] = (0, root.bounds.squared_distance(point));
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (node_idx, lower_bound) = stack[depth];
            if lower_bound > limit {
                continue;
            }
            let node = &self.nodes[node_idx as usize];
            if node.n_items > 0 {
                let range = node.next as usize..(node.next + node.n_items) as usize;
                for &item in &self.order[range] {
                    let Some(distance) = squared_distance(item).filter(|&found| found <= limit)
                    else {
                        continue;
                    };
                    let is_better = best
                        .is_none_or(|best| distance < best.squared_distance || item < best.item);
                    if is_better {
                        best = Some(Found {
                            item,
                            squared_distance: distance,
                        });
                        limit = distance;
                    }
                }
                continue;
            }

            let mut near = self.with_bound(node_idx + 1, point);
            let mut far = self.with_bound(node.next, point);
            if far.1 < near.1 {
                std::mem::swap(&mut near, &mut far);
            }
            // The nearer child is on top.
            for child in [far, near] {
                if child.1 <= limit {
                    stack[depth] = child;
                    depth += 1;
                }
            }
        }
        best
    }

    /// A node, and the squared distance below which none of its items is.
    fn with_bound(&self, node: u32, point: Point) -> (u32, f64) {
        let bounds = &self.nodes[node as usize].bounds;
        (node, bounds.squared_distance(point))
    }
}

fn widest_axis(items: &[u32], bounds: &[Bounds]) -> usize {
    let width = |axis: usize| {
        let centers = items.iter().map(|&item| bounds[item as usize].center(axis));
        let (low, high) = centers
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), center| {
                (low.min(center), high.max(center))
            });
        high - low
    };
    let [x, y, z] = [width(0), width(1), width(2)];
    if x >= y && x >= z {
        0
    } else if y >= z {
        1
    } else {
        2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn squared(a: Point, b: Point) -> f64 {
        (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum()
    }

    fn small_coordinate() -> impl Strategy<Value = f64> {
        // Few values, so that distances are often equal.
        (0i32..5).prop_map(f64::from)
    }

    fn points() -> impl Strategy<Value = Vec<Point>> {
        proptest::collection::vec(proptest::array::uniform3(small_coordinate()), 0..60)
    }

    proptest! {
        #[test]
        fn the_nearest_is_that_of_a_search_through_all(
            points in points(),
            query in proptest::array::uniform3(small_coordinate()),
            limit in 0.0..9.0f64,
            step in 1usize..4,
        ) {
            let bounds: Vec<Bounds> = points.iter().map(|&point| Bounds::around(&[point])).collect();
            let tree = BoxTree::new(&bounds);
            let counts = |item: usize| item.is_multiple_of(step);
            let found = tree.nearest(query, limit, |item| {
                counts(item as usize).then(|| squared(query, points[item as usize]))
            });

            let mut expected: Option<Found> = None;
            for (item, &point) in points.iter().enumerate().filter(|&(item, _)| counts(item)) {
                let distance = squared(query, point);
                if distance <= limit && expected.is_none_or(|best| distance < best.squared_distance) {
                    expected = Some(Found { item: item as u32, squared_distance: distance });
                }
            }
            prop_assert_eq!(found, expected);
        }
    }
}
