//! Finds the nearest of many items with bounding boxes.
//!
//! The tree is a bounding volume hierarchy that halves the items at the median of their centers. Every second level is left out
//! afterward, so that a node has up to four children or items, whose boxes are compared at once. The tree is the same for the
//! same items on any machine and for any number of threads. At equal distances, the lowest item is found, so an answer does not
//! depend on the shape of the tree or on the item from which a search starts.

use partprobe_carrier::Point;

/// A node with at most this many items is not divided. It is the width of a node, whose boxes are then those of the items.
const MAX_LEAF: usize = WIDTH;

/// A node with fewer items is made by one thread.
const PARALLEL_ITEMS: usize = 4096;

/// A node has at most this many children.
const WIDTH: usize = 4;

/// A search never has more open nodes than this: a tree of 2³² items has 16 levels of nodes with four children.
const MAX_OPEN: usize = 64;

/// The relative error of a squared distance to a box in single precision is below this value.
const ROUNDING: f32 = 1.0 / (1u32 << 20) as f32;

/// An axis-parallel box, in single precision. It is rounded outward, so that nothing inside it is lost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    low: [f32; 3],
    high: [f32; 3],
}

impl Bounds {
    const EMPTY: Self = Self {
        low: [f32::INFINITY; 3],
        high: [f32::NEG_INFINITY; 3],
    };

    /// The box around points; it is empty if there are none.
    pub(crate) fn around(points: &[Point]) -> Self {
        let of_point = |point: &Point| Self {
            low: point.map(rounded_down),
            high: point.map(rounded_up),
        };
        points
            .iter()
            .map(of_point)
            .fold(Self::EMPTY, |all, bounds| all.joined(&bounds))
    }

    fn joined(&self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|axis| smaller(self.low[axis], other.low[axis])),
            high: std::array::from_fn(|axis| larger(self.high[axis], other.high[axis])),
        }
    }

    fn widest_axis(&self) -> usize {
        let [x, y, z] = std::array::from_fn(|axis| self.high[axis] - self.low[axis]);
        if x >= y && x >= z {
            0
        } else if y >= z {
            1
        } else {
            2
        }
    }

    /// Twice the center, in single precision: it decides where items are divided, and no answer depends on it.
    fn doubled_center(&self) -> [f32; 3] {
        std::array::from_fn(|axis| self.low[axis] + self.high[axis])
    }
}

/// The largest number of single precision that is not above `x`.
fn rounded_down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x {
        nearest.next_down()
    } else {
        nearest
    }
}

/// The smallest number of single precision that is not below `x`.
fn rounded_up(x: f64) -> f32 {
    -rounded_down(-x)
}

/// The smaller of two numbers. Unlike `f32::min`, it is one instruction and does not test for NaN.
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger of two numbers, in the same way.
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A node while the tree is made. It has two children or some items.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// A leaf: its first item in the tree's order. An inner node: its second child; the first one follows the node.
    next: u32,
    /// The number of items of a leaf. It is 0 for an inner node.
    n_items: u32,
}

/// A node of the finished tree, with the boxes of its children, or of its items, coordinate by coordinate.
#[derive(Clone, Copy, Debug)]
struct WideNode {
    low: [[f32; WIDTH]; 3],
    high: [[f32; WIDTH]; 3],
    /// The nodes below, or the indices of the items in the tree's order.
    below: [u32; WIDTH],
    n_below: u32,
    is_leaf: bool,
}

/// A point, rounded down and up to single precision.
#[derive(Clone, Copy)]
struct RoundedPoint {
    down: [f32; 3],
    up: [f32; 3],
}

impl WideNode {
    /// For each child, a lower bound of the squared distance of its items.
    fn lower_bounds(&self, point: &RoundedPoint) -> [f32; WIDTH] {
        let mut sums = [0.0f32; WIDTH];
        for axis in 0..3 {
            for (child, sum) in sums.iter_mut().enumerate() {
                let below = self.low[axis][child] - point.up[axis];
                let above = point.down[axis] - self.high[axis][child];
                let beyond = larger(larger(below, above), 0.0);
                *sum += beyond * beyond;
            }
        }
        // A value that is too large for single precision is replaced by the largest number, which is still a lower bound.
        sums.map(|sum| smaller(sum * (1.0 - ROUNDING), f32::MAX))
    }
}

