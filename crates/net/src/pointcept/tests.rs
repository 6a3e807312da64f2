//! Tests names, layouts, refusals, and that weights are the same after both conversions.

use super::*;
use crate::testing::net_with;

fn base_like() -> NetConfig {
    net_with(as_pointcept)
}

fn as_pointcept(ptv3: &mut Ptv3Config) {
    (ptv3.norm, ptv3.xcpe_of_skip) = (NormKind::Batch, true);
}

fn file(config: &NetConfig) -> ModelFile {
    ModelFile {
        model: Model::init(config, 3, Backend::Flex).unwrap(),
        preparation: serde_json::json!({ "tokens.voxels": "plain" }),
        trained_on: None,
    }
}

fn read_again(state: &PointceptState) -> PointceptState {
    PointceptState::from_bytes(&state.to_bytes().unwrap()).unwrap()
}

#[test]
fn names_are_those_of_pointcept() {
    let stages = crate::model::backbones::Preset::Base.stages();
    let map = NameMap::new(&stages);
    for (ours, exported) in [
        ("backbone.stem.conv.weight", "embedding.stem.conv.weight"),
        (
            "backbone.stem.norm.running_variance",
            "embedding.stem.norm.running_var",
        ),
        (
            "backbone.encoder.3.pool.norm.bias",
            "enc.enc3.down.norm.0.bias",
        ),
        (
            "backbone.encoder.3.pool.linear.weight",
            "enc.enc3.down.proj.weight",
        ),
        (
            "backbone.encoder.0.blocks.1.xcpe.conv.bias",
            "enc.enc0.block1.cpe.0.bias",
        ),
        (
            "backbone.decoder.0.child.linear.weight",
            "dec.dec3.up.proj.0.weight",
        ),
        (
            "backbone.decoder.3.skip.norm.weight",
            "dec.dec0.up.proj_skip.1.weight",
        ),
        (
            "backbone.decoder.3.blocks.0.mlp.out.weight",
            "dec.dec0.block0.mlp.0.fc2.weight",
        ),
    ] {
        assert_eq!(map.pointcept_name(ours), format!("backbone.{exported}"));
        assert_eq!(map.pointcept_name_below(ours, ""), exported);
    }
    assert_eq!(map.pointcept_name("head.weight"), "partprobe_head.weight");
}

#[test]
fn a_convolution_has_three_axes_of_cells_with_z_fastest() {
    let config = base_like();
    let state = to_pointcept(&file(&config)).unwrap().into_tensors();
    let exported = &state["backbone.embedding.stem.conv.weight"];
    assert_eq!(exported.dims, [32, 5, 5, 5, 6]);
    let shapes = parameters::shapes(Model::init(&config, 3, Backend::Flex).unwrap().network());
    let ours = file(&config).model.values();
    assert_eq!(shapes[0].name, "backbone.stem.conv.weight");
    // Cell (1, 2, 3), input channel 4, output channel 7.
    let cell = (5 + 2) * 5 + 3;
    let theirs_at = (((7 * 5 + 1) * 5 + 2) * 5 + 3) * 6 + 4;
    assert_eq!(ours[(cell * 6 + 4) * 32 + 7], exported.values[theirs_at]);
}

#[test]
fn converting_back_gives_the_same_bytes() {
    let own = file(&base_like());
    let state = read_again(&to_pointcept(&own).unwrap());
    let back = from_pointcept(state, None, 0, Backend::Flex).unwrap();
    assert!(back.has_head && back.left.is_empty());
    assert_eq!(back.file.to_bytes().unwrap(), own.to_bytes().unwrap());
}

/// The state of a network whose names begin with this prefix, without a note and without our head.
fn foreign(prefix: &str, more: &[(&str, &[usize])]) -> PointceptState {
    let tensors = to_pointcept(&file(&base_like())).unwrap().into_tensors();
    let mut tensors: Vec<StateTensor> = tensors
        .into_values()
        .filter_map(|tensor| {
            let name = tensor.name.strip_prefix("backbone.")?;
            Some(StateTensor {
                name: format!("{prefix}{name}"),
                ..tensor
            })
        })
        .collect();
    tensors.extend(more.iter().map(|(name, dims)| StateTensor {
        name: (*name).to_owned(),
        dims: dims.to_vec(),
        values: vec![0.5; dims.iter().product()],
    }));
    read_again(&PointceptState::new(tensors, None))
}

