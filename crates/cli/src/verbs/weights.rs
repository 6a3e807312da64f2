//! Runs `partprobe weights`: it exchanges weights with Pointcept's PTv3, whose names and layouts differ from those of partprobe.
//!
//! A file goes in and a file comes out. Tensors that could not be converted are named on stderr.

use crate::config::{Config, FOREIGN_SUPERVISION, load};
use crate::run::train_settings;
use crate::stderr;
use crate::stdout::print_line;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::write_atomically;
use partprobe_net::{
    Backend, FromPointcept, ModelFile, NetConfig, PointceptState, Preset, ShapeKeys, TrainedOn,
    from_pointcept, pointcept_backbone, to_pointcept,
};
use std::fs;
use std::path::{Path, PathBuf};

/// Convert weights to and from the names of Pointcept's PTv3.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe weights to-pointcept runs/mine/checkpoints/step-parts-0/model.safetensors -o ptv3.safetensors
  partprobe weights from-pointcept ptv3.safetensors --backbone base -o model.safetensors

Pointcept saves checkpoints with pickle. tools/torch/pointcept.py converts them to safetensors and back.")]
pub(crate) struct WeightsArgs {
    #[command(subcommand)]
    direction: Direction,
}

/// The directions.
#[derive(Clone, Debug, clap::Subcommand)]
enum Direction {
    /// Write trained weights as the state dict of a PT-v3m1, and print the settings of that network.
    ToPointcept(ToArgs),
    /// Read the state dict of a PT-v3m1, for `train --init`, `embed` and `predict`.
    FromPointcept(FromArgs),
}

/// What `to-pointcept` takes.
#[derive(Clone, Debug, clap::Args)]
struct ToArgs {
    /// A file of trained weights of PTv3 with batch norms.
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// The safetensors file to write.
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
}

/// What `from-pointcept` takes.
#[derive(Clone, Debug, clap::Args)]
struct FromArgs {
    /// A safetensors file with the tensors of a PT-v3m1, or of a model that contains one.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The size of the network: micro, tiny, mini or base. A file that `to-pointcept` wrote contains it.
    #[arg(long, value_name = "NAME", value_parser = size)]
    backbone: Option<&'static str>,
    /// Override a value of the network's config, which is PTv3 as published: patches of 1024, plain voxels.
    #[arg(long, value_name = "KEY=VALUE", requires = "backbone")]
    set: Vec<String>,
    /// The seed of the embedding head, which PTv3 does not have.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Declare that these weights were not trained on any of your shapes. Without this option, no training starts from them.
    #[arg(long, requires = "backbone")]
    unseen: bool,
    /// The file of weights to write.
    #[arg(short, long, value_name = "MODEL")]
    out: PathBuf,
}

fn size(text: &str) -> Result<&'static str, String> {
    let names = Preset::ALL.map(Preset::name);
    let found = names.into_iter().find(|name| *name == text);
    found.ok_or_else(|| format!("PT-v3m1 has the sizes {}", names.join(", ")))
}

/// Converts a file.
///
/// # Errors
/// If it cannot be read or written, or the networks differ in more than names and layouts.
pub(crate) fn weights(args: &WeightsArgs) -> Result<()> {
    match &args.direction {
        Direction::ToPointcept(args) => write_for_pointcept(args),
        Direction::FromPointcept(args) => read_from_pointcept(args),
    }
}

fn write_for_pointcept(args: &ToArgs) -> Result<()> {
    let context = || args.model.display().to_string();
    let file = ModelFile::from_bytes(&read(&args.model)?, Backend::Flex).with_context(context)?;
    let state = to_pointcept(&file).with_context(context)?;
    if file.preparation["tokens.voxels"] == "normal-keyed" {
        stderr::print_line(
            "warning: these weights were trained on several tokens per cell, one for each dominant axis of the normals \
             (tokens.voxels = \"normal-keyed\"). Pointcept has one token per cell, so its features differ from partprobe's. \
             Train with tokens.voxels = \"plain\" if they must agree",
        );
    }
    write_atomically(&args.out, &state.to_bytes()?)?;
    print_line(args.out.display())?;
    print_line(pointcept_backbone(file.model.config())?)
}

fn read_from_pointcept(args: &FromArgs) -> Result<()> {
    let config = args.config()?;
    let net = config.as_ref().map(|config| &config.net);
    let taken = taken(args, net)?;
    let FromPointcept {
        mut file,
        has_head,
        left,
    } = taken;
    if let Some(config) = &config {
        file.preparation = config.preparation();
        file.trained_on = args.unseen.then(|| TrainedOn {
            supervision: FOREIGN_SUPERVISION.to_owned(),
            settings: train_settings(config, 1, args.seed),
            train: ShapeKeys::default(),
            valid: ShapeKeys::default(),
            initial: None,
        });
    }
    if !has_head {
        stderr::print_line(format_args!(
            "note: PTv3 has no embedding head, so the head has initial weights (seed {}); train it before you use embeddings",
            args.seed
        ));
    }
    if !left.is_empty() {
        stderr::print_line(format_args!(
            "note: not part of the backbone, and left out: {}",
            left.join(", ")
        ));
    }
    write_atomically(&args.out, &file.to_bytes()?)?;
    print_line(args.out.display())
}

fn taken(args: &FromArgs, net: Option<&NetConfig>) -> Result<FromPointcept> {
    let context = || args.file.display().to_string();
    let bytes = read(&args.file)?;
    let is_pickled = bytes.starts_with(b"PK") || bytes.starts_with(b"\x80");
    ensure!(
        !is_pickled,
        "{} is a checkpoint of PyTorch, which is pickled; unpack it with `python tools/torch/pointcept.py unpack {0} FILE`",
        args.file.display()
    );
    let state = PointceptState::from_bytes(&bytes).with_context(context)?;
    from_pointcept(state, net, args.seed, Backend::Flex).with_context(context)
}

impl FromArgs {
    /// The config of the named network.
    fn config(&self) -> Result<Option<Config>> {
        let Some(size) = self.backbone else {
            return Ok(None);
        };
        let mut set = vec![
            "net.backbone.type=ptv3".to_owned(),
            format!("net.backbone.preset={size}"),
            "net.backbone.norm=batch".to_owned(),
            "net.backbone.xcpe_of_skip=true".to_owned(),
            "net.backbone.patch=1024".to_owned(),
            "tokens.voxels=plain".to_owned(),
        ];
        set.extend(self.set.iter().cloned());
        Ok(Some(load("base", &set)?.config))
    }
}

fn read(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).with_context(|| format!("reading {}", path.display()))
}
