//! Writes a carrier as glTF 2.0 binary: one node per part below the nodes of its product, or one mesh of all parts. Meshes have
//! normals, colors and three sets of feature ids.
//!
//! In the buffers, positions are in millimeters and z is up. The node scales to meters and rotates y up, as glTF requires. Colors
//! are per vertex, which is exact because a vertex belongs to one face. Feature ids follow `EXT_mesh_features`: `_FEATURE_ID_0`
//! is the part, `_FEATURE_ID_1` the face, `_FEATURE_ID_2` the primitive type.

use partprobe_carrier::{Carrier, FaceType, smooth_normals};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Feature ids are 32-bit floats, the only wide type of glTF for vertices. Integers are exact up to this number.
const MAX_FEATURES: usize = 1 << 24;
/// glTF's number for 32-bit floats.
const FLOAT: u32 = 5126;
/// glTF's number for bytes.
const UNSIGNED_BYTE: u32 = 5121;
/// glTF's number for 32-bit indices.
const UNSIGNED_INT: u32 = 5125;
/// glTF's number for a buffer of vertex attributes.
const ARRAY_BUFFER: u32 = 34962;
/// glTF's number for a buffer of indices.
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The division of a shape into nodes, which viewers and modeling programs list, hide and select.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GlbNodes {
    /// One node with a mesh per part, below nodes for the products of the assembly.
    Parts,
    /// One node with one mesh.
    One,
}

/// The reason why a carrier cannot be written as GLB.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GlbError {
    /// glTF has no empty meshes.
    #[error("the carrier has no triangle, and glTF has no empty meshes")]
    Empty,
    /// A coordinate is not a number.
    #[error("vertex {0} is not finite; label the file again")]
    NotFinite(usize),
    /// There are more faces than feature ids can count.
    #[error("{0} faces are more than the 16777216 that feature ids can count; export it as ply")]
    TooManyFaces(usize),
    /// The file would pass the 4 GiB of the format.
    #[error("the mesh needs more than the 4 GiB of a GLB; export it as ply")]
    TooLarge,
    /// The number of colors differs from the number of faces.
    #[error("{found} colors for {expected} faces")]
    Colors {
        /// The number of given colors.
        found: usize,
        /// The number of faces of the carrier.
        expected: usize,
    },
}

/// The bytes of a GLB.
///
/// `part_of_face` fills `_FEATURE_ID_0`, and `color_of_face` (sRGB) fills the vertex colors. Each has one entry per face.
///
/// # Errors
/// If the mesh is empty, not finite or too large for the format, or an entry is missing.
pub fn carrier_to_glb(
    carrier: &Carrier,
    part_of_face: &[i32],
    color_of_face: &[[u8; 3]],
    nodes: GlbNodes,
) -> Result<Vec<u8>, GlbError> {
    let (mesh, expected) = (carrier.mesh(), carrier.graph().faces.len());
    for found in [color_of_face.len(), part_of_face.len()] {
        if found != expected {
            return Err(GlbError::Colors { found, expected });
        }
    }
    if mesh.triangles.is_empty() {
        return Err(GlbError::Empty);
    }
    if expected > MAX_FEATURES {
        return Err(GlbError::TooManyFaces(expected));
    }
    if let Some(vertex) = mesh
        .vertices
        .iter()
        .position(|at| at.iter().any(|&x| !(x as f32).is_finite()))
    {
        return Err(GlbError::NotFinite(vertex));
    }
    let mut buffer = Buffer::default();
    let shape = ShapeData {
        carrier,
        part_of_face,
        color_of_face,
        normals: smooth_normals(mesh),
    };
    let scene = match nodes {
        GlbNodes::One => shape.one_node(&mut buffer),
        GlbNodes::Parts => shape.node_of_each_part(&mut buffer),
    };
    container(&document(scene, buffer.json()), buffer.bytes)
}

/// The data of the nodes and meshes.
struct ShapeData<'a> {
    carrier: &'a Carrier,
    part_of_face: &'a [i32],
    color_of_face: &'a [[u8; 3]],
    /// The normal at each vertex.
    normals: Vec<[f32; 3]>,
}

