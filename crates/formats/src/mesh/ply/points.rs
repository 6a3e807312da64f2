//! Writes and reads PLY point clouds, binary little endian: `x y z nx ny nz`, a color and an integer `part`.

use crate::mesh::ply::header::Scalar;

/// The points of a PLY file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlyPoints {
    /// Positions.
    pub points: Vec<[f32; 3]>,
    /// Unit normals. They are empty if the file has none.
    pub normals: Vec<[f32; 3]>,
    /// The property `part`. It is empty if the file has none.
    pub parts: Vec<i32>,
}

/// The reason why bytes are not a PLY file that partprobe reads.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PlyError {
    /// The file does not begin with `ply`, or its header does not end.
    #[error("not a PLY file: it needs a first line `ply` and a line `end_header`")]
    NotPly,
    /// The file is written as text or big endian.
    #[error("`{0}` can't be read; save as binary_little_endian 1.0")]
    Format(String),
    /// A header line is not understood.
    #[error("header line `{0}` can't be understood")]
    HeaderLine(String),
    /// The first element is not the vertices, or has lists.
    #[error("the first element must be `vertex`, with plain properties")]
    FirstElement,
    /// A coordinate is missing.
    #[error("the vertices have no property `{0}`")]
    Missing(&'static str),
    /// There are fewer bytes than the header declares.
    #[error("{n_points} points of {stride} bytes do not fit the {n_bytes} bytes that follow")]
    Size {
        /// The number of vertices in the header.
        n_points: usize,
        /// The number of bytes of a vertex.
        stride: usize,
        /// The number of bytes after the header.
        n_bytes: usize,
    },
}

/// The bytes of a point cloud. Normals and parts are left out if they are empty.
///
/// Otherwise, normals and parts need one entry per point. Additional entries are left out.
#[must_use]
pub fn points_to_ply(cloud: &PlyPoints) -> Vec<u8> {
    colored_points_to_ply(cloud, &[])
}

/// The same with one color per point, in the properties `red`, `green` and `blue` that viewers show.
#[must_use]
pub fn colored_points_to_ply(cloud: &PlyPoints, colors: &[[u8; 3]]) -> Vec<u8> {
    let (has_normals, has_parts) = (!cloud.normals.is_empty(), !cloud.parts.is_empty());
    let mut names: Vec<&str> = vec!["float x", "float y", "float z"];
    names.extend(
        ["float nx", "float ny", "float nz"]
            .iter()
            .filter(|_| has_normals),
    );
    names.extend(
        ["uchar red", "uchar green", "uchar blue"]
            .iter()
            .filter(|_| !colors.is_empty()),
    );
    names.extend(["int part"].iter().filter(|_| has_parts));
    let properties: String = names
        .iter()
        .map(|name| format!("property {name}\n"))
        .collect();
    let n_points = cloud.points.len();
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {n_points}\n{properties}end_header\n"
    )
    .into_bytes();
    for (idx, point) in cloud.points.iter().enumerate() {
        let normal = cloud.normals.get(idx).filter(|_| has_normals);
        let numbers = point.iter().chain(normal.into_iter().flatten());
        bytes.extend(numbers.flat_map(|x| x.to_le_bytes()));
        bytes.extend(colors.get(idx).into_iter().flatten());
        bytes.extend(
            cloud
                .parts
                .get(idx)
                .into_iter()
                .flat_map(|part| part.to_le_bytes()),
        );
    }
    bytes
}

/// The points in the bytes of a PLY file. Properties with other names are skipped.
///
/// # Errors
/// If the header is damaged, the file is not binary little endian, a coordinate is missing, or bytes are missing.
pub fn points_from_ply(bytes: &[u8]) -> Result<PlyPoints, PlyError> {
    let (header, body) = split_header(bytes)?;
    let layout = layout(header)?;
    let needed = layout.n_points.checked_mul(layout.stride);
    let size = PlyError::Size {
        n_points: layout.n_points,
        stride: layout.stride,
        n_bytes: body.len(),
    };
    let body = needed.and_then(|needed| body.get(..needed)).ok_or(size)?;
    let vector = |names: [&'static str; 3]| -> Result<Vec<[f32; 3]>, PlyError> {
        let [x, y, z] = names.map(|name| layout.column(body, name).ok_or(PlyError::Missing(name)));
        Ok(x?
            .into_iter()
            .zip(y?)
            .zip(z?)
            .map(|((x, y), z)| [x as f32, y as f32, z as f32])
            .collect())
    };
    let points = vector(["x", "y", "z"])?;
    let normals = if layout.has("nx") {
        vector(["nx", "ny", "nz"])?
    } else {
        Vec::new()
    };
    let parts = layout
        .column(body, "part")
        .unwrap_or_default()
        .into_iter()
        .map(|part| part as i32)
        .collect();
    Ok(PlyPoints {
        points,
        normals,
        parts,
    })
}

fn split_header(bytes: &[u8]) -> Result<(&str, &[u8]), PlyError> {
    const END: &[u8] = b"end_header\n";
    let at = bytes
        .windows(END.len())
        .position(|window| window == END)
        .ok_or(PlyError::NotPly)?;
    let (header, body) = bytes.split_at(at);
    let header = std::str::from_utf8(header).map_err(|_| PlyError::NotPly)?;
    let header = header.strip_prefix("ply\n").ok_or(PlyError::NotPly)?;
    Ok((header, &body[END.len()..]))
}

