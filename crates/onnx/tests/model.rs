//! Labels by a model that is written in Rust: the plane that a point or triangle lies on.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot build its fixture has failed"
)]

mod solid;

use partprobe_imports::{Import, JoinedLabels};
use partprobe_onnx::{
    Element, InputTensor, InputValues, Model, OutputTensor, TensorSpec, labels_by_model,
};
use solid::{box_carrier, context, face_labels};

/// A model from rows (x, y, z, nx, ny, nz) to rows (nx, ny, nz, n·p), with any declared tensors.
#[derive(Clone)]
struct Planes {
    inputs: Vec<TensorSpec>,
    outputs: Vec<TensorSpec>,
    /// What it adds to each number; a NaN makes all features NaN.
    added: f32,
}

fn tensor(name: &str, element: Element, shape: &[usize]) -> TensorSpec {
    TensorSpec {
        name: name.to_owned(),
        element,
        // 0 stands for any size.
        shape: shape
            .iter()
            .map(|&size| (size > 0).then_some(size))
            .collect(),
    }
}

fn planes() -> Planes {
    Planes {
        inputs: vec![tensor("points", Element::F32, &[1, 0, 6])],
        outputs: vec![tensor("features", Element::F32, &[1, 0, 4])],
        added: 0.0,
    }
}

impl Model for Planes {
    fn runtime(&self) -> &str {
        "Rust"
    }

    fn inputs(&self) -> &[TensorSpec] {
        &self.inputs
    }

    fn outputs(&self) -> &[TensorSpec] {
        &self.outputs
    }

    fn run(&self, inputs: Vec<InputTensor>, _output: &str) -> Result<OutputTensor, String> {
        let InputValues::F32(values) = &inputs[0].values else {
            return Err("the points are whole numbers".to_owned());
        };
        let plane = |row: &[f32]| {
            let offset: f32 = (0..3).map(|axis| row[axis] * row[axis + 3]).sum();
            [row[3], row[4], row[5], offset].map(|x| x + self.added)
        };
        let rows: Vec<f32> = values.chunks_exact(6).flat_map(plane).collect();
        Ok(OutputTensor {
            shape: vec![1, rows.len() / 4, 4],
            values: rows,
        })
    }
}

/// Keys of a config with their values.
type Keys<'a> = &'a [(&'a str, &'a str)];

const NAMES: [(&str, &str); 3] = [
    ("path", "planes.onnx"),
    ("positions", "points"),
    ("normals", "points"),
];

fn opened(model: Planes, keys: &[(&str, &str)]) -> Result<Box<dyn Import>, String> {
    let keys = [&NAMES[..], keys].concat();
    labels_by_model(Box::new(model), "hash", &context(&keys)).map_err(|error| error.to_string())
}

fn joined(model: Planes, keys: &[(&str, &str)]) -> Result<JoinedLabels, String> {
    let import = opened(model, keys)?;
    import
        .join(&box_carrier())
        .map_err(|problem| problem.to_string())
}

#[test]
fn every_way_to_cluster_finds_the_sides_of_a_box() {
    for per in [
        &[("per", "point"), ("points", "2000")][..],
        &[("per", "triangle")],
        &[("per", "triangle"), ("triangles", "plain")],
    ] {
        for cluster in ["ward", "ward-faces", "k-means"] {
            for k in ["match", "6", "silhouette"] {
                let keys = [per, &[("cluster", cluster), ("k", k)]].concat();
                let joined = joined(planes(), &keys).unwrap();
                // With one row for each face, more than five clusters are all single rows.
                let is_single_rows = cluster == "ward-faces" && k == "silhouette";
                if !is_single_rows {
                    assert_eq!(face_labels(&joined), [0, 1, 2, 3, 4, 5], "{keys:?}");
                }
                let origin = joined.labels.origin().unwrap();
                assert_eq!(origin.content_hash.len(), 64);
                let start = format!("by {cluster}, k ");
                assert!(origin.join.starts_with(&start), "{}", origin.join);
                assert_eq!(joined.labels.of_faces().is_some(), cluster == "ward-faces");
            }
        }
    }
}

