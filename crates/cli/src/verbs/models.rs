//! Runs `partprobe models`: it lists the backbones that a config can choose, with their sizes.

use crate::config::{Config, LoadedConfig, load, shipped_names};
use crate::markdown_table::Alignment::{Left, Right};
use crate::markdown_table::markdown_table;
use crate::stdout::{print_line, print_tables};
use anyhow::{Result, bail};
use partprobe_dataset::json_document;
use partprobe_net::{BackboneConfig, Model, NetConfig, TokenConfig, TrainTokens};
use serde::Serialize;

/// List the backbones: parameters, stages, channels, default tokens.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Example: partprobe run abc-small --data parts/ --set net.backbone.preset=tiny
The baseline: partprobe run pointnet --data parts/. A stage is written as blocks × channels, the finest first."
)]
pub(crate) struct ModelsArgs {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Prints one line per backbone.
///
/// # Errors
/// If stdout cannot be written to.
pub(crate) fn models(args: &ModelsArgs) -> Result<()> {
    let mut rows = Vec::new();
    for backbone in BackboneConfig::TYPES {
        let loaded = shipped_config_of(backbone)?;
        let Config { net, tokens, .. } = &loaded.config;
        for (name, backbone) in net.backbone.named_sizes() {
            let sized = NetConfig {
                backbone,
                ..net.clone()
            };
            rows.push(Row::new(name, &sized, tokens)?);
        }
    }
    if args.json {
        return print_line(String::from_utf8_lossy(&json_document(&rows)?).trim_end());
    }
    print_tables(table(&rows))
}

/// The first shipped config that chooses this type of backbone.
fn shipped_config_of(backbone: &str) -> Result<LoadedConfig> {
    for name in shipped_names() {
        let loaded = load(name, &[])?;
        if loaded.config.net.backbone.type_name() == backbone {
            return Ok(loaded);
        }
    }
    bail!("no shipped config has the backbone `{backbone}`; add one to SHIPPED in config/merge.rs")
}

/// The size of one backbone.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Row {
    /// The `type` in `[net.backbone]`.
    r#type: &'static str,
    /// The preset, or the type again if it has none.
    name: &'static str,
    /// Parameters below the embedding head.
    parameters: usize,
    parameters_with_head: usize,
    /// Blocks and channels of each stage, beginning with the finest one.
    encoder: Vec<[usize; 2]>,
    decoder: Vec<[usize; 2]>,
    embedding_dim: usize,
    train_tokens: TrainTokens,
    test_tokens: usize,
}

impl Row {
    fn new(name: &'static str, net: &NetConfig, tokens: &TokenConfig) -> Result<Self> {
        let count = Model::count_parameters(net)?;
        let stages = net.backbone.stages();
        Ok(Self {
            r#type: net.backbone.type_name(),
            name,
            parameters: count.backbone,
            parameters_with_head: count.backbone + count.head,
            encoder: pairs(&stages.encoder_depths, &stages.encoder_widths),
            decoder: pairs(&stages.decoder_depths, &stages.decoder_widths),
            embedding_dim: net.embedding_dim,
            train_tokens: tokens.train_tokens,
            test_tokens: tokens.test_tokens,
        })
    }

    fn cells(&self) -> [String; 7] {
        [
            self.r#type.to_owned(),
            self.name.to_owned(),
            grouped(self.parameters),
            grouped(self.parameters_with_head),
            stages_text(&self.encoder),
            stages_text(&self.decoder),
            format!("{} / {}", self.train_tokens, self.test_tokens),
        ]
    }
}

fn pairs(depths: &[usize], widths: &[usize]) -> Vec<[usize; 2]> {
    depths
        .iter()
        .zip(widths)
        .map(|(&depth, &width)| [depth, width])
        .collect()
}

fn stages_text(stages: &[[usize; 2]]) -> String {
    if stages.is_empty() {
        return "–".to_owned();
    }
    stages
        .iter()
        .map(|[depth, width]| format!("{depth}×{width}"))
        .collect::<Vec<_>>()
        .join(" ")
}

/// The digits in groups of three.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .filter_map(|group| std::str::from_utf8(group).ok())
        .collect();
    groups.join(" ")
}

/// The rows as a table for readers.
fn table(rows: &[Row]) -> String {
    let heading = [
        "backbone",
        "preset",
        "parameters",
        "with head",
        "encoder",
        "decoder",
        "tokens train / test",
    ];
    let alignment = [Left, Left, Right, Right, Left, Left, Left];
    markdown_table(heading, alignment, rows.iter().map(Row::cells))
}
