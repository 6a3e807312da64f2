//! Measures the thickness of a wall: casts a ray at a tree of triangles.

use partprobe_carrier::{Mesh, Point, cross, dot, norm, subtract};
use rstar::{AABB, RTree, RTreeObject, SelectionFunction};
use std::cell::Cell;

/// A ray that starts on a surface ignores triangles within this fraction of the diagonal, because they are the surface itself.
const START_FRACTION: f64 = 1e-5;

/// The triangles of one mesh in a tree.
#[derive(Debug)]
pub struct TriangleTree {
    tree: RTree<Triangle>,
    diagonal: f64,
}

/// One triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Triangle {
    corners: [Point; 3],
}

impl TriangleTree {
    /// Sorts the triangles of a mesh into a tree. Triangles without an area are left out.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        let triangle = |index: usize| Triangle {
            corners: mesh.corners(index),
        };
        let triangles = (0..mesh.triangles.len()).map(triangle);
        let has_area = |triangle: &Triangle| norm(triangle.scaled_normal()) > 0.0;
        Self {
            tree: RTree::bulk_load(triangles.filter(has_area).collect()),
            diagonal: mesh.diagonal(),
        }
    }

    /// The distance to the opposite wall: the length of the ray from a point of the surface against its outward normal.
    ///
    /// Returns `None` if the ray leaves the shape without meeting a triangle, which happens on open surfaces.
    #[must_use]
    pub fn thickness(&self, point: Point, outward: Point) -> Option<f64> {
        let length = norm(outward);
        if length == 0.0 || !length.is_finite() {
            return None;
        }
        let ray = Ray {
            start: point,
            direction: outward.map(|x| -x / length),
            least: START_FRACTION * self.diagonal,
        };
        let first = Cell::new(f64::INFINITY);
        let selection = Ahead { ray, first: &first };
        for triangle in self.tree.locate_with_selection_function(selection) {
            if let Some(distance) = ray.distance_to(triangle) {
                first.set(first.get().min(distance));
            }
        }
        Some(first.get()).filter(|distance| distance.is_finite())
    }
}

/// A half line.
#[derive(Clone, Copy, Debug)]
struct Ray {
    start: Point,
    /// Unit length.
    direction: Point,
    /// Triangles that are nearer than this do not count.
    least: f64,
}

impl Ray {
    /// The distance at which the ray enters a box. Returns `None` if it misses the box.
    fn enters(&self, envelope: &AABB<Point>) -> Option<f64> {
        let (lower, upper) = (envelope.lower(), envelope.upper());
        let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
        for axis in 0..3 {
            if self.direction[axis] == 0.0 {
                let is_inside = lower[axis] <= self.start[axis] && self.start[axis] <= upper[axis];
                leave = if is_inside { leave } else { -1.0 };
                continue;
            }
            let to = |side: f64| (side - self.start[axis]) / self.direction[axis];
            let (first, second) = (to(lower[axis]), to(upper[axis]));
            enter = enter.max(first.min(second));
            leave = leave.min(first.max(second));
        }
        (enter <= leave).then_some(enter)
    }

    /// The distance of a triangle along the ray (Möller and Trumbore 1997). Returns `None` if the ray misses it.
    fn distance_to(&self, triangle: &Triangle) -> Option<f64> {
        let [a, b, c] = triangle.corners;
        let (first, second) = (subtract(b, a), subtract(c, a));
        let perpendicular = cross(self.direction, second);
        let determinant = dot(first, perpendicular);
        if determinant == 0.0 {
            return None;
        }
        let from_a = subtract(self.start, a);
        let u = dot(from_a, perpendicular) / determinant;
        let across = cross(from_a, first);
        let v = dot(self.direction, across) / determinant;
        let distance = dot(second, across) / determinant;
        let is_inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
        (is_inside && self.least < distance).then_some(distance)
    }
}

/// Opens only boxes that the ray enters before the nearest triangle that was found so far.
struct Ahead<'a> {
    ray: Ray,
    first: &'a Cell<f64>,
}

impl SelectionFunction<Triangle> for Ahead<'_> {
    fn should_unpack_parent(&self, envelope: &AABB<Point>) -> bool {
        let entry = self.ray.enters(envelope);
        entry.is_some_and(|entry| entry <= self.first.get())
    }
}

impl Triangle {
    /// A normal whose length is twice the area.
    fn scaled_normal(&self) -> Point {
        let [a, b, c] = self.corners;
        cross(subtract(b, a), subtract(c, a))
    }
}

impl RTreeObject for Triangle {
    type Envelope = AABB<Point>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_points(&self.corners)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two squares of side 4 with their outward normals away from each other, `gap` apart.
    fn plate(gap: f64) -> Mesh {
        let square = |z: f64| [[0.0, 0.0, z], [4.0, 0.0, z], [4.0, 4.0, z], [0.0, 4.0, z]];
        Mesh {
            vertices: [square(0.0), square(gap)].concat(),
            vertex_face: vec![0, 0, 0, 0, 1, 1, 1, 1],
            triangles: vec![[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]],
            tri_face: vec![0, 0, 1, 1],
            vertex_normal: Vec::new(),
        }
    }

    #[test]
    fn the_thickness_of_a_plate_is_its_gap() {
        let tree = TriangleTree::new(&plate(0.5));
        let from_below = tree.thickness([1.0, 2.0, 0.0], [0.0, 0.0, -1.0]);
        assert!((from_below.unwrap() - 0.5).abs() < 1e-12);
        let from_above = tree.thickness([3.0, 1.0, 0.5], [0.0, 0.0, 2.0]);
        assert!((from_above.unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(tree.thickness([3.0, 1.0, 0.5], [0.0, 0.0, -1.0]), None);
        assert_eq!(tree.thickness([3.0, 1.0, 0.5], [0.0; 3]), None);
    }
}
