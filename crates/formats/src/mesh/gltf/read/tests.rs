use super::*;
use crate::fixtures::three_squares;
use crate::mesh::foreign::MeshFileError;
use crate::mesh::foreign::tests::corners;
use crate::mesh::glb::{GlbNodes, carrier_to_glb};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use proptest::prelude::*;
use serde_json::{Value, json};

const CORNERS: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
];

/// A square: positions, then colors of its corners, then three arrangements of corners.
fn buffer() -> Vec<u8> {
    let mut bytes: Vec<u8> = CORNERS
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    bytes.extend([255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 0, 0]);
    bytes.extend([0, 1, 2, 0, 2, 3]);
    bytes.extend([0, 1, 3, 2]);
    bytes.extend([0, 1, 2, 3]);
    bytes
}

/// A document with the square as a list, a strip and a fan, and these nodes.
fn document(nodes: Value) -> Value {
    let accessor = |view: usize, component: u32, count: usize, shape: &str| json!({"bufferView": view, "componentType": component, "count": count, "type": shape});
    let view = |offset: usize, length: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    let primitive = |indices: usize, mode: u32| json!({"attributes": {"POSITION": 0}, "indices": indices, "mode": mode});
    let colored = json!({"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0});
    let uri = format!(
        "data:application/octet-stream;base64,{}",
        STANDARD.encode(buffer())
    );
    json!({
        "asset": {"version": "2.0"},
        "nodes": nodes,
        "meshes": [
            {"primitives": [colored]},
            {"primitives": [primitive(3, 5), primitive(4, 6)]},
            {"primitives": [primitive(2, 1)]},
        ],
        "accessors": [
            accessor(0, 5126, 4, "VEC3"),
            accessor(1, 5121, 4, "VEC3"),
            accessor(2, 5121, 6, "SCALAR"),
            accessor(3, 5121, 4, "SCALAR"),
            accessor(4, 5121, 4, "SCALAR"),
        ],
        "bufferViews": [view(0, 48), view(48, 12), view(60, 6), view(66, 4), view(70, 4)],
        "buffers": [{"uri": uri, "byteLength": 74}],
    })
}

fn read(document: &Value) -> Result<MarkedMesh, GltfError> {
    let missing = |name: &str| Err(format!("{name} is missing"));
    marked_mesh_from_gltf(document.to_string().as_bytes(), &missing)
}

fn groups(mesh: &MarkedMesh, name: &str) -> Vec<u32> {
    let mark = mesh.marks.iter().find(|mark| mark.name == name).unwrap();
    match &mark.values {
        MarkValues::Groups(groups) => groups.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn nodes_primitives_materials_and_colors_are_marks() {
    let nodes = json!([
        {"children": [2, 1]},
        {"mesh": 0, "translation": [0, 0, 5]},
        {"mesh": 1, "scale": [1, 1, -1]},
        {"mesh": 2},
    ]);
    let found = read(&document(nodes)).unwrap();
    assert_eq!(groups(&found, "node"), [0, 0, 0, 0, 1, 1]);
    assert_eq!(groups(&found, "primitive"), [0, 0, 1, 1, 2, 2]);
    assert_eq!(groups(&found, "material"), [0, 0, 0, 0, 1, 1]);
    let color = found.marks.last().unwrap();
    let [red, green, blue] = [[65535, 0, 0], [0, 65535, 0], [0, 0, 65535]];
    let of_vertex = [vec![[0; 3]; 8], vec![red, green, blue, red]].concat();
    assert_eq!(color.values, MarkValues::Colors(of_vertex));
    assert_eq!(color.of, Marked::Vertices);

    let [a, b, c, d] = CORNERS.map(|corner| corner.map(f64::from));
    let raised = [a, b, c, d].map(|[x, y, _]| [x, y, 5.0]);
    // The mirrored node has its triangles reversed.
    let expected = [
        [a, d, b],
        [b, d, c].map(|corner| corner),
        [b, a, c],
        [c, a, d],
        [raised[0], raised[1], raised[2]],
        [raised[0], raised[2], raised[3]],
    ];
    let found = corners(&found.mesh);
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(&expected) {
        let sorted = |triangle: &[Point; 3]| {
            let mut sorted = triangle.map(|corner| corner.map(|x| x as i32));
            sorted.sort_unstable();
            sorted
        };
        assert_eq!(sorted(found), sorted(expected));
    }
}

#[test]
fn lists_strips_and_fans_have_the_orientation_of_the_specification() {
    let area = |mesh: usize| {
        let found = read(&document(json!([{"mesh": mesh}]))).unwrap();
        let double =
            |[a, b, c]: [Point; 3]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        corners(&found.mesh)
            .into_iter()
            .map(double)
            .collect::<Vec<_>>()
    };
    assert_eq!(area(0), [1.0, 1.0]);
    assert_eq!(area(1), [1.0; 4]);
}

#[test]
fn an_exported_carrier_is_read_with_its_parts() {
    let carrier = three_squares();
    let bytes = carrier_to_glb(&carrier, &[0, -1, 1], &[[255; 3]; 3], GlbNodes::One).unwrap();
    let found = marked_mesh_from_gltf(&bytes, &|_| Err(String::new())).unwrap();
    let names: Vec<&str> = found.marks.iter().map(|mark| mark.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "face",
            "part",
            "type",
            "node",
            "primitive",
            "material",
            "color"
        ]
    );
    let MarkValues::Numbers(parts) = &found.marks[1].values else {
        panic!("{:?}", found.marks[1]);
    };
    assert_eq!((parts[0], parts[8]), (0.0, 1.0));
    assert!(parts[4..8].iter().all(|part| part.is_nan()));
    // The node scales to meters, and y is up.
    let own = carrier.mesh().vertices[7];
    let other = found.mesh.vertices[7];
    let back = [1000.0 * other[0], -1000.0 * other[2], 1000.0 * other[1]];
    assert!(
        own.iter()
            .zip(back)
            .all(|(own, back)| (own - back).abs() < 1e-6)
    );
}

#[track_caller]
fn check_refusal(change: impl Fn(&mut Value), expected: &str) {
    let mut changed = document(json!([{"mesh": 0}]));
    change(&mut changed);
    let reason = read(&changed).unwrap_err().to_string();
    assert!(reason.contains(expected), "{reason}");
}

#[test]
fn what_does_not_fit_is_named() {
    check_refusal(
        |file| file["asset"]["version"] = "1.0".into(),
        "version 1.0",
    );
    check_refusal(
        |file| file["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
        "the extension KHR_draco_mesh_compression is not read",
    );
    check_refusal(
        |file| file["nodes"][0]["mesh"] = 9.into(),
        "mesh 9 does not exist",
    );
    check_refusal(
        |file| file["nodes"][0]["mesh"] = (-1).into(),
        "not a glTF document",
    );
    check_refusal(
        |file| file["nodes"] = json!([{"mesh": 0, "children": [1]}, {"children": [1]}]),
        "node 1 is a child of two nodes, or of itself",
    );
    check_refusal(
        |file| file["nodes"] = json!([{"children": [7]}]),
        "node 7 does not exist",
    );
    check_refusal(
        |file| file["scenes"] = json!([{"nodes": [0, 0]}]),
        "node 0 is a child",
    );
    check_refusal(
        |file| file["accessors"][0]["count"] = u64::MAX.into(),
        "accessor 0 cannot be read: it is longer than its buffer",
    );
    check_refusal(
        |file| file["bufferViews"][0]["byteStride"] = 4.into(),
        "its rows overlap",
    );
    check_refusal(
        |file| file["bufferViews"][0]["byteOffset"] = u64::MAX.into(),
        "outside of its buffer",
    );
    check_refusal(
        |file| file["accessors"][0]["sparse"] = json!({}),
        "it is sparse",
    );
    check_refusal(
        |file| file["accessors"][1]["count"] = 3.into(),
        "there is not one color per vertex",
    );
    check_refusal(
        |file| file["accessors"][0]["count"] = 2.into(),
        "an index is larger than the number of vertices",
    );
    check_refusal(
        |file| file["buffers"][0]["uri"] = "part.bin".into(),
        "buffer 0 cannot be read: part.bin is missing",
    );
    check_refusal(
        |file| file["buffers"][0]["uri"] = "../part.bin".into(),
        "is not in the folder of the file",
    );
    check_refusal(|file| file["buffers"] = json!([{}]), "no binary chunk");
    check_refusal(
        |file| file["meshes"][0]["primitives"][0]["mode"] = 7.into(),
        "a mode is not in the specification",
    );
    let lines = document(json!([{"mesh": 2}]));
    assert_eq!(read(&lines), Err(GltfError::Mesh(MeshFileError::NoFace)));
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(body: Vec<u8>) {
        let none = |_: &str| Err(String::new());
        let _ = marked_mesh_from_gltf(&body, &none);
        let header = [&b"glTF\x02\0\0\0\0\0\0\0"[..], &body].concat();
        let _ = marked_mesh_from_gltf(&header, &none);
    }

    #[test]
    fn no_number_in_the_document_makes_the_reader_panic(
        at in 0usize..200,
        number in prop_oneof![0u64..20, Just(u64::MAX), Just(1 << 40), any::<u64>()],
    ) {
        let text = document(json!([{"children": [1]}, {"mesh": 0}])).to_string();
        // The numbers of the document, one after the other.
        let digits: Vec<&str> = text.split(|character: char| !character.is_ascii_digit()).collect();
        let starts = digits.iter().filter(|digits| !digits.is_empty() && digits.len() < 5);
        let starts: Vec<usize> = starts.map(|digits| digits.as_ptr() as usize - text.as_ptr() as usize).collect();
        let start = starts[at % starts.len()];
        let rest = text[start..].trim_start_matches(|character: char| character.is_ascii_digit());
        let changed = format!("{}{number}{rest}", &text[..start]);
        let _ = marked_mesh_from_gltf(changed.as_bytes(), &|_| Err(String::new()));
    }

    #[test]
    fn a_damaged_binary_file_is_an_answer_too(at in 0usize..4000, byte: u8, end in 0usize..4000) {
        let carrier = three_squares();
        let mut bytes = carrier_to_glb(&carrier, carrier.part_of_face(), &[[9; 3]; 3], GlbNodes::Parts).unwrap();
        let n_bytes = bytes.len();
        bytes[at % n_bytes] = byte;
        let none = |_: &str| Err(String::new());
        let _ = marked_mesh_from_gltf(&bytes, &none);
        let _ = marked_mesh_from_gltf(&bytes[..end % n_bytes], &none);
    }
}
