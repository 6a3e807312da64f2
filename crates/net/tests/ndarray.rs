//! Compares the CPU backend with burn-ndarray: the same weights give the same embeddings with every kind of backbone.
#![cfg(feature = "ndarray")]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot build its input has failed"
)]

use partprobe_carrier::{PointSample, keyed_rng, unit_interval};
use partprobe_net::{
    BackboneConfig, Backend, LiteptConfig, Model, NetConfig, NormKind, PointnetConfig, Ptv3Config,
    PtxConfig, Tokens, Voxels, tokenize,
};

/// The tokens of a box of 1 × 1 × 2.
fn tokens() -> Tokens {
    let rng = &mut keyed_rng(0, &["ndarray"]);
    let mut sample = PointSample::default();
    for point in 0..900 {
        let face = point % 6;
        let axis = face / 2;
        let mut position = [(); 3].map(|()| unit_interval(rng) as f32);
        position[axis] = (face % 2) as f32;
        position[2] *= 2.0;
        let mut normal = [0.0; 3];
        normal[axis] = if face % 2 == 0 { -1.0 } else { 1.0 };
        sample.points.push(position);
        sample.normals.push(normal);
        sample.triangles.push(face as u32);
    }
    tokenize(&sample, 60, Voxels::NormalKeyed).unwrap()
}

#[test]
fn the_ndarray_backend_agrees_with_the_default_one() {
    let backbones = [
        BackboneConfig::Ptv3(Ptv3Config::default()),
        BackboneConfig::Ptv3(Ptv3Config {
            norm: NormKind::Batch,
            ..Ptv3Config::default()
        }),
        BackboneConfig::Litept(LiteptConfig::default()),
        BackboneConfig::Ptx(PtxConfig::default()),
        BackboneConfig::Pointnet(PointnetConfig {
            widths: vec![16, 24],
        }),
    ];
    let tokens = tokens();
    for backbone in backbones {
        let config = NetConfig {
            backbone,
            embedding_dim: 8,
            refine: None,
        };
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
