//! Defines a mesh with all data of its file that may be labels of parts.

use partprobe_carrier::{Mesh, Point};

/// A mesh, and the marks of its triangles and vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkedMesh {
    /// The triangles, in the order of the file. Polygons are divided into fans.
    pub mesh: Mesh,
    /// Properties, colors and groups, in the order in which the readers list them.
    pub marks: Vec<Mark>,
}

/// Points without faces, and their marks.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkedPoints {
    /// The positions, in the order of the file.
    pub points: Vec<Point>,
    /// One normal per point. It is empty if the file has none.
    pub normals: Vec<[f32; 3]>,
    /// Properties and colors, all of them of [`Marked::Vertices`].
    pub marks: Vec<Mark>,
}

/// A mark: data of a file with one value per triangle or per vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// The name of a property, `color`, or the kind of a group: `object`, `group`, `material`, `node` or `primitive`.
    pub name: String,
    /// The elements that have the values.
    pub of: Marked,
    /// One value per triangle or per vertex.
    pub values: MarkValues,
}

/// The elements to which a mark belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marked {
    /// The triangles of the mesh.
    Triangles,
    /// The vertices of the mesh.
    Vertices,
}

/// The values of a mark, in the order of the triangles or vertices.
#[derive(Clone, Debug, PartialEq)]
pub enum MarkValues {
    /// Numbers of a property.
    Numbers(Vec<f64>),
    /// Red, green and blue, each from 0 to 65535.
    Colors(Vec<[u16; 3]>),
    /// The number of the group, counted from 0 in the order of the file.
    Groups(Vec<u32>),
}

/// The full value of a color channel.
const FULL: f64 = 65535.0;

/// A channel from a byte.
pub(crate) fn channel_of_byte(value: u8) -> u16 {
    u16::from(value) * 257
}

/// A channel from a fraction. Values outside of 0 to 1 are clamped.
pub(crate) fn channel_of_fraction(value: f64) -> u16 {
    (value * FULL).round().clamp(0.0, FULL) as u16
}

/// Repeats the value of each polygon for each triangle of its fan.
pub(crate) fn on_triangles<T: Copy>(polygons: &[Vec<i64>], values: &[T]) -> Vec<T> {
    let pairs = polygons.iter().zip(values);
    pairs
        .flat_map(|(polygon, &value)| std::iter::repeat_n(value, polygon.len().saturating_sub(2)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_and_its_fraction_are_one_channel() {
        for value in [0u8, 1, 127, 128, 255] {
            assert_eq!(
                channel_of_byte(value),
                channel_of_fraction(f64::from(value) / 255.0)
            );
        }
        assert_eq!(channel_of_fraction(-1.0), 0);
        assert_eq!(channel_of_fraction(7.0), 65535);
        assert_eq!(channel_of_fraction(f64::NAN), 0);
    }

    #[test]
    fn each_triangle_of_a_fan_has_the_value_of_its_polygon() {
        let polygons = [vec![0, 1, 2, 3], vec![0, 1], vec![0, 1, 2]];
        assert_eq!(on_triangles(&polygons, &[7, 8, 9]), [7, 7, 9]);
    }
}
