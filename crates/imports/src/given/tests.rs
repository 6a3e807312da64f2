//! Tests files of every kind with labels of every kind, and files that are damaged.

use super::*;
use partprobe_formats::{Array, PlyPoints, array_to_npy, points_to_ply};
use proptest::prelude::*;

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng seat\nf 1 2 3\ng leg\nf 1 3 4\n";
const PLAIN_OBJ: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    element face 2\nproperty list uchar int vertex_indices\nproperty int part\nend_header\n\
    0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 7\n3 0 2 3 4\n";
const OFF: &str = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";
const STL: &str =
    "solid a\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 0 0\nvertex 1 1 0\nvertex 0 1 0\n";
/// A row of ShapeNetPart: position, normal, label.
const ROWS: &str = "0 0 0 0 0 1 12\n1 0 0 0 0 1 12\n1 1 0 0 0 1 13\n";

fn file<'a>(name: &'a str, bytes: &'a [u8]) -> NamedBytes<'a> {
    NamedBytes { name, bytes }
}

/// The number of triangles, the number of vertices and the labels, or the refusal.
#[track_caller]
fn check(
    shape: (&str, &[u8]),
    labels: Option<(&str, &[u8])>,
    expected: Result<(usize, usize, &[i32]), &str>,
) {
    let labels = labels.map(|(name, bytes)| file(name, bytes));
    let found = given_shape(file(shape.0, shape.1), labels);
    match (found, expected) {
        (Ok(found), Ok(expected)) => {
            let sizes = (found.triangles.len(), found.vertices.len());
            assert_eq!(
                (sizes.0, sizes.1, found.labels.as_slice()),
                expected,
                "{found:?}"
            );
        }
        (Err(error), Err(expected)) => assert_eq!(error.to_string(), expected),
        (found, expected) => panic!("found {found:?}, expected {expected:?}"),
    }
}

#[test]
fn meshes_come_with_their_labels() {
    check(("a.obj", OBJ.as_bytes()), None, Ok((2, 4, &[1, 2])));
    check(("a.PLY", PLY.as_bytes()), None, Ok((2, 4, &[7, 4])));
    for (name, text) in [("a.obj", PLAIN_OBJ), ("a.off", OFF)] {
        check((name, text.as_bytes()), None, Ok((2, 4, &[])));
    }
    check(("a.stl", STL.as_bytes()), None, Ok((2, 6, &[])));
    let of_file: (&str, &[u8]) = ("a.seg", b"5\n-1\n");
    check(
        ("a.stl", STL.as_bytes()),
        Some(of_file),
        Ok((2, 6, &[5, -1])),
    );
    check(
        ("a.obj", OBJ.as_bytes()),
        Some(of_file),
        Ok((2, 4, &[5, -1])),
    );
}

#[test]
fn clouds_come_with_their_labels() {
    check(("a.txt", ROWS.as_bytes()), None, Ok((0, 3, &[12, 12, 13])));
    let points = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
    let npy = array_to_npy(&Array::rows(&points));
    check(("a.npy", &npy), None, Ok((0, 3, &[])));
    let labels = array_to_npy(&Array::vector(vec![3i64, 3, 1]));
    check(
        ("a.npy", &npy),
        Some(("a_labels.npy", &labels)),
        Ok((0, 3, &[3, 3, 1])),
    );
    let ply = points_to_ply(&PlyPoints {
        points: points.to_vec(),
        normals: vec![[0.0, 0.0, 1.0]; 3],
        parts: vec![2, 2, 9],
    });
    check(("a.ply", &ply), None, Ok((0, 3, &[2, 2, 9])));
    let found = given_shape(file("a.ply", &ply), None).unwrap();
    assert_eq!(found.normals, [[0.0, 0.0, 1.0]; 3]);
}

#[test]
fn what_does_not_fit_is_named_with_its_file() {
    check(
        ("a.obj", b"v 0 0 0\nf 1 x 1\n"),
        None,
        Err("line 2: `f 1 x 1` can't be understood"),
    );
    check(
        ("a.txt", b"0 0 0\n0 0\n"),
        None,
        Err("row 2 has 2 numbers, and the first one has 3"),
    );
    check(
        ("a.xyz", b"1\n2\n"),
        None,
        Err(
            "the file holds no points; a row is `x y z`, then perhaps a normal, then perhaps a label",
        ),
    );
    check(
        ("a.obj", OBJ.as_bytes()),
        Some(("a.seg", b"1\n2\n3\n")),
        Err("a.seg: there are 3 labels, and the shape has 2 triangles"),
    );
    check(
        ("a.ply", b"solid"),
        None,
        Err("not a PLY file; check the extension of the file"),
    );
}

proptest! {
    /// Damage at any byte, a cut at any byte, and arbitrary bytes give a shape or a refusal with a reason, and never a panic.
    #[test]
    fn any_bytes_are_a_shape_or_a_refusal(
        which in 0usize..6,
        at in 0usize..400,
        byte: u8,
        end in 0usize..400,
        noise: Vec<u8>,
    ) {
        let (name, text) = [
            ("a.obj", OBJ), ("a.ply", PLY), ("a.off", OFF), ("a.stl", STL), ("a.txt", ROWS), ("a.npy", ROWS),
        ][which];
        let mut damaged = text.as_bytes().to_vec();
        let at = at % damaged.len();
        damaged[at] = byte;
        let cut = &text.as_bytes()[..end.min(text.len())];
        for bytes in [damaged.as_slice(), cut, noise.as_slice()] {
            if let Ok(shape) = given_shape(file(name, bytes), None) {
                // A shape that was read either gives a carrier or is refused with a reason.
                let _ = partprobe_carrier::carrier_of_given(shape, "a", "00");
            }
            let labels = file("a.seg", bytes);
            let _ = given_shape(file("a.obj", OBJ.as_bytes()), Some(labels));
        }
    }
}