#[test]
fn a_backbone_is_found_under_any_prefix_and_its_head_is_new() {
    let config = base_like();
    for prefix in ["", "backbone.", "module.backbone."] {
        let state = foreign(prefix, &[("seg_head.bias", &[11])]);
        let taken = from_pointcept(state, Some(&config), 3, Backend::Flex).unwrap();
        assert!(!taken.has_head);
        assert_eq!(taken.left, ["seg_head.bias"]);
        assert_eq!(taken.file.model.values(), file(&config).model.values());
    }
}

#[test]
fn what_does_not_fit_is_named() {
    let config = base_like();
    let message = |state: PointceptState, config: Option<&NetConfig>| {
        from_pointcept(state, config, 0, Backend::Flex)
            .unwrap_err()
            .to_string()
    };
    assert!(message(foreign("", &[]), None).contains("--backbone base"));
    let table = foreign("", &[("enc.enc0.block0.attn.rpe.rpe_table", &[3, 2])]);
    assert!(
        message(table, Some(&config))
            .contains("`enc.enc0.block0.attn.rpe.rpe_table` has no counterpart")
    );
    let two = foreign("a.", &[("b.embedding.stem.conv.weight", &[1])]);
    assert!(message(two, Some(&config)).contains("holds 2 backbones: a., b."));
    let none = PointceptState::new(Vec::new(), None);
    assert!(
        message(none, Some(&config)).contains("no tensor ends in `embedding.stem.conv.weight`")
    );
    let mut larger = config.clone();
    if let BackboneConfig::Ptv3(ptv3) = &mut larger.backbone {
        ptv3.preset = crate::model::backbones::Preset::Base;
    }
    assert!(
        message(foreign("", &[]), Some(&larger)).contains("is it the size that --backbone names?")
    );
    let colors = foreign("", &[("embedding.stem.conv.weight", &[32, 5, 5, 5, 9])]);
    assert!(message(colors, Some(&config)).contains("the stem reads 9 channels"));
}

#[test]
fn settings_without_a_counterpart_are_refused_by_their_key() {
    type Change = fn(&mut Ptv3Config);
    let refusals: [(Change, &str); 5] = [
        (|ptv3| ptv3.norm = NormKind::Layer, "net.backbone.norm"),
        (
            |ptv3| ptv3.cell_exchange = true,
            "net.backbone.cell_exchange",
        ),
        (
            |ptv3| ptv3.xcpe_of_skip = false,
            "net.backbone.xcpe_of_skip",
        ),
        (|ptv3| ptv3.xcpe = false, "net.backbone.xcpe"),
        (|ptv3| ptv3.attention = false, "net.backbone.attention"),
    ];
    for (change, key) in refusals {
        let config = net_with(|ptv3| {
            as_pointcept(ptv3);
            change(ptv3);
        });
        let message = to_pointcept(&file(&config)).unwrap_err().to_string();
        assert!(message.starts_with(&format!("{key}: PTv3 ")), "{message}");
    }
}

#[test]
fn the_settings_are_those_of_the_published_network() {
    let config = net_with(|ptv3| {
        as_pointcept(ptv3);
        ptv3.preset = crate::model::backbones::Preset::Base;
        ptv3.patch = 1024;
        ptv3.orders.truncate(1);
    });
    let text = pointcept_backbone(&config).unwrap();
    for row in [
        "order=(\"z\",)",
        "stride=(2, 2, 2, 2)",
        "enc_depths=(2, 2, 2, 6, 2)",
        "enc_channels=(32, 64, 128, 256, 512)",
        "enc_num_head=(2, 4, 8, 16, 32)",
        "dec_num_head=(4, 4, 8, 16)",
        "dec_patch_size=(1024, 1024, 1024, 1024)",
    ] {
        assert!(text.contains(row), "{row} in {text}");
    }
}
