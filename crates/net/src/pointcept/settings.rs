//! Writes the settings of a network as Pointcept's config of `PT-v3m1`.

use super::{PointceptError, ptv3_of};
use crate::model::net_config::NetConfig;
use std::fmt::Display;

/// Channels of an attention head.
const HEAD_DIM: usize = 16;

/// The table `backbone` of a Pointcept config whose network has the weights of [`super::to_pointcept`].
///
/// Attention without the package `flash_attn` computes the same numbers, so that switch is off.
///
/// # Errors
/// If a setting of the network has no counterpart in PTv3.
pub fn pointcept_backbone(config: &NetConfig) -> Result<String, PointceptError> {
    let ptv3 = ptv3_of(config)?;
    let stages = ptv3.preset.stages();
    let heads = |widths: &[usize]| tuple(widths.iter().map(|width| (width / HEAD_DIM).max(1)));
    let patches = |widths: &[usize]| tuple(widths.iter().map(|_| ptv3.patch));
    let (enc, dec) = (&stages.encoder_widths, &stages.decoder_widths);
    let orders = ptv3
        .orders
        .iter()
        .map(|curve| format!("\"{}\"", curve.name()));
    let shuffle = if ptv3.shuffle_orders { "True" } else { "False" };
    let rows = [
        ("type", "\"PT-v3m1\"".to_owned()),
        ("in_channels", "6".to_owned()),
        ("order", tuple(orders)),
        ("stride", tuple(dec.iter().map(|_| 2))),
        ("enc_depths", tuple(&stages.encoder_depths)),
        ("enc_channels", tuple(enc)),
        ("enc_num_head", heads(enc)),
        ("enc_patch_size", patches(enc)),
        ("dec_depths", tuple(&stages.decoder_depths)),
        ("dec_channels", tuple(dec)),
        ("dec_num_head", heads(dec)),
        ("dec_patch_size", patches(dec)),
        ("mlp_ratio", "4".to_owned()),
        ("drop_path", ptv3.drop_path.to_string()),
        ("shuffle_orders", shuffle.to_owned()),
        ("enable_flash", "False".to_owned()),
        ("upcast_attention", "False".to_owned()),
        ("upcast_softmax", "False".to_owned()),
    ];
    let rows = rows.map(|(key, value)| format!("    {key}={value},\n"));
    Ok(format!("backbone=dict(\n{})", rows.concat()))
}

/// A tuple in Python syntax. A tuple with a single element ends with a comma.
fn tuple<T: Display>(values: impl IntoIterator<Item = T>) -> String {
    let values: Vec<String> = values.into_iter().map(|value| value.to_string()).collect();
    let end = if values.len() == 1 { "," } else { "" };
    format!("({}{end})", values.join(", "))
}
