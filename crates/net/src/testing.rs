//! Makes small shapes with known parts, and small settings, for tests.

use crate::config::{
    AugmentConfig, LossConfig, LossWeight, OptimConfig, TokenConfig, TrainConfig, TrainSettings,
};
use crate::model::backbones::{BackboneConfig, Ptv3Config};
use crate::model::net_config::NetConfig;
use crate::training::TrainShape;
use partprobe_carrier::{PointSample, keyed_rng};

/// The network of the tests: the real preset, with patches that are small enough for small shapes to have several of them.
pub(crate) fn net() -> NetConfig {
    NetConfig {
        backbone: BackboneConfig::Ptv3(ptv3()),
        embedding_dim: 16,
        refine: None,
    }
}

/// Its backbone.
pub(crate) fn ptv3() -> Ptv3Config {
    Ptv3Config {
        patch: 16,
        ..Ptv3Config::default()
    }
}

/// The same network with a changed backbone.
pub(crate) fn net_with(change: impl Fn(&mut Ptv3Config)) -> NetConfig {
    let mut backbone = ptv3();
    change(&mut backbone);
    NetConfig {
        backbone: BackboneConfig::Ptv3(backbone),
        ..net()
    }
}

/// Settings for a training of a few seconds.
pub(crate) fn settings(steps: usize) -> TrainSettings {
    TrainSettings {
        loss: LossConfig {
            weight: LossWeight::Part,
            ..LossConfig::default()
        },
        optim: OptimConfig {
            learning_rate: 2e-3,
            ..OptimConfig::default()
        },
        augment: AugmentConfig::default(),
        tokens: TokenConfig {
            train_tokens: 60.into(),
            test_tokens: 60,
            ..TokenConfig::default()
        },
        train: TrainConfig {
            steps,
            batch_shapes: 2,
            seed: 5,
            ..TrainConfig::default()
        },
    }
}

/// A box of sides 1, 1 and `length`, with one label per face.
pub(crate) fn labeled_box(length: f32, n_points: usize) -> TrainShape {
    let id = format!("box-{length}");
    let rng = &mut keyed_rng(0, &["planted", &id]);
    let (mut sample, mut labels) = (PointSample::default(), Vec::new());
    for point in 0..n_points {
        let face = point % 6;
        let axis = face / 2;
        let mut position = [(); 3].map(|()| partprobe_carrier::unit_interval(rng) as f32);
        position[axis] = (face % 2) as f32;
        position[2] *= length;
        let mut normal = [0.0; 3];
        normal[axis] = if face % 2 == 0 { -1.0 } else { 1.0 };
        sample.points.push(position);
        sample.normals.push(normal);
        sample.triangles.push(face as u32);
        labels.push(face as i32);
    }
    TrainShape { id, sample, labels }
}

/// Four boxes of different lengths.
pub(crate) fn boxes() -> Vec<TrainShape> {
    [0.5, 1.0, 2.0, 3.0]
        .map(|length| labeled_box(length, 900))
        .to_vec()
}