/// Nodes, of which the first is the root, and their meshes.
#[derive(Default)]
struct Scene {
    nodes: Vec<Value>,
    meshes: Vec<Value>,
}

impl Scene {
    /// Adds a node below another one, and returns its index.
    fn add_child(&mut self, parent: usize, node: Value) -> usize {
        let child = self.nodes.len();
        self.nodes.push(node);
        match self.nodes[parent]["children"].as_array_mut() {
            Some(children) => children.push(child.into()),
            None => self.nodes[parent]["children"] = json!([child]),
        }
        child
    }
}

impl ShapeData<'_> {
    fn one_node(&self, buffer: &mut Buffer) -> Scene {
        let mut root = self.root();
        root["mesh"] = 0.into();
        let name = &self.carrier.meta().id;
        let primitive = self.primitive(buffer, |_| true);
        Scene {
            nodes: vec![root],
            meshes: vec![
                json!({ "name": name, "primitives": [primitive], "extras": self.facts() }),
            ],
        }
    }

    /// The parts of each product occurrence are below the node of the occurrence. A part without a triangle has no node.
    fn node_of_each_part(&self, buffer: &mut Buffer) -> Scene {
        let mut root = self.root();
        root["extras"] = self.facts();
        let mut scene = Scene {
            nodes: vec![root],
            ..Scene::default()
        };
        let faces = &self.carrier.graph().faces;
        let mut faces_of: BTreeMap<(u32, bool, i32), BTreeSet<u32>> = BTreeMap::new();
        for &face in &self.carrier.mesh().tri_face {
            let part = self.part_of_face[face as usize];
            // Faces without a part come last.
            let key = (faces[face as usize].instance, part < 0, part);
            faces_of.entry(key).or_default().insert(face);
        }
        let mut folders = BTreeMap::new();
        let mut occurrence: Option<(u32, usize)> = None;
        for ((instance, _, part), members) in &faces_of {
            let parent = match occurrence {
                Some((known, node)) if known == *instance => node,
                _ => self.occurrence_node(&mut scene, &mut folders, *instance),
            };
            occurrence = Some((*instance, parent));
            let name = if *part < 0 {
                "no part".to_owned()
            } else {
                format!("part {part}")
            };
            let primitive = self.primitive(buffer, |face| members.contains(&face));
            let extras = json!({ "part": part, "faces": members });
            scene.add_child(
                parent,
                json!({ "mesh": scene.meshes.len(), "name": name, "extras": extras }),
            );
            scene
                .meshes
                .push(json!({ "name": name, "primitives": [primitive] }));
        }
        scene
    }

    /// Makes the node of a product occurrence, below the nodes of the products that contain it. It is the root if the file names
    /// no products.
    fn occurrence_node(
        &self,
        scene: &mut Scene,
        folders: &mut BTreeMap<String, usize>,
        instance: u32,
    ) -> usize {
        let instances = &self.carrier.meta().instances;
        let path = instances
            .get(instance as usize)
            .map_or("", |instance| instance.path.as_str());
        if path.is_empty() {
            return 0;
        }
        let (above, own) = path.rsplit_once('/').unwrap_or(("", path));
        let (mut parent, mut so_far) = (0, String::new());
        for name in above.split('/').filter(|name| !name.is_empty()) {
            so_far = so_far + "/" + name;
            parent = match folders.get(&so_far) {
                Some(&known) => known,
                None => scene.add_child(parent, json!({ "name": name })),
            };
            folders.insert(so_far.clone(), parent);
        }
        // Two occurrences of the same product have different nodes.
        scene.add_child(parent, json!({ "name": own }))
    }

    /// The root, which scales to meters and rotates y up.
    fn root(&self) -> Value {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let name = &self.carrier.meta().id;
        json!({ "name": name, "rotation": [-half, 0.0, 0.0, half], "scale": [0.001, 0.001, 0.001] })
    }

    /// The data of the faces.
    fn facts(&self) -> Value {
        let (meta, faces) = (self.carrier.meta(), &self.carrier.graph().faces);
        json!({
            "source_sha256": meta.source_sha256,
            "theta_deg": meta.theta_deg,
            "tau_min": meta.tau_min,
            "type_names": FaceType::ALL.map(FaceType::name),
            "face_part": self.part_of_face,
            "face_type": faces.iter().map(|face| face.face_type.code()).collect::<Vec<_>>(),
            "face_step_id": faces.iter().map(|face| face.step_id).collect::<Vec<_>>(),
        })
    }
}

