//! Maps the names and shapes of our tensors to those of Pointcept's `PT-v3m1`.
//!
//! A name is converted component by component, from the stage to the layer. Both networks have the same layers, so each of our
//! tensors has a counterpart.

use crate::model::backbones::Stages;
use crate::model::parameters::ParameterShape;

/// The prefix of a backbone within Pointcept's segmentors.
pub(super) const BACKBONE: &str = "backbone.";
/// The stem's tensor, by which a backbone is recognized.
pub(super) const STEM: &str = "embedding.stem.conv.weight";
/// Our embedding head among their tensors. Their heads have other names and meanings, so it does not replace any of them.
const HEAD: &str = "partprobe_head";

/// Our names of layers within a block, and theirs.
const BLOCK: [(&str, &str); 9] = [
    ("xcpe.conv", "cpe.0"),
    ("xcpe.out", "cpe.1"),
    ("xcpe.norm", "cpe.2"),
    ("attention.norm", "norm1.0"),
    ("attention.qkv", "attn.qkv"),
    ("attention.out", "attn.proj"),
    ("mlp.norm", "norm2.0"),
    ("mlp.hidden", "mlp.0.fc1"),
    ("mlp.out", "mlp.0.fc2"),
];
/// Our names of layers between stages, and theirs.
const BETWEEN: [(&str, &str); 6] = [
    ("pool.linear", "down.proj"),
    ("pool.norm", "down.norm.0"),
    ("child.linear", "up.proj.0"),
    ("child.norm", "up.proj.1"),
    ("skip.linear", "up.proj_skip.0"),
    ("skip.norm", "up.proj_skip.1"),
];

/// The names of one network.
pub(super) struct NameMap {
    n_decoders: usize,
}

impl NameMap {
    pub(super) fn new(stages: &Stages) -> Self {
        Self {
            n_decoders: stages.decoder_widths.len(),
        }
    }

    /// Their name of our tensor, in a segmentor.
    pub(super) fn pointcept_name(&self, ours: &str) -> String {
        self.pointcept_name_below(ours, BACKBONE)
    }

    /// Their name of our tensor, if the names of the backbone begin with `prefix`.
    pub(super) fn pointcept_name_below(&self, ours: &str, prefix: &str) -> String {
        let (layer, field) = ours.rsplit_once('.').unwrap_or(("", ours));
        let field = match field {
            "running_variance" => "running_var",
            other => other,
        };
        match layer.strip_prefix("backbone.") {
            None => format!("{HEAD}.{field}"),
            Some(layer) => format!("{prefix}{}.{field}", self.layer(layer)),
        }
    }

    fn layer(&self, ours: &str) -> String {
        if let Some(rest) = ours.strip_prefix("stem.") {
            return format!("embedding.stem.{rest}");
        }
        let (side, rest) = ours.split_once('.').unwrap_or((ours, ""));
        let (index, layer) = rest.split_once('.').unwrap_or((rest, ""));
        let stage = if side == "encoder" {
            format!("enc.enc{index}")
        } else {
            // Our decoder stages begin with the coarsest one. Theirs are numbered from the finest one.
            let from_coarsest: usize = index.parse().unwrap_or(0);
            format!(
                "dec.dec{}",
                self.n_decoders.saturating_sub(from_coarsest + 1)
            )
        };
        format!("{stage}.{}", layer_of_stage(layer))
    }

    /// Their shape of our tensor: matrices transposed, and the cells of a convolution as three axes.
    pub(super) fn their_dims(&self, shape: &ParameterShape) -> Vec<usize> {
        let side = if is_stem(&shape.name) { 5 } else { 3 };
        match shape.dims[..] {
            [dim_in, dim_out] if shape.name.ends_with("conv.weight") => {
                vec![dim_out, side, side, side, dim_in / (side * side * side)]
            }
            [dim_in, dim_out] => vec![dim_out, dim_in],
            _ => shape.dims.clone(),
        }
    }
}

fn layer_of_stage(ours: &str) -> String {
    if let Some(block) = ours.strip_prefix("blocks.") {
        let (index, layer) = block.split_once('.').unwrap_or((block, ""));
        return format!("block{index}.{}", replaced(&BLOCK, layer));
    }
    replaced(&BETWEEN, ours).to_owned()
}

fn replaced<'a>(pairs: &[(&'static str, &'static str)], layer: &'a str) -> &'a str {
    pairs
        .iter()
        .find(|(ours, _)| *ours == layer)
        .map_or(layer, |(_, pointcept_name)| pointcept_name)
}

pub(super) fn is_stem(ours: &str) -> bool {
    ours == "backbone.stem.conv.weight"
}

pub(super) fn is_head(ours: &str) -> bool {
    ours.starts_with("head.")
}

/// Whether one of their tensors only counts batches. The batch norms of PTv3 have a fixed momentum and do not read it.
pub(super) fn is_counter(pointcept_name: &str) -> bool {
    pointcept_name.ends_with(".num_batches_tracked")
}

/// # Shapes
/// - values: `[n_rows, n_columns]`
/// - output: `[n_columns, n_rows]`
pub(super) fn transposed(values: &[f32], n_rows: usize, n_columns: usize) -> Vec<f32> {
    let of_column = |column: usize| (0..n_rows).map(move |row| values[row * n_columns + column]);
    (0..n_columns).flat_map(of_column).collect()
}
