//! Reads and writes the carrier file: a labeled mesh and its face graph as an NPZ archive.

use crate::carrier::meta::MetaJson;
use crate::numpy::array::{Array, Element};
use crate::numpy::content_hash::ContentHash;
use crate::numpy::members::{MemberError, Members};
use crate::numpy::npz::{
    Compression, NpzError, NpzWriteError, NpzWriter, arrays_to_npz, hashed_arrays_from_npz,
};
use partprobe_carrier::{
    Carrier, CarrierError, CarrierMeta, Color, Edge, Face, FaceGraph, FaceType, GIVEN, LabelLayer,
    Mesh, STEP_PARTS, STEP_PARTS_RAW, SurfaceAttributes,
};
use std::borrow::Cow;

/// Longer names are cut, because NumPy stores every text of an array with the width of the longest one.
const MAX_NAME_CHARS: usize = 255;
/// The value of `face_solid` for a face that belongs to no solid.
const NO_SOLID: i32 = -1;
/// Parameters, curvatures and directions at the vertices.
const VERTEX_ATTRIBUTES: [&str; 3] = ["vertex_uv", "vertex_curvature", "vertex_direction"];
/// The prefix of the name of a member with a further layer of labels. The name of the source follows.
const LAYER_PREFIX: &str = "face_label_";
/// The value of `face_color` for a face without a color.
const NO_COLOR: u32 = 0;

