//! Makes small shapes with known parts, and small settings, for tests.

use crate::config::Voxels;
use crate::config::{
    AugmentConfig, Hinge, LossConfig, LossWeight, NoDefect, OptimConfig, ScheduleConfig,
    TokenConfig, TrainConfig, TrainSettings,
};
use crate::data::curve::Curve;
use crate::model::backbones::{BackboneConfig, Preset, Ptv3Config};
use crate::model::layers::NormKind;
use crate::model::net_config::NetConfig;
use crate::training::TrainShape;
use partprobe_carrier::{PointSample, keyed_rng};

/// The network that tests run: the real preset, with patches small enough that small shapes have several.
pub(crate) fn net() -> NetConfig {
    NetConfig {
        backbone: BackboneConfig::Ptv3(ptv3()),
        embedding_dim: 16,
    }
}

/// Its backbone.
pub(crate) fn ptv3() -> Ptv3Config {
    Ptv3Config {
        preset: Preset::Micro,
        patch: 16,
        norm: NormKind::Layer,
        drop_path: 0.0,
        xcpe: true,
        attention: true,
        orders: Curve::ALL.to_vec(),
        shuffle_orders: true,
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
            pull_weight: 1.0,
            push_weight: 1.0,
            proto_ce_weight: 1.0,
            pull_margin: 0.1,
            push_margin: 0.3,
            temperature: 0.1,
            hinge: Hinge::Linear,
            weight: LossWeight::Part,
        },
        optim: OptimConfig {
            learning_rate: 2e-3,
            weight_decay: 0.02,
            block_lr_factor: 1.0,
            clip_norm: 3.0,
            schedule: ScheduleConfig::OneCycle {
                warmup_fraction: 0.05,
                div: 10.0,
                final_div: 1000.0,
            },
        },
        augment: AugmentConfig {
            axis_rotations: true,
            free_rotation_probability: 0.5,
            reflect_probability: 0.5,
            scale: [0.8, 1.2],
            jitter_sigma: 0.005,
            jitter_clip: 0.02,
        },
        tokens: TokenConfig {
            train_tokens: 60,
            test_tokens: 60,
            voxels: Voxels::NormalKeyed,
        },
        train: TrainConfig {
            steps,
            batch_shapes: 2,
            accumulate: 1,
            seed: 5,
            defect: NoDefect::None,
        },
    }
}

/// A box of sides 1, 1 and `length` with a label for each of its six faces.
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
