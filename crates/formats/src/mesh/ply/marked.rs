//! Reads PLY meshes and point clouds with their properties and colors, of faces and of vertices.

use crate::mesh::foreign::{MeshFileError, mesh_of};
use crate::mesh::marked_mesh::{
    Mark, MarkValues, Marked, MarkedMesh, MarkedPoints, channel_of_byte, channel_of_fraction,
    on_triangles,
};
use crate::mesh::ply::header::{Element, Scalar};
use crate::mesh::ply::read::{Content, Row};

/// The channels of a color.
const CHANNELS: [&str; 3] = ["red", "green", "blue"];
/// Properties that have another meaning and are not labels.
const NOT_LABELS: &[&str] = &[
    "x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "alpha", "s", "t", "u", "v",
];

/// The surface of a PLY file with the properties and colors of its faces, then those of its vertices.
///
/// Each property that is not a list becomes a mark, except for coordinates. If a face is divided into triangles, each of them
/// gets its values.
///
/// # Errors
/// If the header cannot be read, the file ends too early, it has no face, or faces and vertices do not fit together.
pub fn marked_mesh_from_ply(bytes: &[u8]) -> Result<MarkedMesh, MeshFileError> {
    let mut of_faces = Columns::default();
    let mut of_vertices = Columns::default();
    let content = Content::of(bytes, |element, row| match element.name.as_str() {
        "face" => of_faces.push(element, row),
        "vertex" => of_vertices.push(element, row),
        _ => {}
    })?;

    let mut marks = of_faces.marks(Marked::Triangles);
    for mark in &mut marks {
        mark.values = match &mark.values {
            MarkValues::Numbers(values) => {
                MarkValues::Numbers(on_triangles(&content.polygons, values))
            }
            MarkValues::Colors(values) => {
                MarkValues::Colors(on_triangles(&content.polygons, values))
            }
            MarkValues::Groups(values) => {
                MarkValues::Groups(on_triangles(&content.polygons, values))
            }
        };
    }
    marks.extend(of_vertices.marks(Marked::Vertices));
    let mesh = mesh_of(content.vertices, &content.polygons)?;
    Ok(MarkedMesh { mesh, marks })
}

/// The points of a PLY file without faces, with their properties and colors.
///
/// # Errors
/// If the header cannot be read, the file ends too early, or it has no point.
pub fn marked_points_from_ply(bytes: &[u8]) -> Result<MarkedPoints, MeshFileError> {
    let mut of_vertices = Columns::default();
    let content = Content::of(bytes, |element, row| {
        if element.name == "vertex" {
            of_vertices.push(element, row);
        }
    })?;
    if content.vertices.is_empty() {
        return Err(MeshFileError::NoFace);
    }
    Ok(MarkedPoints {
        points: content.vertices,
        normals: content.normals,
        marks: of_vertices.marks(Marked::Vertices),
    })
}

/// The values of an element, property by property and row by row.
#[derive(Default)]
struct Columns {
    names: Vec<String>,
    values: Vec<Vec<f64>>,
    colors: Vec<[u16; 3]>,
}

impl Columns {
    fn push(&mut self, element: &Element, row: &Row) {
        let labels = element.properties.iter().zip(row).filter(|(property, _)| {
            property.length.is_none() && !NOT_LABELS.contains(&property.name.as_str())
        });
        if self.values.is_empty() {
            self.names = labels
                .clone()
                .map(|(property, _)| property.name.clone())
                .collect();
            self.values = vec![Vec::new(); self.names.len()];
        }
        for (values, (_, cell)) in self.values.iter_mut().zip(labels) {
            values.push(cell.first().copied().unwrap_or(f64::NAN));
        }
        self.colors.extend(color(element, row));
    }

    fn marks(self, of: Marked) -> Vec<Mark> {
        let numbers = self.names.into_iter().zip(self.values);
        let mut marks: Vec<Mark> = numbers
            .map(|(name, values)| Mark {
                name,
                of,
                values: MarkValues::Numbers(values),
            })
            .collect();
        if !self.colors.is_empty() {
            marks.push(Mark {
                name: "color".to_owned(),
                of,
                values: MarkValues::Colors(self.colors),
            });
        }
        marks
    }
}

/// The color of a row, if the element has one.
fn color(element: &Element, row: &Row) -> Option<[u16; 3]> {
    let [red, green, blue] = CHANNELS.map(|name| {
        let at = element.index_of(name)?;
        let value = row[at].first().copied()?;
        Some(channel(value, element.properties[at].scalar))
    });
    Some([red?, green?, blue?])
}

/// Bytes are from 0 to 255, shorts are from 0 to 65535, and floats are fractions.
fn channel(value: f64, scalar: Scalar) -> u16 {
    match scalar {
        Scalar::F32 | Scalar::F64 => channel_of_fraction(value),
        Scalar::I16 | Scalar::U16 => value.clamp(0.0, 65535.0) as u16,
        _ => channel_of_byte(value.clamp(0.0, 255.0) as u8),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::foreign::tests::corners;
    use proptest::prelude::*;

    const SQUARE: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         property float red\nproperty float green\nproperty float blue\nproperty int object\nelement face 2\n\
         property list uchar int vertex_indices\nproperty int label\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nproperty uchar alpha\nend_header\n\
         0 0 0 1 0 0 5\n1 0 0 1 0 0 5\n1 1 0 0 1 0 6\n0 1 0 0 0 1 6\n\
         4 0 1 2 3 7 255 0 0 255\n3 0 2 1 -1 0 128 0 255\n";

    #[test]
    fn properties_and_colors_of_faces_and_vertices_are_marks() {
        let found = marked_mesh_from_ply(SQUARE.as_bytes()).unwrap();
        let mark = |name: &str, of, values| Mark {
            name: name.to_owned(),
            of,
            values,
        };
        let [red, green, blue] = [[65535, 0, 0], [0, 65535, 0], [0, 0, 65535]];
        let expected = [
            mark(
                "label",
                Marked::Triangles,
                MarkValues::Numbers(vec![7.0, 7.0, -1.0]),
            ),
            mark(
                "color",
                Marked::Triangles,
                MarkValues::Colors(vec![red, red, [0, 128 * 257, 0]]),
            ),
            mark(
                "object",
                Marked::Vertices,
                MarkValues::Numbers(vec![5.0, 5.0, 6.0, 6.0]),
            ),
            mark(
                "color",
                Marked::Vertices,
                MarkValues::Colors(vec![red, red, green, blue]),
            ),
        ];
        assert_eq!(found.marks, expected);
        assert_eq!(corners(&found.mesh).len(), 3);
    }

    #[test]
    fn points_alone_are_not_a_mesh() {
        let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
        assert_eq!(
            marked_mesh_from_ply(text.as_bytes()),
            Err(MeshFileError::NoFace)
        );
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_reader_panic(
            lines in "(element|property|format|ascii|1.0|list|uchar|int|face|vertex|label|red|green|blue|x|y|z|vertex_indices|[0-9]{1,4}| |\n){0,60}",
            body: Vec<u8>,
        ) {
            let mut bytes = format!("ply\n{lines}\nend_header\n").into_bytes();
            bytes.extend(body);
            let _ = marked_mesh_from_ply(&bytes);
        }

        #[test]
        fn a_damaged_file_is_an_answer_too(at in 0usize..SQUARE.len(), byte: u8, end in 0usize..SQUARE.len()) {
            let mut bytes = SQUARE.as_bytes().to_vec();
            bytes[at] = byte;
            let _ = marked_mesh_from_ply(&bytes);
            let _ = marked_mesh_from_ply(&bytes[..end]);
        }
    }
}