impl ShapeData<'_> {
    /// The attributes, indices and feature sets of the faces that belong to a mesh.
    fn primitive(&self, buffer: &mut Buffer, belongs: impl Fn(u32) -> bool) -> Value {
        let (mesh, faces) = (self.carrier.mesh(), &self.carrier.graph().faces);
        let is_own = |&vertex: &usize| belongs(mesh.vertex_face[vertex]);
        let vertices: Vec<usize> = (0..mesh.vertices.len()).filter(is_own).collect();
        let face_of_vertex = || {
            vertices
                .iter()
                .map(|&vertex| mesh.vertex_face[vertex] as usize)
        };
        let positions = vertices
            .iter()
            .map(|&vertex| mesh.vertices[vertex].map(|x| x as f32));
        let normals = vertices.iter().map(|&vertex| self.normals[vertex]);
        let colors = face_of_vertex().map(|face| linear_rgba(self.color_of_face[face]));
        let sets = [
            FeatureSet::new("part", face_of_vertex().map(|face| self.part_of_face[face])),
            FeatureSet::new("face", face_of_vertex().map(|face| face as i32)),
            FeatureSet::new(
                "type",
                face_of_vertex().map(|face| i32::from(faces[face].face_type.code())),
            ),
        ];
        let mut attributes = json!({
            "POSITION": buffer.positions(&positions.collect::<Vec<_>>()),
            "NORMAL": buffer.vectors(&normals.collect::<Vec<_>>()),
            "COLOR_0": buffer.colors(&colors.collect::<Vec<_>>()),
        });
        for (number, set) in sets.iter().enumerate() {
            attributes[format!("_FEATURE_ID_{number}")] = buffer.numbers(&set.ids).into();
        }
        let feature_ids: Vec<Value> = sets
            .iter()
            .enumerate()
            .map(|(number, set)| set.json(number))
            .collect();
        let own = mesh.triangles.iter().zip(&mesh.tri_face);
        let own = own.filter(|&(_, &face)| belongs(face));
        // The vertices of a face belong only to it, so all corners are among them, in the same order.
        let place = |corner: u32| {
            vertices
                .binary_search(&(corner as usize))
                .map_or(0, |at| at as u32)
        };
        let triangles: Vec<[u32; 3]> = own.map(|(corners, _)| corners.map(place)).collect();
        json!({
            "attributes": attributes,
            "indices": buffer.indices(&triangles),
            "material": 0,
            "mode": 4,
            "extensions": { "EXT_mesh_features": { "featureIds": feature_ids } },
        })
    }
}

/// One set of feature ids: one number per vertex.
struct FeatureSet {
    label: &'static str,
    ids: Vec<f32>,
    n_features: usize,
    /// The number that means "none", if a vertex has no id.
    null_id: Option<usize>,
}

impl FeatureSet {
    /// Negative ids mean "none". They become the number after the last id.
    fn new(label: &'static str, ids: impl Iterator<Item = i32>) -> Self {
        let ids: Vec<i32> = ids.collect();
        let used: BTreeSet<i32> = ids.iter().copied().filter(|&id| id >= 0).collect();
        let null = used.last().map_or(0, |&last| last as usize + 1);
        let null_id = ids.iter().any(|&id| id < 0).then_some(null);
        let ids = ids
            .into_iter()
            .map(|id| if id < 0 { null as f32 } else { id as f32 })
            .collect();
        Self {
            label,
            ids,
            n_features: used.len(),
            null_id,
        }
    }

    fn json(&self, attribute: usize) -> Value {
        let mut set = json!({ "label": self.label, "attribute": attribute, "featureCount": self.n_features.max(1) });
        if let Some(null_id) = self.null_id {
            set["nullFeatureId"] = null_id.into();
        }
        set
    }
}

