//! Tests the sources of the mesh on a cloud, where the neighbors of a point are the points nearest to it.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot make its own shape has failed"
)]

use partprobe_carrier::{GivenShape, Partition, carrier_of_given};
use partprobe_sources::source_named;

/// The points of a cube on a grid of `n` by `n` per side, with their normals.
fn cube_of_points(n: u32) -> GivenShape {
    let mut shape = GivenShape::default();
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
    for side in 0..6u32 {
        let axis = (side / 2) as usize;
        let level = side % 2;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let mut point = [0.0; 3];
            point[axis] = f64::from(level);
            point[(axis + 1) % 3] = at(i);
            point[(axis + 2) % 3] = at(j);
            let mut normal = [0.0; 3];
            normal[axis] = if level == 0 { -1.0 } else { 1.0 };
            shape.vertices.push(point);
            shape.normals.push(normal);
        }
    }
    shape
}

#[test]
fn the_sides_of_a_cube_of_points_are_labels() {
    let n = 12;
    let carrier = carrier_of_given(cube_of_points(n), "cube", "00").unwrap();
    let expected: Vec<u32> = (0..6 * n * n).map(|point| point / (n * n)).collect();
    for name in ["normal-kmeans-6", "vsa-6", "dihedral-grow-30"] {
        let labels = source_named(name).unwrap().labels(&carrier, 0).unwrap();
        let found = Partition::from_keys(labels.of_triangles().of_triangle());
        assert_eq!(found.parts(), expected, "{name}");
    }
}
