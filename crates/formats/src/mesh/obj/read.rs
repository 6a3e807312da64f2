//! Reads Wavefront OBJ: the lines `v` and `f`, colors after vertices, and the groups `o`, `g` and `usemtl`.

use crate::mesh::foreign::{MeshFileError, bad_line, mesh_of, numbers, point};
use crate::mesh::marked_mesh::{
    Mark, MarkValues, Marked, MarkedMesh, channel_of_fraction, on_triangles,
};
use partprobe_carrier::{Mesh, Point};
use std::collections::BTreeMap;

/// The mesh of an OBJ file. Lines that are neither vertices nor faces are skipped.
///
/// # Errors
/// If a vertex or a face cannot be read, or there is no face.
pub fn mesh_from_obj(bytes: &[u8]) -> Result<Mesh, MeshFileError> {
    let content = Content::of(bytes)?;
    mesh_of(content.vertices, &content.polygons)
}

/// The mesh of an OBJ file with its objects (`o`), groups (`g`), materials (`usemtl`) and vertex colors (`v x y z r g b`).
///
/// Groups with the same name are one group, at any position in the file. Faces before the first line of a kind form their own
/// group. Colors may be fractions or count to 255. A vertex without a color is black if others have one.
///
/// # Errors
/// If a vertex or a face cannot be read, or there is no face.
pub fn marked_mesh_from_obj(bytes: &[u8]) -> Result<MarkedMesh, MeshFileError> {
    let content = Content::of(bytes)?;
    let groups = content.groups.iter().filter(|groups| groups.is_used());
    let mut marks: Vec<Mark> = groups
        .map(|groups| Mark {
            name: groups.name.to_owned(),
            of: Marked::Triangles,
            values: MarkValues::Groups(on_triangles(&content.polygons, &groups.of_polygon)),
        })
        .collect();
    if content.colors.iter().any(Option::is_some) {
        marks.push(Mark {
            name: "color".to_owned(),
            of: Marked::Vertices,
            values: MarkValues::Colors(channels(&content.colors)),
        });
    }
    let mesh = mesh_of(content.vertices, &content.polygons)?;
    Ok(MarkedMesh { mesh, marks })
}

/// The data from the lines of a file.
struct Content {
    vertices: Vec<Point>,
    colors: Vec<Option<Point>>,
    polygons: Vec<Vec<i64>>,
    groups: [Groups; 3],
}

impl Content {
    fn of(bytes: &[u8]) -> Result<Self, MeshFileError> {
        let mut content = Self {
            vertices: Vec::new(),
            colors: Vec::new(),
            polygons: Vec::new(),
            groups: [("o", "object"), ("g", "group"), ("usemtl", "material")]
                .map(|(keyword, name)| Groups::new(keyword, name)),
        };
        for (idx, text) in String::from_utf8_lossy(bytes).lines().enumerate() {
            content.read(idx + 1, text)?;
        }
        Ok(content)
    }

    fn read(&mut self, number: usize, text: &str) -> Result<(), MeshFileError> {
        let mut words = text.split_ascii_whitespace();
        let Some(keyword) = words.next() else {
            return Ok(());
        };
        match keyword {
            "v" => {
                let values = numbers(words.clone().take(3), (number, text))?;
                let vertex = point(&values).ok_or_else(|| bad_line(number, text))?;
                self.vertices.push(vertex);
                self.colors.push(color(words.skip(3)));
            }
            "f" => {
                // `vertex/texture/normal`; negative indices count from the last vertex so far.
                let corners: Vec<i64> = numbers(
                    words.map(|word| word.split('/').next().unwrap_or(word)),
                    (number, text),
                )?;
                let n_vertices = self.vertices.len() as i64;
                let from_start = |corner: i64| match corner {
                    1.. => corner - 1,
                    0 => -1,
                    _ => n_vertices.saturating_add(corner),
                };
                self.polygons
                    .push(corners.into_iter().map(from_start).collect());
                for groups in &mut self.groups {
                    groups.of_polygon.push(groups.current);
                }
            }
            _ => {
                for groups in &mut self.groups {
                    if groups.keyword == keyword {
                        groups.begin(text);
                    }
                }
            }
        }
        Ok(())
    }
}

/// One kind of groups, and the group of each face.
struct Groups {
    keyword: &'static str,
    name: &'static str,
    /// The number of the next face's group.
    current: u32,
    numbers: BTreeMap<String, u32>,
    of_polygon: Vec<u32>,
}

impl Groups {
    fn new(keyword: &'static str, name: &'static str) -> Self {
        Self {
            keyword,
            name,
            current: 0,
            // The group of the faces before the first line of this kind.
            numbers: BTreeMap::from([(String::new(), 0)]),
            of_polygon: Vec::new(),
        }
    }