fn document(scene: Scene, buffers: BufferJson) -> Value {
    json!({
        "asset": { "version": "2.0", "generator": format!("partprobe {}", env!("CARGO_PKG_VERSION")) },
        "extensionsUsed": ["EXT_mesh_features"],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": scene.nodes,
        "materials": [{
            "name": "labels",
            "doubleSided": true,
            "pbrMetallicRoughness": { "baseColorFactor": [1.0, 1.0, 1.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8 },
        }],
        "meshes": scene.meshes,
        "accessors": buffers.accessors,
        "bufferViews": buffers.views,
        "buffers": [{ "byteLength": buffers.n_bytes }],
    })
}

/// The binary chunk, with the views and accessors that describe it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

/// The description of the buffer in the document.
struct BufferJson {
    views: Vec<Value>,
    accessors: Vec<Value>,
    n_bytes: usize,
}

impl Buffer {
    /// Appends bytes as a view with one accessor, and returns the accessor's index.
    fn push(&mut self, bytes: impl Iterator<Item = u8>, target: u32, mut accessor: Value) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        self.views.push(
            json!({ "buffer": 0, "byteOffset": start, "byteLength": length, "target": target }),
        );
        accessor["bufferView"] = (self.views.len() - 1).into();
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn positions(&mut self, rows: &[[f32; 3]]) -> usize {
        let bound = |pick: fn(f32, f32) -> f32, from: f32| {
            [0, 1, 2].map(|axis| f64::from(rows.iter().map(|row| row[axis]).fold(from, pick)))
        };
        let (min, max) = (
            bound(f32::min, f32::INFINITY),
            bound(f32::max, f32::NEG_INFINITY),
        );
        let accessor = json!({ "componentType": FLOAT, "type": "VEC3", "count": rows.len(), "min": min, "max": max });
        self.push(float_bytes(rows.as_flattened()), ARRAY_BUFFER, accessor)
    }

    fn vectors(&mut self, rows: &[[f32; 3]]) -> usize {
        let accessor = json!({ "componentType": FLOAT, "type": "VEC3", "count": rows.len() });
        self.push(float_bytes(rows.as_flattened()), ARRAY_BUFFER, accessor)
    }

    fn colors(&mut self, rows: &[[u8; 4]]) -> usize {
        let accessor = json!({ "componentType": UNSIGNED_BYTE, "normalized": true, "type": "VEC4", "count": rows.len() });
        self.push(rows.as_flattened().iter().copied(), ARRAY_BUFFER, accessor)
    }

    fn numbers(&mut self, values: &[f32]) -> usize {
        let accessor = json!({ "componentType": FLOAT, "type": "SCALAR", "count": values.len() });
        self.push(float_bytes(values), ARRAY_BUFFER, accessor)
    }

    fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let corners = triangles.as_flattened();
        let accessor =
            json!({ "componentType": UNSIGNED_INT, "type": "SCALAR", "count": corners.len() });
        self.push(
            corners.iter().flat_map(|corner| corner.to_le_bytes()),
            ELEMENT_ARRAY_BUFFER,
            accessor,
        )
    }

    fn json(&mut self) -> BufferJson {
        let (views, accessors) = (
            std::mem::take(&mut self.views),
            std::mem::take(&mut self.accessors),
        );
        BufferJson {
            views,
            accessors,
            n_bytes: self.bytes.len(),
        }
    }
}

fn float_bytes(values: &[f32]) -> impl Iterator<Item = u8> {
    values.iter().flat_map(|value| value.to_le_bytes())
}

/// An opaque color in the linear form of glTF. Screens and palettes use sRGB (IEC 61966-2-1).
fn linear_rgba(srgb: [u8; 3]) -> [u8; 4] {
    let [red, green, blue] = srgb.map(|channel| {
        let value = f64::from(channel) / 255.0;
        let linear = if value <= 0.040_45 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        };
        (255.0 * linear).round() as u8
    });
    [red, green, blue, 255]
}

