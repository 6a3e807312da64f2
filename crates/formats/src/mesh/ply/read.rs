//! Reads PLY files with any properties, as text or in either byte order: positions, normals and faces.

use crate::mesh::foreign::{MeshFileError, mesh_of};
use crate::mesh::ply::header::{Element, Encoding, Header, Property, Scalar, split_header};
use partprobe_carrier::{Mesh, Point};

/// The content of a PLY file.
#[derive(Clone, Debug, PartialEq)]
pub enum PlyScene {
    /// A surface.
    Mesh(Mesh),
    /// Points without faces. The normals are empty if the file has none.
    Points {
        /// Positions.
        points: Vec<[f32; 3]>,
        /// Normals: one per point, or an empty list.
        normals: Vec<[f32; 3]>,
    },
}

/// The surface or the points of a PLY file.
///
/// # Errors
/// If the header cannot be read, the file ends too early, or faces and vertices do not fit together.
pub fn scene_from_ply(bytes: &[u8]) -> Result<PlyScene, MeshFileError> {
    let content = Content::of(bytes, |_, _| {})?;
    if content.polygons.is_empty() {
        return Ok(PlyScene::Points {
            points: content.vertices.iter().map(in_single).collect(),
            normals: content.normals,
        });
    }
    mesh_of(content.vertices, &content.polygons).map(PlyScene::Mesh)
}

fn in_single(vertex: &Point) -> [f32; 3] {
    vertex.map(|x| x as f32)
}

/// The values of one row of an element: one list per property. A scalar is a list of one value.
pub(super) type Row = [Vec<f64>];

/// The data of the elements of a file.
#[derive(Default)]
pub(super) struct Content {
    pub(super) vertices: Vec<Point>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) polygons: Vec<Vec<i64>>,
}

impl Content {
    /// The content of a file. `on_row` gets each row of each element.
    pub(super) fn of(
        bytes: &[u8],
        mut on_row: impl FnMut(&Element, &Row),
    ) -> Result<Self, MeshFileError> {
        let (header, body) = split_header(bytes)?;
        let header = Header::parse(&header)?;
        let mut body = Body {
            encoding: header.encoding,
            rest: body,
        };
        let mut content = Self::default();
        for element in &header.elements {
            content.read(element, &mut body, &mut on_row)?;
        }
        Ok(content)
    }

    /// Reads all rows of an element. Those of unknown elements are skipped.
    fn read(
        &mut self,
        element: &Element,
        body: &mut Body<'_>,
        on_row: &mut impl FnMut(&Element, &Row),
    ) -> Result<(), MeshFileError> {
        let position = ["x", "y", "z"].map(|name| element.index_of(name));
        let normal = ["nx", "ny", "nz"].map(|name| element.index_of(name));
        let corners = element
            .properties
            .iter()
            .position(|p| p.name == "vertex_indices" || p.name == "vertex_index");
        // An element without properties has no bytes, for any declared number of rows.
        let count = if element.properties.is_empty() {
            0
        } else {
            element.count
        };
        for _ in 0..count {
            let row = body.row(element)?;
            on_row(element, &row);
            match element.name.as_str() {
                "vertex" => {
                    let position = vector(&row, position)
                        .ok_or_else(|| MeshFileError::Header("no property x, y, z".to_owned()))?;
                    self.vertices.push(position.map(|x| x.unwrap_or(f64::NAN)));
                    let normal = vector(&row, normal);
                    self.normals
                        .extend(normal.map(|normal| normal.map(|x| x.unwrap_or(0.0) as f32)));
                }
                "face" => self.polygons.extend(
                    corners.map(|at| row[at].iter().map(|&x| x as i64).collect::<Vec<_>>()),
                ),
                _ => {}
            }
        }
        Ok(())
    }
}

/// Three columns of a row, if the element has all of them. A coordinate is `None` if its list is empty.
fn vector(row: &Row, [x, y, z]: [Option<usize>; 3]) -> Option<[Option<f64>; 3]> {
    Some([x?, y?, z?].map(|at| row[at].first().copied()))
}

/// The bytes that have not been read yet.
struct Body<'a> {
    encoding: Encoding,
    rest: &'a [u8],
}