/// Items in space that can be found by their distance.
#[derive(Clone, Debug)]
pub(crate) struct BoxTree {
    /// The nodes. The first one is the root. Without items there are no nodes.
    nodes: Vec<WideNode>,
    order: Vec<u32>,
}

/// The nearest item so far, and its squared distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Found {
    pub(crate) item: u32,
    /// The index of the item in the tree's order.
    pub(crate) slot: u32,
    pub(crate) squared_distance: f64,
}

/// An item while the tree is made, with its box and twice its center.
#[derive(Clone, Copy)]
struct Placed {
    item: u32,
    bounds: Bounds,
    center: [f32; 3],
}

/// Nodes that a search must still visit, each with a lower bound of the squared distance of its items.
struct Open {
    entries: [(f32, u32); MAX_OPEN],
    n: usize,
}

impl BoxTree {
    /// A tree over items with these boxes. Its halves are made in parallel.
    pub(crate) fn new(bounds: &[Bounds]) -> Self {
        let mut items: Vec<Placed> = (0..)
            .zip(bounds)
            .map(|(item, &bounds)| Placed {
                item,
                bounds,
                center: bounds.doubled_center(),
            })
            .collect();
        let unset = Node {
            bounds: Bounds::EMPTY,
            next: 0,
            n_items: 0,
        };
        let mut nodes = vec![unset; n_nodes(items.len())];
        build(&mut items, 0, &mut nodes, 0);
        Self {
            nodes: widened(&nodes, &items),
            order: items.iter().map(|placed| placed.item).collect(),
        }
    }

    /// The values of the items in the tree's order, so that items that are near in space are near in memory.
    pub(crate) fn arranged<T: Copy>(&self, values: &[T]) -> Vec<T> {
        self.order
            .iter()
            .map(|&item| values[item as usize])
            .collect()
    }

    /// The index of each item in the tree's order.
    pub(crate) fn slots(&self) -> Vec<u32> {
        let mut slots = vec![0; self.order.len()];
        for (slot, &item) in (0..).zip(&self.order) {
            slots[item as usize] = slot;
        }
        slots
    }

    /// The nearest item within a squared distance. `squared_distance` is given the index of an item in the tree's order and the
    /// item. It returns the squared distance of the item, or `None` if the item does not count.
    ///
    /// The search is short if `start` is the index, in the tree's order, of an item that is near.
    pub(crate) fn nearest(
        &self,
        point: Point,
        max_squared_distance: f64,
        start: Option<u32>,
        mut squared_distance: impl FnMut(usize, u32) -> Option<f64>,
    ) -> Option<Found> {
        let rounded = RoundedPoint {
            down: point.map(rounded_down),
            up: point.map(rounded_up),
        };
        let mut best: Option<Found> = None;
        let mut limit = max_squared_distance;
        let mut look_at = |slot: u32, limit: &mut f64| {
            let item = self.order[slot as usize];
            let Some(distance) =
                squared_distance(slot as usize, item).filter(|found| found <= limit)
            else {
                return;
            };
            let is_better =
                best.is_none_or(|best| distance < best.squared_distance || item < best.item);
            if is_better {
                best = Some(Found {
                    item,
                    slot,
                    squared_distance: distance,
                });
                *limit = distance;
            }
        };
        if let Some(slot) = start.filter(|&slot| (slot as usize) < self.order.len()) {
            look_at(slot, &mut limit);
        }

        let mut open = Open {
            entries: [(0.0, 0); MAX_OPEN],
            n: usize::from(!self.nodes.is_empty()),
        };
        while let Some(node) = open.next_within(limit) {
            let node = &self.nodes[node as usize];
            let lower_bounds = node.lower_bounds(&rounded);
            if !node.is_leaf {
                open.push_children(node, lower_bounds, limit);
                continue;
            }
            let items = lower_bounds.into_iter().zip(node.below);
            for (lower_bound, slot) in items.take(node.n_below as usize) {
                if f64::from(lower_bound) <= limit {
                    look_at(slot, &mut limit);
                }
            }
        }
        best
    }
}