#[test]
fn labels_are_the_same_on_every_thread() {
    let keys = [("cluster", "k-means"), ("k", "9"), ("points", "500")];
    let import = opened(planes(), &keys).unwrap();
    let carrier = box_carrier();
    let labels = || {
        let joined = import.join(&carrier).unwrap();
        joined.labels.of_triangles().of_triangle().to_vec()
    };
    let expected = labels();
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(labels)).collect();
        for thread in threads {
            assert_eq!(thread.join().unwrap(), expected);
        }
    });
}

#[test]
fn a_model_that_does_not_fit_is_refused_with_what_to_do() {
    let inputs = |inputs: &[TensorSpec]| Planes {
        inputs: inputs.to_vec(),
        ..planes()
    };
    let points = |element, shape: &[usize]| inputs(&[tensor("points", element, shape)]);
    let double = Element::Other("float64".to_owned());
    let offset = tensor("offset", Element::I64, &[1]);
    let with_offset = [planes().inputs, vec![offset.clone()]].concat();
    let two_outputs = Planes {
        outputs: vec![
            tensor("features", Element::F32, &[0, 4]),
            tensor("class", Element::I64, &[1]),
        ],
        ..planes()
    };
    let nan = Planes {
        added: f32::NAN,
        ..planes()
    };
    let cases: [(Planes, Keys, &str); 13] = [
        (
            planes(),
            &[("positions", "xyz")],
            "planes.onnx has no input `xyz`, which `positions` names; its inputs are `points` float32 [1, ?, 6]",
        ),
        (
            planes(),
            &[("features", "logits")],
            "planes.onnx has no output `logits`, which `features` names; its outputs are `features` float32 [1, ?, 4]",
        ),
        (
            inputs(&with_offset),
            &[],
            "planes.onnx has the input `offset` int64 [1], and no key says what goes into it; set `positions`",
        ),
        (
            inputs(&[
                tensor("points", Element::F32, &[0, 6]),
                tensor("offset", Element::F32, &[1]),
            ]),
            &[("count", "offset")],
            "planes.onnx: `offset` float32 [1] must have the type int64",
        ),
        (
            inputs(&[
                tensor("points", Element::F32, &[0, 6]),
                tensor("offset", Element::I64, &[2]),
            ]),
            &[("count", "offset")],
            "planes.onnx: input `offset` int64 [2] does not have the dimensions of the number of rows, which are [] or [1]",
        ),
        (
            points(double, &[1, 0, 6]),
            &[],
            "planes.onnx: `points` float64 [1, ?, 6] must have the type float32; export the model with this type",
        ),
        (
            points(Element::F32, &[1, 0, 3]),
            &[],
            "planes.onnx: input `points` float32 [1, ?, 3] does not have the dimensions of positions and normals, which are \
             [?, 6] or [1, ?, 6] or [6, ?] or [1, 6, ?]; name this input",
        ),
        (
            points(Element::F32, &[1, 0, 0]),
            &[],
            "planes.onnx: input `points` float32 [1, ?, ?] may have its points in either dimension; set `layout` to `rows`",
        ),
        (
            points(Element::F32, &[1, 100, 6]),
            &[("points", "50")],
            "planes.onnx: `points` float32 [1, 100, 6] is made for 100 points, and there are 50; leave `points` unset",
        ),
        (
            two_outputs,
            &[],
            "planes.onnx has 2 outputs: `features` float32 [?, 4], `class` int64 [1]; set `features`",
        ),
        (
            nan,
            &[],
            "planes.onnx: output `features` has NaN in row 0 of 4096; every feature must be a finite number",
        ),
        (
            planes(),
            &[("points", "4")],
            "planes.onnx: output `features` [1, 4, 4] may have its points in either dimension; set `features_layout`",
        ),
        (
            planes(),
            &[("points", "5"), ("features_layout", "columns")],
            "planes.onnx: output `features` [1, 5, 4] does not have the dimensions of features of 5 points, which are [5, ?]",
        ),
    ];
    for (model, keys, expected) in cases {
        let error = joined(model, keys).err().unwrap_or_default();
        assert!(error.starts_with(expected), "{error}\n{expected}");
    }
}

#[test]
fn a_model_that_is_made_for_a_number_of_points_gets_that_many() {
    let model = Planes {
        inputs: vec![tensor("points", Element::F32, &[1, 300, 6])],
        ..planes()
    };
    let join = joined(model, &[]).unwrap().report.to_string();
    assert!(
        join.contains("4 features of 300 points from Rust"),
        "{join}"
    );
}