/// Header, JSON chunk (padded with spaces) and binary chunk (padded with zeros).
fn container(document: &Value, mut binary: Vec<u8>) -> Result<Vec<u8>, GlbError> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total =
        u32::try_from(12 + 8 + text.len() + 8 + binary.len()).map_err(|_| GlbError::TooLarge)?;
    let mut bytes = Vec::with_capacity(total as usize);
    bytes.extend(b"glTF");
    bytes.extend([2, total].map(u32::to_le_bytes).as_flattened());
    for (chunk, kind) in [(text, b"JSON"), (binary, b"BIN\0")] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::three_squares;

    const COLORS: [[u8; 3]; 3] = [[255, 0, 0], [255, 0, 0], [0, 128, 255]];

    fn document_and_binary(bytes: &[u8]) -> (Value, &[u8]) {
        let word = |at: usize| u32::from_le_bytes(*bytes[at..].first_chunk().unwrap()) as usize;
        assert_eq!(
            (&bytes[..4], word(4), word(8)),
            (&b"glTF"[..], 2, bytes.len())
        );
        assert_eq!(&bytes[16..20], b"JSON");
        let binary = 20 + word(12);
        assert_eq!(
            (
                &bytes[binary + 4..binary + 8],
                word(12) % 4,
                word(binary) % 4
            ),
            (&b"BIN\0"[..], 0, 0)
        );
        assert_eq!(binary + 8 + word(binary), bytes.len());
        (
            serde_json::from_slice(&bytes[20..binary]).unwrap(),
            &bytes[binary + 8..],
        )
    }

    /// The bytes that an accessor of the one primitive reads.
    fn accessor_bytes<'a>(document: &Value, binary: &'a [u8], accessor: &Value) -> &'a [u8] {
        let accessor = &document["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let [start, length] =
            ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        &binary[start..start + length]
    }

    fn floats(bytes: &[u8]) -> Vec<f32> {
        bytes
            .as_chunks()
            .0
            .iter()
            .map(|&chunk| f32::from_le_bytes(chunk))
            .collect()
    }

    #[test]
    fn every_attribute_can_be_read_back() {
        let carrier = three_squares();
        let bytes =
            carrier_to_glb(&carrier, carrier.part_of_face(), &COLORS, GlbNodes::One).unwrap();
        let (document, binary) = document_and_binary(&bytes);
        let primitive = &document["meshes"][0]["primitives"][0];
        let read = |name: &str| accessor_bytes(&document, binary, &primitive["attributes"][name]);
        let positions: Vec<f32> = carrier
            .mesh()
            .vertices
            .iter()
            .flatten()
            .map(|&x| x as f32)
            .collect();
        assert_eq!(floats(read("POSITION")), positions);
        assert_eq!(document["accessors"][0]["max"], json!([3.0, 1.0, 0.0]));
        assert_eq!(floats(read("NORMAL"))[33..], [0.0, 0.0, 1.0]);
        assert_eq!(
            floats(read("_FEATURE_ID_0")),
            [[0.0; 4], [0.0; 4], [1.0; 4]].as_flattened()
        );
        assert_eq!(
            floats(read("_FEATURE_ID_1")),
            [[0.0; 4], [1.0; 4], [2.0; 4]].as_flattened()
        );
        assert_eq!(
            floats(read("_FEATURE_ID_2")),
            [[0.0; 4], [0.0; 4], [1.0; 4]].as_flattened()
        );
        assert_eq!(read("COLOR_0")[44..], [0, 55, 255, 255]);
        let indices = accessor_bytes(&document, binary, &primitive["indices"]);
        let indices: Vec<u32> = indices
            .as_chunks()
            .0
            .iter()
            .map(|&chunk| u32::from_le_bytes(chunk))
            .collect();
        assert_eq!(indices, carrier.mesh().triangles.as_flattened());
        let sets = &primitive["extensions"]["EXT_mesh_features"]["featureIds"];
        assert_eq!(
            sets[0],
            json!({ "label": "part", "attribute": 0, "featureCount": 2 })
        );
        assert_eq!(
            document["meshes"][0]["extras"]["face_step_id"],
            json!([100, 101, 102])
        );
    }

    #[test]
    fn parts_are_nodes_below_their_products() {
        let carrier = three_squares();
        let mut graph = carrier.graph().clone();
        let mut meta = carrier.meta().clone();
        for (instance, path) in ["robot/arm/bolt", "robot/arm/bolt", "robot/plate"]
            .iter()
            .enumerate()
        {
            graph.faces[instance].instance = instance as u32;
            meta.instances.push(partprobe_carrier::Instance {
                path: (*path).to_owned(),
                product: None,
                transform: [[0.0; 4]; 4],
            });
        }
        let (mesh, layers) = (carrier.mesh().clone(), carrier.layers().clone());
        let carrier = Carrier::new(mesh, graph, layers, meta).unwrap();
        let bytes = carrier_to_glb(&carrier, &[0, 0, -1], &COLORS, GlbNodes::Parts).unwrap();
        let (document, binary) = document_and_binary(&bytes);

        fn tree(document: &Value, node: usize) -> String {
            let node = &document["nodes"][node];
            let children = node["children"].as_array().into_iter().flatten();
            let below: Vec<String> = children
                .map(|child| tree(document, child.as_u64().unwrap() as usize))
                .collect();
            let name = node["name"].as_str().unwrap();
            if below.is_empty() {
                name.to_owned()
            } else {
                format!("{name}({})", below.join(" "))
            }
        }
        let id = &carrier.meta().id;
        let expected = format!("{id}(robot(arm(bolt(part 0) bolt(part 0)) plate(no part)))");
        assert_eq!(tree(&document, 0), expected);
        assert_eq!(
            document["nodes"][0]["extras"]["face_part"],
            json!([0, 0, -1])
        );
        for (number, mesh) in document["meshes"].as_array().unwrap().iter().enumerate() {
            let primitive = &mesh["primitives"][0];
            let read = |accessor: &Value| accessor_bytes(&document, binary, accessor);
            let positions = floats(read(&primitive["attributes"]["POSITION"]));
            let own = carrier.mesh().vertices[4 * number..4 * number + 4].as_flattened();
            assert_eq!(positions, own.iter().map(|&x| x as f32).collect::<Vec<_>>());
            let indices = read(&primitive["indices"]);
            let largest = indices
                .as_chunks()
                .0
                .iter()
                .map(|&chunk| u32::from_le_bytes(chunk))
                .max();
            assert_eq!((indices.len(), largest), (24, Some(3)));
        }
    }

    #[test]
    fn a_face_without_a_part_has_the_null_feature() {
        let bytes = carrier_to_glb(&three_squares(), &[0, -1, 4], &COLORS, GlbNodes::One).unwrap();
        let (document, _) = document_and_binary(&bytes);
        let set = &document["meshes"][0]["primitives"][0]["extensions"]["EXT_mesh_features"]["featureIds"]
            [0];
        assert_eq!(
            set,
            &json!({ "label": "part", "attribute": 0, "featureCount": 2, "nullFeatureId": 5 })
        );
    }

    #[test]
    fn what_gltf_cannot_hold_is_refused() {
        let carrier = three_squares();
        let refused = |carrier: &Carrier, n_colors: usize| {
            carrier_to_glb(
                carrier,
                carrier.part_of_face(),
                &COLORS[..n_colors],
                GlbNodes::Parts,
            )
            .unwrap_err()
        };
        assert_eq!(
            refused(&carrier, 2),
            GlbError::Colors {
                found: 2,
                expected: 3
            }
        );
        let with = |change: fn(&mut partprobe_carrier::Mesh)| {
            let mut mesh = carrier.mesh().clone();
            change(&mut mesh);
            let (graph, meta) = (carrier.graph().clone(), carrier.meta().clone());
            Carrier::new(mesh, graph, carrier.layers().clone(), meta).unwrap()
        };
        let empty = with(|mesh| (mesh.triangles, mesh.tri_face) = Default::default());
        assert_eq!(refused(&empty, 3), GlbError::Empty);
        assert_eq!(
            refused(&with(|mesh| mesh.vertices[7][1] = 1e300), 3),
            GlbError::NotFinite(7)
        );
    }
}
