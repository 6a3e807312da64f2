//! Tests real models on the real ONNX Runtime. `.ci/onnx` makes the models and installs ONNX Runtime; two variables say where they are.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot find its models has failed"
)]

mod solid;

use partprobe_imports::JoinedLabels;
use partprobe_onnx::{InputTensor, InputValues, Model, ONNX, OutputTensor, open_model};
use partprobe_sources::{FileError, PathKind, SourceFiles};
use solid::{box_carrier, context, face_labels};
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

/// The folder of the models that `tools/onnx/make_model.py` wrote.
const MODELS: &str = "PARTPROBE_ONNX_MODELS";
/// The library of ONNX Runtime.
const LIBRARY: &str = "ORT_DYLIB_PATH";

fn variable(name: &str) -> String {
    let value = std::env::var(name);
    value.unwrap_or_else(|_| panic!("{name} is not set; run .ci/onnx"))
}

fn model_path(name: &str) -> String {
    let path = PathBuf::from(variable(MODELS)).join(format!("{name}.onnx"));
    path.to_str().unwrap().to_owned()
}

/// Every runtime of this build.
fn runtimes() -> Vec<String> {
    vec![variable(LIBRARY)]
}

/// The file system.
#[derive(Debug)]
struct Disk;

impl SourceFiles for Disk {
    fn kind(&self, _path: &str) -> PathKind {
        PathKind::File
    }

    fn read(&self, path: &str) -> Result<Vec<u8>, FileError> {
        fs::read(path).map_err(|error| FileError {
            path: path.to_owned(),
            reason: error.to_string(),
        })
    }

    fn list(&self, _folder: &str) -> Result<Vec<String>, FileError> {
        Ok(Vec::new())
    }
}

fn joined(name: &str, runtime: &str, keys: &[(&str, &str)]) -> Result<JoinedLabels, String> {
    let path = model_path(name);
    let keys = [&[("path", &path[..]), ("runtime", runtime)], keys].concat();
    let import = ONNX.open(&context(&keys).with_files(Arc::new(Disk)));
    let import = import.map_err(|error| error.to_string())?;
    import
        .join(&box_carrier())
        .map_err(|problem| problem.to_string())
}

/// The keys of a model whose only input gets positions and normals.
const POINTS: [(&str, &str); 2] = [("positions", "points"), ("normals", "points")];

/// The keys of a model with an input for each.
const SEPARATE: [(&str, &str); 4] = [
    ("positions", "xyz"),
    ("normals", "normal"),
    ("count", "offset"),
    ("features", "embedding"),
];

#[test]
fn sound_models_find_the_sides_of_a_box() {
    for runtime in runtimes() {
        for (name, keys) in [
            ("batch-rows", &POINTS[..]),
            ("batch-channels", &POINTS),
            ("two-inputs", &SEPARATE),
            ("fixed-count", &POINTS),
        ] {
            for cluster in ["ward", "ward-faces", "k-means"] {
                let keys = [keys, &[("cluster", cluster), ("k", "match")]].concat();
                let joined = joined(name, &runtime, &keys).unwrap();
                let labels = face_labels(&joined);
                assert_eq!(labels, [0, 1, 2, 3, 4, 5], "{name} {runtime} {cluster}");
            }
        }
    }
}

#[test]
fn faulty_models_are_refused_with_the_model_the_tensor_and_what_to_do() {
    for runtime in runtimes() {
        for (name, expected) in [
            ("not-a-number", "output `features` has NaN in row 0 of 4096"),
            (
                "one-feature-vector",
                "output `features` [1, 6] does not have the dimensions of features of 4096 points, which are [4096, ?]",
            ),
            ("unknown-operator", "Embed"),
            (
                "double-input",
                "`points` float64 [1, ?, 6] must have the type float32",
            ),
            ("damaged", "check that the file is a whole ONNX model"),
            ("missing", "No such file"),
        ] {
            let error = joined(name, &runtime, &POINTS).err().unwrap_or_default();
            assert!(
                error.contains(expected) && error.starts_with(&model_path(name)),
                "{name} {runtime}: {error}"
            );
            assert!(!error.contains('\n'), "{error}");
        }
    }
}

#[test]
fn a_library_that_is_not_onnx_runtime_is_named() {
    let error = joined("batch-rows", "/nowhere/libonnxruntime.so", &POINTS);
    let error = error.err().unwrap_or_default();
    let is_named = error.starts_with("`runtime` /nowhere/libonnxruntime.so cannot be used: ");
    // If another test has loaded the library by now, it cannot be replaced.
    let is_second = error.starts_with(
        "`runtime` is /nowhere/libonnxruntime.so, but this program has already loaded ",
    );
    assert!(is_named || is_second, "{error}");
}

/// Features of points on a curve.
fn features(model: &dyn Model) -> OutputTensor {
    let row = |number: u32| {
        let angle = f64::from(number) * 0.01;
        [
            angle.cos(),
            angle.sin(),
            0.1 * angle,
            angle.sin(),
            angle.cos(),
            0.0,
        ]
        .map(|x| x as f32)
    };
    let input = InputTensor {
        name: "points".to_owned(),
        shape: vec![1, 700, 6],
        values: InputValues::F32((0..700).flat_map(row).collect()),
    };
    model.run(vec![input], "features").unwrap()
}

fn opened(runtime: &str) -> Box<dyn Model> {
    let path = model_path("batch-rows");
    let bytes = fs::read(&path).unwrap();
    open_model(&path, bytes, Some(runtime)).unwrap()
}

#[test]
fn runtimes_agree_on_the_features() {
    let all: Vec<OutputTensor> = runtimes()
        .iter()
        .map(|runtime| features(opened(runtime).as_ref()))
        .collect();
    let largest = all[0]
        .values
        .iter()
        .fold(0.0f32, |most, x| most.max(x.abs()));
    assert!(largest > 0.5 && all[0].shape == [1, 700, 16]);
    for other in &all[1..] {
        assert_eq!(other.shape, all[0].shape);
        let pairs = other.values.iter().zip(&all[0].values);
        let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(apart <= 1e-5, "{apart}");
    }
}

#[test]
fn every_thread_gets_the_same_bytes() {
    for runtime in runtimes() {
        let model = opened(&runtime);
        let bits = || -> Vec<u32> {
            let output = features(model.as_ref());
            output.values.iter().map(|value| value.to_bits()).collect()
        };
        let expected = bits();
        std::thread::scope(|scope| {
            let threads: Vec<_> = (0..8).map(|_| scope.spawn(bits)).collect();
            for thread in threads {
                assert!(thread.join().unwrap() == expected, "{runtime}");
            }
        });
    }
}
