//! Compares the CPU backend with burn-ndarray: the same weights give the same embeddings with every kind of backbone, and the same
//! loss in a training.
#![cfg(feature = "ndarray")]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot build its input has failed"
)]

use partprobe_carrier::PointSample;
use partprobe_net::{
    BackboneConfig, Backend, LiteptConfig, Model, NetConfig, NormKind, PointnetConfig, Ptv3Config,
    PtxConfig, TrainSettings, TrainShape, Training, Voxels, tokenize,
};

/// Two squares that meet at a right angle, of 450 points each. Each square is a part.
fn corner() -> TrainShape {
    let (mut sample, mut labels) = (PointSample::default(), Vec::new());
    for point in 0..900 {
        let part = point % 2;
        let [u, v] = [point / 2 % 21, point / 42].map(|step| step as f32 / 21.0);
        sample.points.push([[u, v, 0.0], [0.0, v, u]][part]);
        sample
            .normals
            .push([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]][part]);
        sample.triangles.push(part as u32);
        labels.push(part as i32);
    }
    TrainShape {
        id: "corner".to_owned(),
        sample,
        labels,
    }
}

/// Small patches, so that a small shape has several of them.
fn ptv3() -> Ptv3Config {
    Ptv3Config {
        patch: 16,
        ..Ptv3Config::default()
    }
}

fn net(backbone: BackboneConfig) -> NetConfig {
    NetConfig {
        backbone,
        embedding_dim: 16,
        refine: None,
    }
}

#[test]
fn the_ndarray_backend_agrees_with_the_default_one() {
    let backbones = [
        BackboneConfig::Ptv3(ptv3()),
        BackboneConfig::Ptv3(Ptv3Config {
            norm: NormKind::Batch,
            ..ptv3()
        }),
        BackboneConfig::Litept(LiteptConfig::default()),
        BackboneConfig::Ptx(PtxConfig::default()),
        BackboneConfig::Pointnet(PointnetConfig {
            widths: vec![16, 24],
        }),
    ];
    let tokens = tokenize(&corner().sample, 60, Voxels::NormalKeyed).unwrap();
    for backbone in backbones {
        let config = net(backbone);
        let [flex, ndarray] = [Backend::Flex, Backend::Ndarray].map(|backend| {
            let model = Model::init(&config, 1, backend).unwrap();
            model.embed(&tokens).unwrap()
        });
        let apart = flex
            .values()
            .iter()
            .zip(ndarray.values())
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max);
        assert!(apart < 1e-4, "{:?}: {apart}", config.backbone);
    }
}

#[test]
fn a_training_on_ndarray_has_the_losses_of_the_default_backend() {
    let config = net(BackboneConfig::Ptv3(ptv3()));
    let mut settings = TrainSettings::default();
    settings.train.steps = 2;
    settings.train.batch_shapes = 1;
    settings.tokens.train_tokens = 60.into();
    let [flex, ndarray] = [Backend::Flex, Backend::Ndarray].map(|backend| {
        let mut training = Training::new(&config, &settings, backend).unwrap();
        let mut step = || {
            let batch = training.load(&[corner()]).unwrap();
            training.step(&batch).unwrap()
        };
        [step(), step()]
    });
    for (flex, ndarray) in flex.iter().zip(&ndarray) {
        let [loss, other] = [flex.loss.total, ndarray.loss.total];
        assert!((loss - other).abs() < 1e-3 * loss, "{flex:?} {ndarray:?}");
        let [norm, other] = [flex.grad_norm, ndarray.grad_norm];
        assert!((norm - other).abs() < 1e-2 * norm, "{flex:?} {ndarray:?}");
    }
}