impl Open {
    /// Takes the next node that may hold an item within the limit.
    fn next_within(&mut self, limit: f64) -> Option<u32> {
        while self.n > 0 {
            self.n -= 1;
            let (lower_bound, node) = self.entries[self.n];
            if f64::from(lower_bound) <= limit {
                return Some(node);
            }
        }
        None
    }

    /// Adds the children of a node that are within the limit, so that the nearest one is next.
    fn push_children(&mut self, node: &WideNode, lower_bounds: [f32; WIDTH], limit: f64) {
        let first = self.n;
        let children = lower_bounds.into_iter().zip(node.below);
        for (lower_bound, child) in children.take(node.n_below as usize) {
            if f64::from(lower_bound) > limit {
                continue;
            }
            let mut slot = self.n;
            while slot > first && self.entries[slot - 1].0 < lower_bound {
                self.entries[slot] = self.entries[slot - 1];
                slot -= 1;
            }
            self.entries[slot] = (lower_bound, child);
            self.n += 1;
        }
    }
}

/// The same tree without every second level. Each leaf has the boxes of its items.
fn widened(nodes: &[Node], items: &[Placed]) -> Vec<WideNode> {
    if nodes.is_empty() {
        return Vec::new();
    }
    let mut wide: Vec<WideNode> = Vec::with_capacity(nodes.len() / 2 + 1);
    // An entry is a node, and the position of the index of its wide node: a wide node and the number of its child.
    let mut waiting: Vec<(u32, Option<(usize, usize)>)> = vec![(0, None)];
    while let Some((node, parent)) = waiting.pop() {
        let own = wide.len();
        if let Some((parent, child)) = parent {
            wide[parent].below[child] = own as u32;
        }
        let leaf = &nodes[node as usize];
        if leaf.n_items > 0 {
            wide.push(WideNode::leaf(leaf, items));
            continue;
        }
        let mut made = WideNode::empty(false);
        for child in grandchildren(nodes, node) {
            waiting.push((child, Some((own, made.n_below as usize))));
            made.push(&nodes[child as usize].bounds, 0);
        }
        wide.push(made);
    }
    wide
}

/// The children of a node. A child that is not a leaf is replaced by its own children.
fn grandchildren(nodes: &[Node], node: u32) -> impl Iterator<Item = u32> {
    let children = |node: u32| [node + 1, nodes[node as usize].next];
    children(node).into_iter().flat_map(move |child| {
        let is_leaf = nodes[child as usize].n_items > 0;
        let below = if is_leaf {
            [Some(child), None]
        } else {
            children(child).map(Some)
        };
        below.into_iter().flatten()
    })
}

impl WideNode {
    fn empty(is_leaf: bool) -> Self {
        Self {
            low: [[f32::INFINITY; WIDTH]; 3],
            high: [[f32::NEG_INFINITY; WIDTH]; 3],
            below: [0; WIDTH],
            n_below: 0,
            is_leaf,
        }
    }

    fn leaf(leaf: &Node, items: &[Placed]) -> Self {
        let mut made = Self::empty(true);
        for slot in leaf.next..leaf.next + leaf.n_items {
            made.push(&items[slot as usize].bounds, slot);
        }
        made
    }

    fn push(&mut self, bounds: &Bounds, below: u32) {
        let child = self.n_below as usize;
        for axis in 0..3 {
            self.low[axis][child] = bounds.low[axis];
            self.high[axis][child] = bounds.high[axis];
        }
        self.below[child] = below;
        self.n_below += 1;
    }
}

/// The number of nodes of a tree with `n_items` items.
///
/// The nodes of one level have at most two sizes, which differ by 1.
fn n_nodes(n_items: usize) -> usize {
    let mut size = n_items;
    let mut n_small = usize::from(n_items > 0);
    let mut n_large = 0;
    let mut total = 0;
    while n_small + n_large > 0 {
        total += n_small + n_large;
        let divided_small = if size > MAX_LEAF { n_small } else { 0 };
        let divided_large = if size + 1 > MAX_LEAF { n_large } else { 0 };
        (n_small, n_large) = if size.is_multiple_of(2) {
            (2 * divided_small + divided_large, divided_large)
        } else {
            (divided_small, divided_small + 2 * divided_large)
        };
        size /= 2;
    }
    total
}