/// The reason why bytes are not a carrier.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CarrierFileError {
    /// The archive is damaged, foreign or newer than the program.
    #[error(transparent)]
    Archive(#[from] NpzError),
    /// A member is missing or has another type or shape.
    #[error(transparent)]
    Member(#[from] MemberError),
    /// The settings are not JSON of the expected form.
    #[error("member `meta` can't be understood: {0}")]
    Meta(String),
    /// A type code is unknown.
    #[error("member `{member}` holds the type code {code}; codes end at 10")]
    FaceType {
        /// The member.
        member: &'static str,
        /// The code.
        code: u8,
    },
    /// A member has another number of rows than the faces or edges that it describes.
    #[error("member `{member}` has {found} rows for {expected}")]
    Rows {
        /// The member.
        member: String,
        /// The number of its rows.
        found: usize,
        /// The expected number of rows.
        expected: usize,
    },
    /// The members do not belong to one shape.
    #[error(transparent)]
    Carrier(#[from] CarrierError),
}

/// A carrier's file and the hash in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CarrierFile {
    /// The bytes of the file.
    pub bytes: Vec<u8>,
    /// The hash of its members, which [`hashed_carrier_from_npz`] returns.
    pub content_hash: ContentHash,
}

/// The bytes of a carrier file, without their hash.
///
/// # Errors
/// The same as for [`carrier_file`].
pub fn carrier_to_npz(
    carrier: &Carrier,
    compression: Compression,
) -> Result<Vec<u8>, NpzWriteError> {
    carrier_file(carrier, compression).map(|file| file.bytes)
}

/// A carrier as a file that contains the hash of its own members, so that later changes are detected.
///
/// Face names are cut after 255 characters. An empty name, and a color whose four bytes are 0, are read back as `None`.
///
/// # Errors
/// If the archive would pass the limits of zip.
pub fn carrier_file(
    carrier: &Carrier,
    compression: Compression,
) -> Result<CarrierFile, NpzWriteError> {
    let mut archive = NpzWriter::new(compression)?;
    // The large arrays are copies of the mesh, so only one of them is made at a time.
    for (name, array_of) in MESH_MEMBERS {
        archive.add(name, &array_of(carrier))?;
    }
    for (name, array) in small_members(carrier) {
        archive.add(&name, &array)?;
    }
    let (bytes, content_hash) = archive.finish_with_hash()?;
    Ok(CarrierFile {
        bytes,
        content_hash,
    })
}

/// The array that the carrier's file has under this name, without the file. Returns `None` if it has no such member.
///
/// Cost: a copy of that array. If it is not an array of the mesh, all arrays except those of the mesh are copied.
#[must_use]
pub fn carrier_array(carrier: &Carrier, name: &str) -> Option<Array> {
    let of_mesh = MESH_MEMBERS.iter().find(|(member, _)| *member == name);
    if let Some((_, array_of)) = of_mesh {
        return Some(array_of(carrier));
    }
    let mut members = small_members(carrier).into_iter();
    members
        .find(|(member, _)| member == name)
        .map(|(_, array)| array)
}

/// A member and its name.
type NamedArray = (Cow<'static, str>, Array);

/// All members except those of the mesh itself.
fn small_members(carrier: &Carrier) -> Vec<NamedArray> {
    let normals = &carrier.mesh().vertex_normal;
    let normals = Some(normals).filter(|normals| !normals.is_empty());
    let mut members: Vec<_> = normals
        .map(|normals| ("vertex_normal".into(), Array::rows(normals)))
        .into_iter()
        .collect();
    let attributes = attribute_members(VERTEX_ATTRIBUTES, carrier.attributes());
    members.extend(attributes.into_iter().map(borrowed));
    members.extend(label_members(carrier));
    members
}

/// The bytes of a file with the faces, their labels and the edges between them: a carrier file without its mesh.
///
/// # Errors
/// If the archive would pass the limits of zip.
pub fn labels_to_npz(
    carrier: &Carrier,
    compression: Compression,
) -> Result<Vec<u8>, NpzWriteError> {
    arrays_to_npz(&label_members(carrier), compression)
}

/// The faces with all their labels, the edges between them, and the settings.
fn label_members(carrier: &Carrier) -> Vec<NamedArray> {
    let meta = ("meta", Array::vector(meta_json(carrier.meta())));
    let faces = part_members(carrier)
        .into_iter()
        .chain(face_members(carrier))
        .map(borrowed);
    let edges = edge_members(&carrier.graph().edges).into_iter();
    faces
        .chain(layer_members(carrier))
        .chain(edges.chain([meta]).map(borrowed))
        .collect()
}

/// The layers that only some carriers with a B-Rep have, in the order of their names.
fn layer_members(carrier: &Carrier) -> impl Iterator<Item = NamedArray> {
    let layers = carrier.layers().iter();
    layers
        .filter(|(name, _)| ![STEP_PARTS, STEP_PARTS_RAW].contains(&name.as_str()))
        .map(|(name, layer)| {
            let member = format!("{LAYER_PREFIX}{name}");
            (member.into(), Array::vector(layer.of_face().to_vec()))
        })
}

fn borrowed((name, array): (&'static str, Array)) -> NamedArray {
    (name.into(), array)
}

fn meta_json(meta: &CarrierMeta) -> Vec<u8> {
    // The value has only text keys and plain fields, which always serialize.
    serde_json::to_vec(&MetaJson::from(meta)).unwrap_or_default()
}

/// A member and the function that makes it from a carrier.
type MeshMember = (&'static str, fn(&Carrier) -> Array);

const MESH_MEMBERS: [MeshMember; 6] = [
    ("vertices", |carrier| Array::rows(&carrier.mesh().vertices)),
    ("vertex_face", |carrier| {
        Array::vector(carrier.mesh().vertex_face.clone())
    }),
    ("triangles", |carrier| {
        Array::rows(&carrier.mesh().triangles)
    }),
    ("tri_face", |carrier| {
        Array::vector(carrier.mesh().tri_face.clone())
    }),
    ("tri_part", |carrier| {
        column(&carrier.mesh().tri_face, |&face| {
            carrier.part_of_face()[face as usize]
        })
    }),
    ("tri_type", |carrier| {
        let faces = &carrier.graph().faces;
        column(&carrier.mesh().tri_face, |&face| {
            faces[face as usize].face_type.code()
        })
    }),
];

/// The members that hold parameters, curvatures and directions, by these names. Empty lists are left out.
pub(crate) fn attribute_members(
    names: [&'static str; 3],
    attributes: &SurfaceAttributes,
) -> Vec<(&'static str, Array)> {
    let SurfaceAttributes {
        uv,
        curvature,
        direction,
    } = attributes;
    let arrays = [
        Array::rows(uv),
        Array::rows(curvature),
        Array::blocks(direction),
    ];
    names
        .into_iter()
        .zip(arrays)
        .filter(|(_, array)| array.shape()[0] > 0)
        .collect()
}

/// The two layers that every carrier with a B-Rep has.
fn part_members(carrier: &Carrier) -> Vec<(&'static str, Array)> {
    let members = [("face_part", STEP_PARTS_RAW), ("face_label", STEP_PARTS)];
    let labels = |layer: &LabelLayer| Array::vector(layer.of_face().to_vec());
    members
        .into_iter()
        .filter_map(|(member, name)| Some((member, labels(carrier.layer(name)?))))
        .collect()
}

fn face_members(carrier: &Carrier) -> Vec<(&'static str, Array)> {
    let faces = &carrier.graph().faces;
    vec![
        ("face_type", column(faces, |face| face.face_type.code())),
        (
            "face_canonical_type",
            column(faces, |face| face.canonical_type.code()),
        ),
        ("face_step_id", column(faces, |face| face.step_id)),
        ("face_area", column(faces, |face| face.area)),
        ("face_shell", column(faces, |face| face.shell as i32)),
        (
            "face_solid",
            column(faces, |face| {
                face.solid.map_or(NO_SOLID, |solid| solid as i32)
            }),
        ),
        ("face_instance", column(faces, |face| face.instance as i32)),
        (
            "face_color",
            column(faces, |face| face.color.map_or(NO_COLOR, |color| color.0)),
        ),
        ("face_name", column(faces, |face| shown(face.name.as_ref()))),
        (
            "face_layer",
            column(faces, |face| shown(face.layer.as_ref())),
        ),
    ]
}

/// A name as it is stored for NumPy.
fn shown(name: Option<&String>) -> String {
    name.into_iter()
        .flat_map(|name| name.chars())
        .take(MAX_NAME_CHARS)
        .collect()
}

fn edge_members(edges: &[Edge]) -> Vec<(&'static str, Array)> {
    let faces: Vec<[u32; 2]> = edges.iter().map(|edge| edge.faces).collect();
    vec![
        ("edge_faces", Array::rows(&faces)),
        ("edge_phi", column(edges, |edge| edge.phi)),
        ("edge_length", column(edges, |edge| edge.length)),
    ]
}

fn column<R, T: Element>(rows: &[R], value: impl Fn(&R) -> T) -> Array {
    Array::vector(rows.iter().map(value).collect())
}

/// The carrier in the bytes of its file.
///
/// # Errors
/// If the archive is damaged, hostile or changed, or its members do not belong to one shape.
pub fn carrier_from_npz(bytes: &[u8]) -> Result<Carrier, CarrierFileError> {
    hashed_carrier_from_npz(bytes).map(|(carrier, _)| carrier)
}

/// The same, with the hash of the file's members. For files of earlier programs, which do not contain it, the hash is computed.
///
/// # Errors
/// The same as for [`carrier_from_npz`].
pub fn hashed_carrier_from_npz(bytes: &[u8]) -> Result<(Carrier, ContentHash), CarrierFileError> {
    let (mut members, content_hash) = hashed_arrays_from_npz(bytes)?;
    let meta: MetaJson = serde_json::from_slice(&members.vector::<u8>("meta")?)
        .map_err(|error| CarrierFileError::Meta(error.to_string()))?;
    let vertex_normal = if members.array("vertex_normal").is_some() {
        members.rows("vertex_normal")?
    } else {
        Vec::new()
    };
    let attributes = attributes_from(&mut members)?;
    let mesh = Mesh {
        vertices: members.rows("vertices")?,
        vertex_face: members.vector("vertex_face")?,
        triangles: members.rows("triangles")?,
        tri_face: members.vector("tri_face")?,
        vertex_normal,
    };
    let graph = FaceGraph {
        faces: faces_from(&mut members)?,
        edges: edges_from(&mut members)?,
    };
    let layers = layers_from(&mut members, graph.faces.len())?;
    let carrier = Carrier::new(mesh, graph, layers, meta.into())?;
    Ok((carrier.with_attributes(attributes)?, content_hash))
}

/// The two layers of a carrier with a B-Rep, and those whose members are named after a source.
fn layers_from(
    members: &mut Members,
    n_faces: usize,
) -> Result<Vec<(String, LabelLayer)>, CarrierFileError> {
    let sources = members
        .names()
        .filter_map(|member| member.strip_prefix(LAYER_PREFIX));
    let mut names: Vec<(String, String)> = sources
        .map(|source| (source.to_owned(), format!("{LAYER_PREFIX}{source}")))
        .collect();
    // Later names replace earlier ones, so a member such as `face_label_step-parts` cannot replace `face_label`.
    let of_parts = [(STEP_PARTS_RAW, "face_part"), (STEP_PARTS, "face_label")];
    // A shape without a B-Rep has the layer `given` and neither of these.
    let is_given = names.iter().any(|(source, _)| source == GIVEN);
    for (source, member) in of_parts {
        if !is_given || members.array(member).is_some() {
            names.push((source.to_owned(), member.to_owned()));
        }
    }

    let mut layers = Vec::with_capacity(names.len());
    for (source, member) in names {
        let labels: Vec<i32> = rows_of(members, &member, n_faces)?;
        layers.push((source, labels.into()));
    }
    Ok(layers)
}

fn attributes_from(members: &mut Members) -> Result<SurfaceAttributes, CarrierFileError> {
    let mut attributes = SurfaceAttributes::default();
    if members.array("vertex_uv").is_some() {
        attributes.uv = members.rows("vertex_uv")?;
    }
    if members.array("vertex_curvature").is_some() {
        attributes.curvature = members.rows("vertex_curvature")?;
    }
    if members.array("vertex_direction").is_some() {
        attributes.direction = members.blocks("vertex_direction")?;
    }
    Ok(attributes)
}

fn faces_from(members: &mut Members) -> Result<Vec<Face>, CarrierFileError> {
    let step_id: Vec<u64> = members.vector("face_step_id")?;
    let n_faces = step_id.len();
    let area: Vec<f64> = rows_of(members, "face_area", n_faces)?;
    let shell: Vec<i32> = rows_of(members, "face_shell", n_faces)?;
    let solid: Vec<i32> = rows_of(members, "face_solid", n_faces)?;
    let instance: Vec<i32> = rows_of(members, "face_instance", n_faces)?;
    let color: Vec<u32> = rows_of(members, "face_color", n_faces)?;
    let name: Vec<String> = rows_of(members, "face_name", n_faces)?;
    // Files of earlier programs have no layers.
    let has_layers = members.array("face_layer").is_some();
    let layer = if has_layers {
        rows_of(members, "face_layer", n_faces)?
    } else {
        vec![String::new(); n_faces]
    };
    let face_type = types_from(members, "face_type", n_faces)?;
    let canonical_type = types_from(members, "face_canonical_type", n_faces)?;
    let face = |idx: usize| Face {
        step_id: step_id[idx],
        face_type: face_type[idx],
        canonical_type: canonical_type[idx],
        area: area[idx],
        shell: shell[idx] as u32,
        solid: u32::try_from(solid[idx]).ok(),
        instance: instance[idx] as u32,
        name: Some(name[idx].clone()).filter(|name| !name.is_empty()),
        color: Some(Color(color[idx])).filter(|color| color.0 != NO_COLOR),
        layer: Some(layer[idx].clone()).filter(|layer| !layer.is_empty()),
    };
    Ok((0..n_faces).map(face).collect())
}

fn types_from(
    members: &mut Members,
    member: &'static str,
    n_faces: usize,
) -> Result<Vec<FaceType>, CarrierFileError> {
    let codes: Vec<u8> = rows_of(members, member, n_faces)?;
    codes
        .into_iter()
        .map(|code| FaceType::from_code(code).ok_or(CarrierFileError::FaceType { member, code }))
        .collect()
}

fn edges_from(members: &mut Members) -> Result<Vec<Edge>, CarrierFileError> {
    let faces: Vec<[u32; 2]> = members.rows("edge_faces")?;
    let phi: Vec<f64> = rows_of(members, "edge_phi", faces.len())?;
    let length: Vec<f64> = rows_of(members, "edge_length", faces.len())?;
    Ok(faces
        .into_iter()
        .zip(phi)
        .zip(length)
        .map(|((faces, phi), length)| Edge { faces, phi, length })
        .collect())
}

fn rows_of<T: Element>(
    members: &mut Members,
    member: &str,
    expected: usize,
) -> Result<Vec<T>, CarrierFileError> {
    let values = members.vector(member)?;
    let found = values.len();
    if found == expected {
        Ok(values)
    } else {
        Err(CarrierFileError::Rows {
            member: member.to_owned(),
            found,
            expected,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numpy::npz::arrays_from_npz;
    use partprobe_carrier::{GivenShape, Instance, ShapeKind, Units, carrier_of_given};
    use proptest::prelude::*;

    fn meta() -> CarrierMeta {
        let units = Units {
            length: "inch".to_owned(),
            mm_per_unit: 25.4,
            angle: "degree".to_owned(),
            rad_per_unit: 0.017,
        };
        CarrierMeta {
            id: "parts__bracket".to_owned(),
            source_sha256: "00ff".to_owned(),
            theta_deg: 8.0,
            tau_min: 0,
            chord_mm: 0.1,
            angle_rad: 0.3,
            diagonal_mm: 1.5,
            units,
            lost: vec!["face #7: no loops".to_owned()],
            notes: vec!["#8: 2 faces are triangles of the file".to_owned()],
            instances: vec![Instance {
                path: "assembly/bracket".to_owned(),
                product: Some("bracket".to_owned()),
                transform: [
                    [1.0, 0.0, 0.0, 0.5],
                    [0.0, 1.0, 0.0, 0.0],
                    [0.0, 0.0, 1.0, 0.0],
                    [0.0, 0.0, 0.0, 1.0],
                ],
            }],
        }
    }

    /// A strip of triangles, one per face, with an edge between neighbors.
    fn strip(n_faces: u32, phi: f64, name: &str, vertex_normals: bool) -> Carrier {
        let face = |idx: u32| Face {
            step_id: u64::MAX - u64::from(idx),
            face_type: FaceType::ALL[idx as usize % 11],
            canonical_type: FaceType::Plane,
            area: f64::from(idx) + 0.1,
            shell: idx / 2,
            solid: (!idx.is_multiple_of(3)).then_some(idx),
            instance: 0,
            name: Some(name.to_owned()).filter(|name| !name.is_empty()),
            color: idx.is_multiple_of(2).then_some(Color(0xff00_00ff)),
            layer: idx.is_multiple_of(3).then(|| "layer 1".to_owned()),
        };
        let corners = 3 * n_faces;
        let mesh = Mesh {
            vertices: (0..corners)
                .map(|x| [f64::from(x), f64::from(x % 2), 0.1])
                .collect(),
            vertex_face: (0..corners).map(|vertex| vertex / 3).collect(),
            triangles: (0..n_faces)
                .map(|face| [3 * face, 3 * face + 1, 3 * face + 2])
                .collect(),
            tri_face: (0..n_faces).collect(),
            vertex_normal: if vertex_normals {
                vec![[0.0, 0.0, 1.0]; corners as usize]
            } else {
                Vec::new()
            },
        };
        let edges = (1..n_faces)
            .map(|face| Edge {
                faces: [face - 1, face],
                phi,
                length: 2.5,
            })
            .collect();
        let n_attributes = if vertex_normals { corners as usize } else { 0 };
        let attributes = SurfaceAttributes {
            uv: vec![[0.5, -2.0]; n_attributes],
            curvature: vec![[0.25, 0.0]; n_attributes],
            direction: vec![[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]; n_attributes],
        };
        let graph = FaceGraph {
            faces: (0..n_faces).map(face).collect(),
            edges,
        };
        let layer = |label: fn(i32) -> i32| LabelLayer::from_iter((0..n_faces as i32).map(label));
        let mut layers = vec![
            (STEP_PARTS_RAW, layer(|face| face)),
            (STEP_PARTS, layer(|face| face / 2)),
        ];
        if vertex_normals {
            layers.push(("solid", layer(|face| face % 2 - 1)));
            layers.push(("part_of: \"x\"", layer(|_| 0)));
        }
        let carrier = Carrier::new(mesh, graph, layers, meta());
        carrier.unwrap().with_attributes(attributes).unwrap()
    }

    #[test]
    fn meshes_and_clouds_round_trip() {
        let square = GivenShape {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            labels: vec![4, -1],
            ..GivenShape::default()
        };
        let points = GivenShape {
            triangles: Vec::new(),
            labels: vec![4, -1, 0, 0],
            ..square.clone()
        };
        for (shape, kind) in [(square, ShapeKind::Mesh), (points, ShapeKind::Cloud)] {
            let carrier = carrier_of_given(shape, "a", "00").unwrap();
            let bytes = carrier_to_npz(&carrier, Compression::Stored).unwrap();
            assert_eq!(arrays_from_npz(&bytes).unwrap().array("face_label"), None);
            let found = carrier_from_npz(&bytes).unwrap();
            assert_eq!((found.kind(), found), (kind, carrier));
        }
    }

    proptest! {
        #[test]
        fn carriers_round_trip(n_faces in 0u32..30, phi in 0.0f64..180.0, name in "\\PC{0,9}", vertex_normals: bool, deflated: bool) {
            let compression = if deflated { Compression::Deflated } else { Compression::Stored };
            let carrier = strip(n_faces, phi, &name, vertex_normals && n_faces > 0);
            let bytes = carrier_to_npz(&carrier, compression).unwrap();
            prop_assert_eq!(&bytes, &carrier_to_npz(&carrier, compression).unwrap());
            prop_assert_eq!(carrier_from_npz(&bytes), Ok(carrier));
        }

        #[test]
        fn a_flipped_byte_never_panics(at: usize, value: u8) {
            let mut bytes = carrier_to_npz(&strip(3, 90.0, "top", false), Compression::Stored).unwrap();
            let at = at % bytes.len();
            bytes[at] = value;
            let _ = carrier_from_npz(&bytes);
        }
    }

    #[test]
    fn undefined_angles_and_long_names_survive() {
        let carrier = strip(2, f64::NAN, &"x".repeat(300), false);
        let back =
            carrier_from_npz(&carrier_to_npz(&carrier, Compression::Stored).unwrap()).unwrap();
        assert!(back.graph().edges[0].phi.is_nan());
        assert_eq!(
            back.graph().faces[0].name.as_ref().map(String::len),
            Some(MAX_NAME_CHARS)
        );
    }

    #[test]
    fn an_array_without_the_file_is_the_member_of_the_file() {
        let carrier = strip(5, 90.0, "top", true);
        let bytes = carrier_to_npz(&carrier, Compression::Stored).unwrap();
        let members = arrays_from_npz(&bytes).unwrap();
        let of_the_archive = ["format_version", "content_hash"];
        for name in members
            .names()
            .filter(|name| !of_the_archive.contains(name))
        {
            assert_eq!(
                carrier_array(&carrier, name).as_ref(),
                members.array(name),
                "{name}"
            );
        }
        assert!(carrier_array(&carrier, "vertices").is_some());
        assert_eq!(carrier_array(&carrier, "nothing"), None);
    }

    #[test]
    fn a_file_knows_its_hash_and_one_that_was_changed_is_refused() {
        let carrier = strip(2, 90.0, "top", false);
        let stored = carrier_file(&carrier, Compression::Stored).unwrap();
        let deflated = carrier_file(&carrier, Compression::Deflated).unwrap();
        assert_eq!(stored.content_hash, deflated.content_hash);
        assert_eq!(
            hashed_carrier_from_npz(&deflated.bytes),
            Ok((carrier.clone(), stored.content_hash))
        );

        let members = arrays_from_npz(&stored.bytes).unwrap();
        let changed = |name: &str, array: Option<Array>| {
            let kept = members
                .names()
                .filter(|&member| member != name && member != "format_version");
            let mut arrays: Vec<(&str, Array)> = kept
                .map(|name| (name, members.array(name).unwrap().clone()))
                .collect();
            arrays.extend(array.map(|array| (name, array)));
            hashed_carrier_from_npz(&arrays_to_npz(&arrays, Compression::Stored).unwrap())
        };
        let relabeled = changed("face_label", Some(Array::vector(vec![1i32, 1])));
        assert!(
            matches!(
                relabeled,
                Err(CarrierFileError::Archive(NpzError::Changed { .. }))
            ),
            "{relabeled:?}"
        );
        // A file of an earlier program contains no hash.
        assert_eq!(
            changed("content_hash", None),
            Ok((carrier, stored.content_hash))
        );
    }

    /// Writes the strip's members with one of them replaced or left out.
    #[track_caller]
    fn check_refusal(name: &'static str, replacement: Option<Array>, expected: CarrierFileError) {
        let carrier = strip(2, 90.0, "top", false);
        let mut members: Vec<_> = MESH_MEMBERS
            .iter()
            .map(|(name, array_of)| borrowed((name, array_of(&carrier))))
            .collect();
        members.extend(small_members(&carrier));
        members.retain(|(member, _)| member != name);
        members.extend(replacement.map(|array| borrowed((name, array))));
        let bytes = arrays_to_npz(&members, Compression::Stored).unwrap();
        assert_eq!(carrier_from_npz(&bytes), Err(expected));
    }

    #[test]
    fn members_that_do_not_fit_are_refused_by_name() {
        let index =
            |list, index, len| CarrierFileError::Carrier(CarrierError::Index { list, index, len });
        let length = |list, found, expected| {
            CarrierFileError::Carrier(CarrierError::Length {
                list,
                found,
                expected,
            })
        };
        let one_row_of_two = |member: &str| CarrierFileError::Rows {
            member: member.to_owned(),
            found: 1,
            expected: 2,
        };
        check_refusal(
            "tri_face",
            None,
            MemberError::Missing("tri_face".to_owned()).into(),
        );
        check_refusal(
            "tri_face",
            Some(Array::vector(vec![0u32, 9])),
            index("tri_face", 9, 2),
        );
        check_refusal(
            "triangles",
            Some(Array::rows(&[[0u32, 1, 2], [3, 4, 6]])),
            index("triangles", 6, 6),
        );
        check_refusal(
            "edge_faces",
            Some(Array::rows(&[[0u32, 2]])),
            index("edge_faces", 2, 2),
        );
        for member in ["face_part", "face_label", "face_label_solid"] {
            let labels = Array::vector(vec![0i32]);
            check_refusal(member, Some(labels), one_row_of_two(member));
        }
        let area = Array::vector(vec![1.0f64]);
        check_refusal("face_area", Some(area), one_row_of_two("face_area"));
        check_refusal(
            "face_type",
            Some(Array::vector(vec![0u8, 11])),
            CarrierFileError::FaceType {
                member: "face_type",
                code: 11,
            },
        );
        check_refusal(
            "vertex_uv",
            Some(Array::rows(&[[0.0f64; 2]; 5])),
            length("vertex_uv", 5, 6),
        );
        let wrong = MemberError::Type {
            name: "vertices".to_owned(),
            found: "float32",
            expected: "float64",
        };
        check_refusal(
            "vertices",
            Some(Array::rows(&[[0.0f32; 3]; 6])),
            wrong.into(),
        );
        assert!(matches!(
            carrier_from_npz(b"PK"),
            Err(CarrierFileError::Archive(_))
        ));
        let empty = serde_json::from_slice::<MetaJson>(b"")
            .map(|_| ())
            .map_err(|error| CarrierFileError::Meta(error.to_string()));
        check_refusal(
            "meta",
            Some(Array::vector(Vec::<u8>::new())),
            empty.unwrap_err(),
        );
    }
}