impl Body<'_> {
    /// The values of an element's next row, one list per property. A scalar is a list of one value.
    fn row(&mut self, element: &Element) -> Result<Vec<Vec<f64>>, MeshFileError> {
        let values = |property: &Property| {
            let length = property
                .length
                .map_or(Ok(1.0), |length| self.number(length))?;
            // Memory is not reserved for the declared length. If it is too large, reading fails at the end of the bytes.
            (0..length.max(0.0) as u64)
                .map(|_| self.number(property.scalar))
                .collect()
        };
        element.properties.iter().map(values).collect()
    }

    fn number(&mut self, scalar: Scalar) -> Result<f64, MeshFileError> {
        if self.encoding == Encoding::Text {
            return self
                .word()
                .and_then(|word| word.parse().ok())
                .ok_or(MeshFileError::Truncated);
        }
        let (own, rest) = self
            .rest
            .split_at_checked(scalar.size())
            .ok_or(MeshFileError::Truncated)?;
        self.rest = rest;
        let mut bytes = [0; 8];
        bytes[..own.len()].copy_from_slice(own);
        if self.encoding == Encoding::BigEndian {
            bytes[..own.len()].reverse();
        }
        scalar.read(&bytes).ok_or(MeshFileError::Truncated)
    }

    fn word(&mut self) -> Option<&str> {
        let start = self
            .rest
            .iter()
            .position(|byte| !byte.is_ascii_whitespace())?;
        let rest = &self.rest[start..];
        let end = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        self.rest = &rest[end..];
        std::str::from_utf8(&rest[..end]).ok()
    }
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::mesh::foreign::tests::corners;
    use crate::mesh::ply::points::{PlyPoints, points_to_ply};

    const HEADER: &str = "element vertex 4\nproperty float x\nproperty uchar red\nproperty double y\nproperty short z\n\
                          element edge 1\nproperty int a\n\
                          element face 1\nproperty list uchar int vertex_indices\nend_header\n";

    fn square(format: &str, order: fn(&[u8]) -> Vec<u8>) -> Vec<u8> {
        let mut bytes =
            format!("ply\nformat {format} 1.0\ncomment made by hand\n{HEADER}").into_bytes();
        for [x, y] in [[0.0f32, 0.0f32], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            bytes.extend(order(&x.to_le_bytes()));
            bytes.push(200);
            bytes.extend(order(&f64::from(y).to_le_bytes()));
            bytes.extend(order(&7i16.to_le_bytes()));
        }
        bytes.extend(order(&5i32.to_le_bytes()));
        bytes.push(4);
        (0..4i32).for_each(|k| bytes.extend(order(&k.to_le_bytes())));
        bytes
    }

    #[test]
    fn every_encoding_gives_the_same_surface() {
        let text = format!(
            "ply\nformat ascii 1.0\n{HEADER}0 9 0 7\n1 9 0 7\n1 9 1 7\n0 9 1 7\n5\n4 0 1 2 3\n"
        );
        let reversed = |bytes: &[u8]| bytes.iter().rev().copied().collect();
        let files = [
            text.into_bytes(),
            square("binary_little_endian", <[u8]>::to_vec),
            square("binary_big_endian", reversed),
        ];
        for bytes in files {
            let PlyScene::Mesh(mesh) = scene_from_ply(&bytes).unwrap() else {
                panic!("no mesh")
            };
            let [a, b, c, d] = [
                [0.0, 0.0, 7.0],
                [1.0, 0.0, 7.0],
                [1.0, 1.0, 7.0],
                [0.0, 1.0, 7.0],
            ];
            assert_eq!(corners(&mesh), [[a, b, c], [a, c, d]]);
            for n_bytes in 0..bytes.len() - 1 {
                assert!(scene_from_ply(&bytes[..n_bytes]).is_err());
            }
        }
    }

    #[test]
    fn points_keep_their_normals() {
        let cloud = PlyPoints {
            points: vec![[1.0, 2.0, 3.0]],
            normals: vec![[0.0, 1.0, 0.0]],
            parts: vec![4],
        };
        let expected = PlyScene::Points {
            points: cloud.points.clone(),
            normals: cloud.normals.clone(),
        };
        assert_eq!(scene_from_ply(&points_to_ply(&cloud)), Ok(expected));
    }

    #[test]
    fn claimed_sizes_are_not_trusted() {
        let file =
            |elements: &str| format!("ply\nformat ascii 1.0\n{elements}end_header\n").into_bytes();
        let endless = file("element vertex 18446744073709551615\n");
        assert_eq!(
            scene_from_ply(&endless),
            Ok(PlyScene::Points {
                points: vec![],
                normals: vec![]
            })
        );
        let many = file("element face 99999999999\nproperty list uint int vertex_index\n");
        assert_eq!(scene_from_ply(&many), Err(MeshFileError::Truncated));
        let flat = [
            file("element vertex 1\nproperty float x\n"),
            b"0\n".to_vec(),
        ]
        .concat();
        assert!(matches!(
            scene_from_ply(&flat),
            Err(MeshFileError::Header(_))
        ));
        for text in [
            "property float x\n",
            "element vertex many\n",
            "format binary 1.0\n",
            "vertex\n",
        ] {
            assert!(
                matches!(scene_from_ply(&file(text)), Err(MeshFileError::Header(_))),
                "{text}"
            );
        }
        assert_eq!(
            scene_from_ply(b"solid"),
            Err(MeshFileError::Kind("a PLY file"))
        );
    }
}