/// Makes the nodes over `items`, whose first one has the index `first_item` in the whole order. The first of `nodes` has the
/// index `first_node` in the whole tree.
///
/// The depth is the binary logarithm of the number of items, so recursion is safe.
fn build(items: &mut [Placed], first_item: u32, nodes: &mut [Node], first_node: u32) {
    let Some((node, below)) = nodes.split_first_mut() else {
        return;
    };
    let around = |all: Bounds, placed: &Placed| all.joined(&placed.bounds);
    node.bounds = items.iter().fold(Bounds::EMPTY, around);
    if items.len() <= MAX_LEAF {
        node.next = first_item;
        node.n_items = items.len() as u32;
        return;
    }

    let axis = node.bounds.widest_axis();
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| {
        let by_center = a.center[axis].total_cmp(&b.center[axis]);
        by_center.then(a.item.cmp(&b.item))
    });
    let is_large = items.len() > PARALLEL_ITEMS;
    let (near, far) = items.split_at_mut(half);
    let (near_nodes, far_nodes) = below.split_at_mut(n_nodes(half));
    let far_node = first_node + 1 + near_nodes.len() as u32;
    node.next = far_node;
    let far_item = first_item + half as u32;
    let mut build_near = || build(near, first_item, near_nodes, first_node + 1);
    let mut build_far = || build(far, far_item, far_nodes, far_node);
    if is_large {
        rayon::join(build_near, build_far);
    } else {
        build_near();
        build_far();
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
        // There are only few values, so distances are often equal.
        (0i32..5).prop_map(f64::from)
    }

    fn points() -> impl Strategy<Value = Vec<Point>> {
        proptest::collection::vec(proptest::array::uniform3(small_coordinate()), 0..60)
    }

    #[test]
    fn every_item_is_in_a_leaf() {
        for n_items in 0..200 {
            let bounds = vec![Bounds::around(&[[0.0; 3]]); n_items];
            let tree = BoxTree::new(&bounds);
            let leaves = tree.nodes.iter().filter(|node| node.is_leaf);
            let n_in_leaves: u32 = leaves.map(|node| node.n_below).sum();
            assert_eq!(n_in_leaves as usize, n_items);
        }
    }

    proptest! {
        #[test]
        fn boxes_are_rounded_outward(point in proptest::array::uniform3(proptest::num::f64::NORMAL)) {
            let bounds = Bounds::around(&[point]);
            for (axis, &x) in point.iter().enumerate() {
                prop_assert!(f64::from(bounds.low[axis]) <= x);
                prop_assert!(f64::from(bounds.high[axis]) >= x);
            }
        }

        #[test]
        fn the_nearest_is_that_of_a_search_through_all(
            points in points(),
            query in proptest::array::uniform3(small_coordinate()),
            limit in 0.0..9.0f64,
            step in 1usize..4,
            start in proptest::option::of(0u32..80),
        ) {
            let bounds: Vec<Bounds> = points.iter().map(|&point| Bounds::around(&[point])).collect();
            let tree = BoxTree::new(&bounds);
            let counts = |item: usize| item.is_multiple_of(step);
            let found = tree.nearest(query, limit, start, |_, item| {
                counts(item as usize).then(|| squared(query, points[item as usize]))
            });

            let mut expected: Option<Found> = None;
            for (item, &point) in points.iter().enumerate().filter(|&(item, _)| counts(item)) {
                let distance = squared(query, point);
                if distance <= limit && expected.is_none_or(|best| distance < best.squared_distance) {
                    let slot = tree.order.iter().position(|&other| other == item as u32).unwrap() as u32;
                    expected = Some(Found { item: item as u32, slot, squared_distance: distance });
                }
            }
            prop_assert_eq!(found, expected);
        }
    }
}
