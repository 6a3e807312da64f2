//! Writes a shape for Pointcept's `DefaultDataset`: a folder of NPY files with one row per point.

use crate::numpy::array::Array;
use crate::numpy::npy::array_to_npy;
use partprobe_carrier::{FaceType, PointSample};

/// The files of one shape, by name.
pub const POINTCEPT_FILES: [&str; 4] = ["coord.npy", "normal.npy", "segment.npy", "instance.npy"];

/// The bytes of each of [`POINTCEPT_FILES`]: float32 (N, 3) twice, int32 (N) twice.
///
/// `segment` is the class of each point, and `instance` is its part. Trainers ignore −1.
#[must_use]
pub fn pointcept_files(
    sample: &PointSample,
    segment: &[i32],
    instance: &[i32],
) -> [(&'static str, Vec<u8>); 4] {
    let [coord, normal] =
        [&sample.points, &sample.normals].map(|rows| array_to_npy(&Array::rows(rows)));
    let [segment, instance] =
        [segment, instance].map(|values| array_to_npy(&Array::vector(values.to_vec())));
    let [a, b, c, d] = POINTCEPT_FILES;
    [(a, coord), (b, normal), (c, segment), (d, instance)]
}

/// The `data` section of a Pointcept config that trains instance segmentation on the folder in which the text is saved.
///
/// Shapes are scaled into the unit ball, because a data set may have parts of 5 mm and of 5 m.
#[must_use]
pub fn pointcept_config() -> String {
    let names: Vec<String> = FaceType::ALL
        .iter()
        .map(|kind| format!("\"{kind}\""))
        .collect();
    CONFIG
        .replace("CLASS_NAMES", &names.join(", "))
        .replace("N_CLASSES", &names.len().to_string())
}

/// The files of whole experiments on the folder, by name: two configs of Pointcept, and a text about running them.
pub const POINTCEPT_EXPERIMENTS: [&str; 3] = ["insseg.py", "semseg.py", "README.md"];

/// The texts of [`POINTCEPT_EXPERIMENTS`]. Each config names the evaluator and the tester that fit its model.
#[must_use]
pub fn pointcept_experiments() -> [(&'static str, String); 3] {
    let texts = [
        include_str!("experiment/insseg.py"),
        include_str!("experiment/semseg.py"),
        include_str!("experiment/README.md"),
    ];
    let [insseg, semseg, readme] =
        texts.map(|text| text.replace("N_CLASSES", &FaceType::ALL.len().to_string()));
    let [a, b, c] = POINTCEPT_EXPERIMENTS;
    [(a, insseg), (b, semseg), (c, readme)]
}

/// `{{ fileDirname }}` is replaced by Pointcept when it reads the file.
const CONFIG: &str = r#"# The data section of a Pointcept config; insseg.py and semseg.py in this folder are experiments with it. Another one says,
#     _base_ = ["../_base_/default_runtime.py", "/path/to/pointcept_data.py"]
# with the path to this file, and then its own model, optimizer and scheduler. Input features: 6 channels (position, normal).
# `segment` is the primitive type of a part, `instance` the part.

class_names = [CLASS_NAMES]
num_classes = N_CLASSES
segment_ignore_index = (-1,)
instance_ignore_index = -1
grid_size = 0.02  # of the unit ball that NormalizeCoord scales a shape into

_instances = dict(
    type="InstanceParser",
    segment_ignore_index=segment_ignore_index,
    instance_ignore_index=instance_ignore_index,
)
_voxels = dict(type="GridSample", grid_size=grid_size, hash_type="fnv", mode="train", return_grid_coord=True)
_origin = dict(
    type="Copy",
    keys_dict={"coord": "origin_coord", "segment": "origin_segment", "instance": "origin_instance"},
)
_train_keys = ("coord", "grid_coord", "segment", "instance", "instance_centroid", "bbox")
_eval_keys = _train_keys + ("origin_coord", "origin_segment", "origin_instance", "name")

_train_transform = [
    dict(type="NormalizeCoord"),
    dict(type="RandomRotate", angle=[-1, 1], axis="z", center=[0, 0, 0], p=0.5),
    dict(type="RandomRotate", angle=[-1, 1], axis="x", center=[0, 0, 0], p=0.5),
    dict(type="RandomRotate", angle=[-1, 1], axis="y", center=[0, 0, 0], p=0.5),
    dict(type="RandomScale", scale=[0.8, 1.2]),
    dict(type="RandomFlip", p=0.5),
    dict(type="RandomJitter", sigma=0.005, clip=0.02),
    _voxels,
    _instances,
    dict(type="ToTensor"),
    dict(type="Collect", keys=_train_keys, feat_keys=("coord", "normal")),
]
_eval_transform = [
    dict(type="NormalizeCoord"),
    _origin,
    _voxels,
    _instances,
    dict(type="ToTensor"),
    dict(
        type="Collect",
        keys=_eval_keys,
        feat_keys=("coord", "normal"),
        offset_keys_dict=dict(offset="coord", origin_offset="origin_coord"),
    ),
]
_dataset = dict(type="DefaultDataset", data_root="{{ fileDirname }}", ignore_index=-1)

data = dict(
    num_classes=num_classes,
    ignore_index=-1,
    names=class_names,
    train=dict(**_dataset, split="train", transform=_train_transform, test_mode=False),
    val=dict(**_dataset, split="val", transform=_eval_transform, test_mode=False),
    test=dict(**_dataset, split="test", transform=_eval_transform, test_mode=False),
)
# What stays is read as settings.
del _instances, _voxels, _origin, _train_keys, _eval_keys, _train_transform, _eval_transform, _dataset
"#;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numpy::array::Values;
    use crate::numpy::npy::array_from_npy;

    #[test]
    fn arrays_have_the_types_that_pointcept_asks_for() {
        let sample = PointSample {
            points: vec![[1.0, 2.0, 3.0]; 5],
            normals: vec![[0.0, 0.0, 1.0]; 5],
            triangles: vec![0; 5],
        };
        let files = pointcept_files(&sample, &[1; 5], &[0, 0, 1, 1, -1]);
        let arrays = files.map(|(_, bytes)| array_from_npy(&bytes).unwrap());
        let shapes: Vec<&[usize]> = arrays.iter().map(Array::shape).collect();
        assert_eq!(shapes, [&[5, 3][..], &[5, 3], &[5], &[5]]);
        assert_eq!(arrays[3].values(), &Values::I32(vec![0, 0, 1, 1, -1]));
        assert_eq!(arrays[0].values().type_name(), "float32");
    }

    #[test]
    fn each_experiment_names_the_tester_of_its_model() {
        let [(_, insseg), (_, semseg), (_, readme)] = pointcept_experiments();
        for (config, names) in [
            (
                insseg,
                ["\"PG-v1m2\"", "\"InsSegEvaluator\"", "\"InsSegTester\""],
            ),
            (
                semseg,
                [
                    "\"DefaultSegmentorV2\"",
                    "\"SemSegEvaluator\"",
                    "\"SemSegTester\"",
                ],
            ),
        ] {
            for name in names {
                assert_eq!(config.matches(name).count(), 1, "{name}");
                assert!(readme.contains(name.trim_matches('"')), "{name}");
            }
            assert!(config.contains("num_classes=11,") && !config.contains("N_CLASSES"));
        }
    }

    #[test]
    fn the_config_names_every_class() {
        let config = pointcept_config();
        assert!(
            config.contains("class_names = [\"plane\", \"cylinder\","),
            "{config}"
        );
        assert!(config.contains("num_classes = 11\n") && config.contains("\"{{ fileDirname }}\""));
    }
}
