//! Computes the poses of meshes from the affine maps of glTF nodes.

use crate::mesh::gltf::document::Node;
use partprobe_carrier::{Point, rotation_of_quaternion};

/// A linear map, row by row, and a translation after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    linear: [[f64; 3]; 3],
    translation: Point,
}

impl Pose {
    pub(crate) const IDENTITY: Self = Self {
        linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
    };

    /// The pose of a node relative to its parent.
    pub(crate) fn of_node(node: &Node) -> Self {
        if let Some(matrix) = &node.matrix {
            let cell = |row: usize, column: usize| matrix[4 * column + row];
            return Self {
                linear: [0, 1, 2].map(|row| [0, 1, 2].map(|column| cell(row, column))),
                translation: [0, 1, 2].map(|row| cell(row, 3)),
            };
        }
        let rotation = rotation_of_quaternion(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
        let scale = node.scale.unwrap_or([1.0; 3]);
        Self {
            linear: rotation.map(|row| [0, 1, 2].map(|column| row[column] * scale[column])),
            translation: node.translation.unwrap_or_default(),
        }
    }

    /// This pose after the other one.
    pub(crate) fn after(&self, first: &Self) -> Self {
        let cell = |row: usize, column: usize| -> f64 {
            (0..3)
                .map(|k| self.linear[row][k] * first.linear[k][column])
                .sum()
        };
        Self {
            linear: [0, 1, 2].map(|row| [0, 1, 2].map(|column| cell(row, column))),
            translation: self.applied(first.translation),
        }
    }

    pub(crate) fn applied(&self, point: Point) -> Point {
        [0, 1, 2].map(|row| {
            let [x, y, z] = self.linear[row];
            x * point[0] + y * point[1] + z * point[2] + self.translation[row]
        })
    }

    /// Whether the map exchanges left and right, so that triangles have to be reversed.
    pub(crate) fn mirrors(&self) -> bool {
        let [[a, b, c], [d, e, f], [g, h, i]] = self.linear;
        a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(json: &str) -> Pose {
        Pose::of_node(&serde_json::from_str(json).unwrap())
    }

    #[test]
    fn scale_comes_before_rotation_before_translation() {
        let half = 0.5f64.sqrt();
        let placed = pose(&format!(
            r#"{{"translation": [1, 2, 3], "rotation": [0, 0, {half}, {half}], "scale": [2, 1, 1]}}"#
        ));
        let [x, y, z] = placed.applied([1.0, 1.0, 1.0]);
        let difference = (x - 0.0).abs() + (y - 4.0).abs() + (z - 4.0).abs();
        assert!(difference < 1e-12, "{x} {y} {z}");
        assert!(!placed.mirrors());
    }

    #[test]
    fn a_matrix_is_written_column_by_column() {
        let matrix = pose(r#"{"matrix": [0,1,0,0, 1,0,0,0, 0,0,1,0, 5,6,7,1]}"#);
        assert_eq!(matrix.applied([1.0, 2.0, 3.0]), [7.0, 7.0, 10.0]);
        assert!(matrix.mirrors());
        let twice = matrix.after(&matrix);
        assert_eq!(
            twice.applied([1.0, 2.0, 3.0]),
            matrix.applied(matrix.applied([1.0, 2.0, 3.0]))
        );
        assert!(!twice.mirrors());
        assert_eq!(Pose::IDENTITY.after(&matrix), matrix);
    }
}
