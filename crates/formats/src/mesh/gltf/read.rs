//! Walks the scene of a glTF file: all triangles in one mesh, with their nodes, primitives, materials and vertex colors.

use crate::mesh::foreign::mesh_of;
use crate::mesh::gltf::accessor::{Buffers, Component, Table};
use crate::mesh::gltf::container::chunks;
use crate::mesh::gltf::document::{Document, Primitive};
use crate::mesh::gltf::error::GltfError;
use crate::mesh::gltf::pose::Pose;
use crate::mesh::marked_mesh::{
    Mark, MarkValues, Marked, MarkedMesh, channel_of_byte, channel_of_fraction,
};
use partprobe_carrier::Point;
use std::collections::BTreeMap;

/// The largest number of vertices or triangles. A limit is needed because a small file can use one mesh many times.
const MAX_ITEMS: usize = 1 << 25;

/// The surface of a glTF scene, with marks of its triangles and vertices.
///
/// The triangles follow the nodes of the scene, depth first, and in each node the primitives of its mesh. Positions are those of
/// the file after the poses of the nodes: glTF requires meters with y up, but many programs do not follow this. The marks are, in
/// this order: attributes that begin with `_` (under the label that `EXT_mesh_features` gives them), `node`, `primitive`,
/// `material`, and the color of the vertices. Points and lines are skipped.
///
/// `read` gives the bytes of a file in the same folder, by its address in the document.
///
/// # Errors
/// If the file or a buffer is damaged, or there is no triangle.
pub fn marked_mesh_from_gltf(
    bytes: &[u8],
    read: &dyn Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<MarkedMesh, GltfError> {
    let (json, binary) = chunks(bytes)?;
    let document = Document::parse(json)?;
    let buffers = Buffers::new(&document, binary, read)?;
    let mut surface = Surface::default();
    for (node, pose) in placed_nodes(&document)? {
        surface.add_node(&document, &buffers, node, &pose)?;
    }
    surface.marked_mesh()
}

/// The nodes of the scene with their poses in it, depth first.
fn placed_nodes(document: &Document) -> Result<Vec<(usize, Pose)>, GltfError> {
    let mut open: Vec<(usize, Pose)> = Vec::new();
    let with = |pose: Pose| move |&node: &usize| (node, pose);
    open.extend(document.roots()?.iter().rev().map(with(Pose::IDENTITY)));
    let mut is_seen = vec![false; document.nodes.len()];
    let mut placed = Vec::new();
    while let Some((index, parent)) = open.pop() {
        let node = document.nodes.get(index).ok_or(GltfError::Missing {
            what: "node",
            index,
        })?;
        if std::mem::replace(&mut is_seen[index], true) {
            return Err(GltfError::NotATree(index));
        }
        let pose = parent.after(&Pose::of_node(node));
        placed.push((index, pose));
        open.extend(node.children.iter().rev().map(with(pose)));
    }
    Ok(placed)
}

/// The data of the nodes that were read so far.
#[derive(Default)]
struct Surface {
    vertices: Vec<Point>,
    /// The colors of the vertices. They are black for primitives without colors, and empty if no primitive has colors.
    colors: Vec<[u16; 3]>,
    has_colors: bool,
    /// The values of each custom attribute. They are NaN for primitives without it.
    numbers: BTreeMap<String, Vec<f64>>,
    triangles: Vec<Vec<i64>>,
    node: Vec<u32>,
    primitive: Vec<u32>,
    /// The index of the material plus one, or 0 without a material.
    material: Vec<u32>,
    n_nodes: u32,
    n_primitives: u32,
}

impl Surface {
    fn add_node(
        &mut self,
        document: &Document,
        buffers: &Buffers<'_>,
        node: usize,
        pose: &Pose,
    ) -> Result<(), GltfError> {
        let Some(index) = document.nodes[node].mesh else {
            return Ok(());
        };
        let mesh = document.meshes.get(index).ok_or(GltfError::Missing {
            what: "mesh",
            index,
        })?;
        for primitive in &mesh.primitives {
            self.add_primitive(buffers, index, primitive, pose)?;
        }
        self.n_nodes += 1;
        Ok(())
    }

    fn add_primitive(
        &mut self,
        buffers: &Buffers<'_>,
        mesh: usize,
        primitive: &Primitive,
        pose: &Pose,
    ) -> Result<(), GltfError> {
        let refused = |reason| GltfError::Primitive { mesh, reason };
        let Some(fans) = Arrangement::of_mode(primitive.mode) else {
            // Points and lines have no surface.
            return match primitive.mode {
                0..=3 => Ok(()),
                _ => Err(refused("a mode is not in the specification")),
            };
        };
        let position = primitive.attributes.get("POSITION");
        let &position = position.ok_or_else(|| refused("a primitive has no positions"))?;
        let positions = buffers.table(position, &[3])?;
        let n_vertices = positions.values.len() / 3;
        let corners = match primitive.indices {
            Some(indices) => buffers.table(indices, &[1])?.values,
            None => (0..n_vertices).map(|vertex| vertex as f64).collect(),
        };
        if corners.iter().any(|&corner| corner >= n_vertices as f64) {
            return Err(refused("an index is larger than the number of vertices"));
        }
        self.ensure_room(n_vertices, corners.len())?;

        let first = self.vertices.len() as i64;
        let vertices = positions.values.as_chunks::<3>().0;
        self.vertices
            .extend(vertices.iter().map(|&vertex| pose.applied(vertex)));
        self.add_colors(buffers, mesh, primitive, n_vertices)?;
        self.add_numbers(buffers, mesh, primitive, n_vertices)?;

        let before = self.triangles.len();
        for mut triangle in fans.triangles(&corners) {
            if pose.mirrors() {
                triangle.swap(1, 2);
            }
            self.triangles
                .push(triangle.map(|corner| first + corner as i64).to_vec());
        }
        let n_triangles = self.triangles.len() - before;
        let material = primitive
            .material
            .map_or(0, |material| material.saturating_add(1));
        self.node
            .extend(std::iter::repeat_n(self.n_nodes, n_triangles));
        self.primitive
            .extend(std::iter::repeat_n(self.n_primitives, n_triangles));
        self.material
            .extend(std::iter::repeat_n(material, n_triangles));
        self.n_primitives += 1;
        Ok(())
    }

    fn ensure_room(&self, n_vertices: usize, n_corners: usize) -> Result<(), GltfError> {
        let is_too_many = self.vertices.len() + n_vertices > MAX_ITEMS
            || self.triangles.len() + n_corners > MAX_ITEMS;
        if is_too_many {
            Err(GltfError::TooLarge(MAX_ITEMS))
        } else {
            Ok(())
        }
    }

    fn add_colors(
        &mut self,
        buffers: &Buffers<'_>,
        mesh: usize,
        primitive: &Primitive,
        n_vertices: usize,
    ) -> Result<(), GltfError> {
        if let Some(&color) = primitive.attributes.get("COLOR_0") {
            let table = buffers.table(color, &[3, 4])?;
            if table.values.len() / table.width != n_vertices {
                let reason = "there is not one color per vertex";
                return Err(GltfError::Primitive { mesh, reason });
            }
            self.has_colors = true;
            let rows = table.values.chunks(table.width);
            self.colors
                .extend(rows.map(|row| [0, 1, 2].map(|at| channel(row[at], &table))));
        }
        self.colors.resize(self.vertices.len(), [0; 3]);
        Ok(())
    }

    fn add_numbers(
        &mut self,
        buffers: &Buffers<'_>,
        mesh: usize,
        primitive: &Primitive,
        n_vertices: usize,
    ) -> Result<(), GltfError> {
        let before = self.vertices.len() - n_vertices;
        for (attribute, &accessor) in &primitive.attributes {
            if !attribute.starts_with('_') {
                continue;
            }
            // An attribute of vectors is not a label.
            let table = buffers.table(accessor, &[1, 2, 3, 4])?;
            if table.width != 1 {
                continue;
            }
            if table.values.len() != n_vertices {
                let reason = "an attribute does not have one value per vertex";
                return Err(GltfError::Primitive { mesh, reason });
            }
            let features = primitive.feature_ids(attribute);
            let none = features.and_then(|features| features.null_feature_id);
            let name = features.and_then(|features| features.label.clone());
            let values = self
                .numbers
                .entry(name.unwrap_or_else(|| attribute.clone()))
                .or_default();
            values.resize(before, f64::NAN);
            values.extend(
                table.values.iter().map(
                    |&value| {
                        if Some(value) == none { f64::NAN } else { value }
                    },
                ),
            );
        }
        Ok(())
    }

    fn marked_mesh(mut self) -> Result<MarkedMesh, GltfError> {
        let n_vertices = self.vertices.len();
        let mut marks = Vec::new();
        let mut add = |name: &str, of, values| {
            marks.push(Mark {
                name: name.to_owned(),
                of,
                values,
            });
        };
        for (name, mut values) in std::mem::take(&mut self.numbers) {
            values.resize(n_vertices, f64::NAN);
            add(&name, Marked::Vertices, MarkValues::Numbers(values));
        }
        add("node", Marked::Triangles, MarkValues::Groups(self.node));
        add(
            "primitive",
            Marked::Triangles,
            MarkValues::Groups(self.primitive),
        );
        if self.material.iter().any(|&material| material != 0) {
            add(
                "material",
                Marked::Triangles,
                MarkValues::Groups(self.material),
            );
        }
        if self.has_colors {
            add("color", Marked::Vertices, MarkValues::Colors(self.colors));
        }
        let mesh = mesh_of(self.vertices, &self.triangles)?;
        Ok(MarkedMesh { mesh, marks })
    }
}

fn channel(value: f64, table: &Table) -> u16 {
    match table.component {
        Component::F32 => channel_of_fraction(value),
        Component::U16 => value as u16,
        _ => channel_of_byte(value.clamp(0.0, 255.0) as u8),
    }
}

/// The way in which corners form triangles.
#[derive(Clone, Copy)]
enum Arrangement {
    List,
    Strip,
    Fan,
}

impl Arrangement {
    fn of_mode(mode: u32) -> Option<Self> {
        match mode {
            4 => Some(Self::List),
            5 => Some(Self::Strip),
            6 => Some(Self::Fan),
            _ => None,
        }
    }

    /// The corners of each triangle, in the order that the specification gives.
    fn triangles(self, corners: &[f64]) -> Vec<[f64; 3]> {
        match self {
            Self::List => corners.as_chunks::<3>().0.to_vec(),
            Self::Strip => corners
                .windows(3)
                .enumerate()
                .map(|(number, window)| match number % 2 {
                    0 => [window[0], window[1], window[2]],
                    _ => [window[0], window[2], window[1]],
                })
                .collect(),
            Self::Fan => corners
                .windows(2)
                .skip(1)
                .map(|pair| [pair[0], pair[1], corners[0]])
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests;