    fn begin(&mut self, line: &str) {
        let name = line.trim_start().trim_start_matches(self.keyword).trim();
        let next = self.numbers.len() as u32;
        self.current = *self.numbers.entry(name.to_owned()).or_insert(next);
    }

    fn is_used(&self) -> bool {
        self.of_polygon.iter().any(|&group| group != 0)
    }
}

/// The color after the coordinates of a vertex. Returns `None` if there are not three numbers.
fn color<'a>(words: impl Iterator<Item = &'a str>) -> Option<Point> {
    let values: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
    point(&values)
}

/// Some programs write fractions, and some count to 255.
fn channels(colors: &[Option<Point>]) -> Vec<[u16; 3]> {
    let counts = colors.iter().flatten().flatten().any(|&value| value > 1.0);
    let full = if counts { 255.0 } else { 1.0 };
    let channels = |color: &Option<Point>| {
        color
            .unwrap_or_default()
            .map(|value| channel_of_fraction(value / full))
    };
    colors.iter().map(channels).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::foreign::tests::corners;
    use proptest::prelude::*;

    #[test]
    fn polygons_textures_and_negative_indices_are_read() {
        let text = "# a comment\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nvn 0 0 1\nf 1/2/3 2//1 3\nv 0 1 0\nf -4 -2 -1\n";
        let found = corners(&mesh_from_obj(text.as_bytes()).unwrap());
        let [a, b, c, d] = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        assert_eq!(found, [[a, b, c], [a, c, d]]);
    }

    #[test]
    fn damage_is_located() {
        for (text, expected) in [
            ("v 0 0\n", bad_line(1, "v 0 0")),
            ("v 0 0 0\nf 1 x 1\n", bad_line(2, "f 1 x 1")),
            (
                "v 0 0 0\nf 0 1 1\n",
                MeshFileError::Index {
                    vertex: -1,
                    n_vertices: 1,
                },
            ),
            ("", MeshFileError::NoFace),
        ] {
            assert_eq!(mesh_from_obj(text.as_bytes()), Err(expected.clone()));
            assert_eq!(marked_mesh_from_obj(text.as_bytes()), Err(expected));
        }
    }

    fn groups(name: &str, of_triangle: &[u32]) -> Mark {
        Mark {
            name: name.to_owned(),
            of: Marked::Triangles,
            values: MarkValues::Groups(of_triangle.to_vec()),
        }
    }

    fn colors(of_vertex: &[[u16; 3]]) -> Mark {
        Mark {
            name: "color".to_owned(),
            of: Marked::Vertices,
            values: MarkValues::Colors(of_vertex.to_vec()),
        }
    }

    #[track_caller]
    fn check_marks(vertices: &str, faces: &str, expected: &[Mark]) {
        let text = format!("{vertices}{faces}");
        let found = marked_mesh_from_obj(text.as_bytes()).unwrap();
        assert_eq!(found.marks, expected);
    }

    #[test]
    fn objects_groups_and_materials_are_marks() {
        const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
        let once = "g wing\nf 1 2 3 4\ng tail fin\nf 1 2 3\ng wing\nf 1 3 4\n";
        check_marks(SQUARE, once, &[groups("group", &[1, 1, 2, 1])]);
        let before = "f 1 2 3\nusemtl steel\nf 1 3 4\n";
        check_marks(SQUARE, before, &[groups("material", &[0, 1])]);
        let both = "o a\nusemtl x\nf 1 2 3\no b\nf 1 3 4\n";
        check_marks(
            SQUARE,
            both,
            &[groups("object", &[1, 2]), groups("material", &[1, 1])],
        );
        check_marks(SQUARE, "f 1 2 3\no later\n", &[]);
    }

    #[test]
    fn colors_are_fractions_or_bytes() {
        let faces = "f 1 2 3\n";
        let [black, red, white] = [[0; 3], [65535, 0, 0], [65535; 3]];
        check_marks(
            "v 0 0 0 1 0 0\nv 1 0 0 1 1 1\nv 1 1 0 0 0 0\n",
            faces,
            &[colors(&[red, white, black])],
        );
        check_marks(
            "v 0 0 0 255 0 0  #7\nv 1 0 0\nv 1 1 0 255 255 255  #9\n",
            faces,
            &[colors(&[red, black, white])],
        );
        check_marks("v 0 0 0 1 0\nv 1 0 0 1.0\nv 1 1 0\n", faces, &[]);
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_reader_panic(
            text in "((v|f|o|g|usemtl)( (-?[0-9]{1,20}|[0-9]\\.[0-9]|nan|x|1//2|é)){0,7}\n){0,12}",
            body: Vec<u8>,
        ) {
            let _ = marked_mesh_from_obj(&body);
            let _ = marked_mesh_from_obj(&[text.into_bytes(), body].concat());
        }
    }
}