/// The positions of the properties in a vertex.
struct Layout {
    n_points: usize,
    stride: usize,
    properties: Vec<Property>,
}

struct Property {
    name: String,
    offset: usize,
    scalar: Scalar,
}

fn layout(header: &str) -> Result<Layout, PlyError> {
    let mut layout: Option<Layout> = None;
    for line in header.lines() {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match (words.as_slice(), &mut layout) {
            (["format", "binary_little_endian", "1.0"] | ["comment" | "obj_info", ..] | [], _) => {}
            (["format", format, ..], _) => return Err(PlyError::Format((*format).to_owned())),
            (["element", "vertex", count], None) => {
                let n_points = count
                    .parse()
                    .map_err(|_| PlyError::HeaderLine(line.to_owned()))?;
                layout = Some(Layout {
                    n_points,
                    stride: 0,
                    properties: Vec::new(),
                });
            }
            // Elements after the vertices are not read.
            (["element", ..], Some(_)) => break,
            (["element", ..], None) | (["property", "list", ..], _) => {
                return Err(PlyError::FirstElement);
            }
            (["property", scalar, name], Some(layout)) => {
                let scalar =
                    Scalar::named(scalar).ok_or_else(|| PlyError::HeaderLine(line.to_owned()))?;
                layout.properties.push(Property {
                    name: (*name).to_owned(),
                    offset: layout.stride,
                    scalar,
                });
                layout.stride += scalar.size();
            }
            _ => return Err(PlyError::HeaderLine(line.to_owned())),
        }
    }
    layout.ok_or(PlyError::FirstElement)
}

impl Layout {
    fn has(&self, name: &str) -> bool {
        self.properties.iter().any(|property| property.name == name)
    }

    /// The values of a property, one per vertex of `body`.
    fn column(&self, body: &[u8], name: &str) -> Option<Vec<f64>> {
        let property = self
            .properties
            .iter()
            .find(|property| property.name == name)?;
        let value = |vertex: &[u8]| property.scalar.read(vertex.get(property.offset..)?);
        body.chunks_exact(self.stride.max(1)).map(value).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn clouds_round_trip(rows in proptest::collection::vec((-9.0f32..9.0, -1.0f32..1.0, any::<i32>()), 0..20), normals: bool, parts: bool) {
            let cloud = PlyPoints {
                points: rows.iter().map(|row| [row.0, -row.0, 1.0]).collect(),
                normals: rows.iter().filter(|_| normals).map(|row| [row.1, 0.0, 1.0]).collect(),
                parts: rows.iter().filter(|_| parts).map(|row| row.2).collect(),
            };
            prop_assert_eq!(points_from_ply(&points_to_ply(&cloud)), Ok(cloud));
        }

        #[test]
        fn no_header_makes_the_reader_panic(lines in "(element|property|format|list|vertex|int|x|[0-9]{1,20}| |\n){0,30}", body: Vec<u8>) {
            let mut bytes = format!("ply\n{lines}\nend_header\n").into_bytes();
            bytes.extend(body);
            let _ = points_from_ply(&bytes);
        }
    }

    #[track_caller]
    fn check_refusal(header: &str, expected: PlyError) {
        assert_eq!(points_from_ply(header.as_bytes()), Err(expected));
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        check_refusal("", PlyError::NotPly);
        check_refusal(
            "ply\nformat ascii 1.0\nend_header\n",
            PlyError::Format("ascii".to_owned()),
        );
        check_refusal("ply\nelement face 2\nend_header\n", PlyError::FirstElement);
        check_refusal(
            "ply\nelement vertex 0\nproperty list uchar int x\nend_header\n",
            PlyError::FirstElement,
        );
        check_refusal(
            "ply\nelement vertex 0\nproperty float x\nend_header\n",
            PlyError::Missing("y"),
        );
        check_refusal(
            "ply\nelement vertex many\nend_header\n",
            PlyError::HeaderLine("element vertex many".to_owned()),
        );
        let size = PlyError::Size {
            n_points: 1_000_000_000_000,
            stride: 4,
            n_bytes: 0,
        };
        check_refusal(
            "ply\nelement vertex 1000000000000\nproperty float x\nend_header\n",
            size,
        );
    }

    #[test]
    fn colors_are_properties_of_points() {
        let cloud = PlyPoints {
            points: vec![[1.0, 2.0, 3.0]; 2],
            normals: Vec::new(),
            parts: vec![7, 8],
        };
        let bytes = colored_points_to_ply(&cloud, &[[1, 2, 3], [4, 5, 6]]);
        let text = String::from_utf8_lossy(&bytes);
        let names =
            "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty int part\n";
        assert!(text.contains(names), "{text}");
        assert_eq!(bytes[bytes.len() - 7..], [4, 5, 6, 8, 0, 0, 0]);
        assert_eq!(points_from_ply(&bytes), Ok(cloud));
    }

    #[test]
    fn other_types_and_orders_are_read() {
        let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar part\nproperty double z\nproperty float y\nproperty short x\nelement face 1\nproperty list uchar int v\nend_header\n".to_vec();
        bytes.push(9);
        bytes.extend(3.0f64.to_le_bytes());
        bytes.extend(2.0f32.to_le_bytes());
        bytes.extend(1i16.to_le_bytes());
        let cloud = PlyPoints {
            points: vec![[1.0, 2.0, 3.0]],
            normals: Vec::new(),
            parts: vec![9],
        };
        assert_eq!(points_from_ply(&bytes), Ok(cloud));
    }
}
