//! Computes generalized winding numbers: the number of times that a mesh surrounds a point. It is 1 inside of a closed mesh and 0
//! outside, and between these values if the mesh has holes (Jacobson, Kavan, Sorkine-Hornung, "Robust inside-outside segmentation
//! using generalized winding numbers", 2013).
//!
//! Triangles that are far away are replaced by one dipole (Barill et al., "Fast winding numbers for soups and clouds", 2018).

use partprobe_carrier::{Point, centroid, cross, dot, norm, subtract};
use std::f64::consts::PI;

/// The largest number of triangles in a leaf of the tree.
const MAX_LEAF: usize = 8;
/// A node counts as far away if its distance is at least this many radii.
const FAR: f64 = 2.5;

/// Triangles of a mesh, grouped by position.
#[derive(Clone, Debug)]
pub(super) struct WindingTree {
    nodes: Vec<Node>,
    corners: Vec<[Point; 3]>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    /// The mean position of the triangles, weighted by area, and the largest distance of a corner from it.
    center: Point,
    radius: f64,
    /// The sum of normals times areas.
    dipole: Point,
    first: u32,
    n_triangles: u32,
    /// The index of the second child, or 0 for a leaf. The first child follows the node.
    second: u32,
}

impl WindingTree {
    pub(super) fn new(mut corners: Vec<[Point; 3]>) -> Self {
        let mut nodes = Vec::new();
        if !corners.is_empty() {
            build(&mut corners, 0, &mut nodes);
        }
        Self { nodes, corners }
    }

    /// The winding number at a point.
    pub(super) fn winding_number(&self, point: Point) -> f64 {
        let mut angle = 0.0;
        let mut open = vec![0usize];
        while let Some(index) = open.pop() {
            let Some(node) = self.nodes.get(index) else {
                continue;
            };
            let away = subtract(node.center, point);
            let distance = norm(away);
            if distance > FAR * node.radius {
                angle += dot(node.dipole, away) / (distance * distance * distance);
            } else if node.second > 0 {
                open.push(node.second as usize);
                open.push(index + 1);
            } else {
                let first = node.first as usize;
                for corners in &self.corners[first..first + node.n_triangles as usize] {
                    angle += solid_angle(corners.map(|corner| subtract(corner, point)));
                }
            }
        }
        angle / (4.0 * PI)
    }
}

/// Adds the node of these triangles, the first of which has the index `first`, and all nodes below it.
fn build(corners: &mut [[Point; 3]], first: usize, nodes: &mut Vec<Node>) {
    let own = nodes.len();
    nodes.push(node_of(corners, first));
    if corners.len() <= MAX_LEAF {
        return;
    }
    let centers = corners.iter().map(|&corners| centroid(corners));
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for center in centers {
        for axis in 0..3 {
            low[axis] = low[axis].min(center[axis]);
            high[axis] = high[axis].max(center[axis]);
        }
    }
    let width = |axis: usize| high[axis] - low[axis];
    let widest = if width(0) >= width(1) && width(0) >= width(2) {
        0
    } else if width(1) >= width(2) {
        1
    } else {
        2
    };
    // Equal centers keep an order that depends on their corners, so that the tree is the same for the same mesh.
    let key = |corners: &[Point; 3]| centroid(*corners)[widest];
    corners.sort_by(|a, b| key(a).total_cmp(&key(b)));
    let half = corners.len() / 2;
    let (left, right) = corners.split_at_mut(half);
    build(left, first, nodes);
    nodes[own].second = nodes.len() as u32;
    build(right, first + half, nodes);
}

fn node_of(corners: &[[Point; 3]], first: usize) -> Node {
    let (mut area, mut moment, mut dipole) = (0.0, [0.0; 3], [0.0; 3]);
    for &triangle in corners {
        let [a, b, c] = triangle;
        let normal = cross(subtract(b, a), subtract(c, a)).map(|x| 0.5 * x);
        let (weight, middle) = (norm(normal), centroid(triangle));
        area += weight;
        for axis in 0..3 {
            moment[axis] += weight * middle[axis];
            dipole[axis] += normal[axis];
        }
    }
    let center = match area > 0.0 {
        true => moment.map(|x| x / area),
        false => centroid(corners[0]),
    };
    let from_center = |corner: &Point| norm(subtract(*corner, center));
    Node {
        center,
        radius: corners
            .iter()
            .flatten()
            .map(from_center)
            .fold(0.0, f64::max),
        dipole,
        first: first as u32,
        n_triangles: corners.len() as u32,
        second: 0,
    }
}

/// The solid angle of a triangle seen from the origin, positive from behind (van Oosterom and Strackee 1983).
fn solid_angle([a, b, c]: [Point; 3]) -> f64 {
    let [la, lb, lc] = [a, b, c].map(norm);
    let volume = dot(a, cross(b, c));
    let sum = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    if volume == 0.0 && sum == 0.0 {
        return 0.0;
    }
    2.0 * libm::atan2(volume, sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{sphere, torus};
    use partprobe_carrier::{Mesh, keyed_rng, unit_interval};

    fn tree(mesh: &Mesh) -> WindingTree {
        WindingTree::new((0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect())
    }

    #[test]
    fn it_is_one_inside_and_zero_outside() {
        let mesh = torus([2.0, 0.7], [60, 30]);
        let (tree, mut rng) = (tree(&mesh), keyed_rng(1, &["test"]));
        for _ in 0..2_000 {
            let point: Point = std::array::from_fn(|_| 6.0 * unit_interval(&mut rng) - 3.0);
            let [x, y, z] = point;
            let from_circle = (x.hypot(y) - 2.0).hypot(z);
            if (from_circle - 0.7).abs() < 0.05 {
                continue;
            }
            let expected = if from_circle < 0.7 { 1.0 } else { 0.0 };
            let found = tree.winding_number(point);
            assert!((found - expected).abs() < 0.1, "{point:?}: {found}");
        }
    }

    #[test]
    fn a_hole_makes_it_a_fraction() {
        let mut mesh = sphere(1.0, [40, 20]);
        mesh.triangles.truncate(mesh.triangles.len() / 2);
        let found = tree(&mesh).winding_number([0.0; 3]);
        assert!((found - 0.5).abs() < 0.05, "{found}");
        assert_eq!(WindingTree::new(Vec::new()).winding_number([0.0; 3]), 0.0);
    }
}
