//! Runs `partprobe parity`, which is hidden: it writes a case that `tools/torch/parity.py` computes again in PyTorch.

use crate::config::load;
use crate::label::carriers_of_path;
use crate::points::points_of;
use crate::stdout::print_line;
use anyhow::{Context, Result};
use partprobe_dataset::write_atomically;
use partprobe_net::{Backend, Model, Tokens, tokenize};
use std::fs;
use std::path::PathBuf;

/// Write one forward and backward pass of a network on real tokens, which another implementation can repeat.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Example: partprobe parity part.step --set net.backbone.preset=tiny --out tiny.safetensors"
)]
pub(crate) struct ParityArgs {
    /// STEP files or carriers. Their shapes are one batch.
    #[arg(value_name = "PATH", required = true)]
    paths: Vec<PathBuf>,
    /// The file to write.
    #[arg(long, short, value_name = "FILE")]
    out: PathBuf,
    /// A shipped config or a TOML file.
    #[arg(long, default_value = "base", value_name = "NAME|FILE")]
    config: String,
    /// Override a value of the config.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Trained weights of the same network; random ones if not given.
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// The seed of the random weights.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

/// Writes the case.
///
/// # Errors
/// If a file cannot be read or written, or the numbers are not finite.
pub(crate) fn parity(args: &ParityArgs) -> Result<()> {
    let config = load(&args.config, &args.set)?.config;
    let model = match &args.weights {
        Some(path) => {
            let bytes = fs::read(path).with_context(|| format!("reading {}", path.display()))?;
            Model::from_safetensors(&config.net, &bytes, Backend::Flex)?
        }
        None => Model::init(&config.net, args.seed, Backend::Flex)?,
    };
    let mut shapes: Vec<Tokens> = Vec::new();
    for path in &args.paths {
        for carrier in carriers_of_path(path, &config.label)? {
            let sample = points_of(&carrier.meta().id, &carrier, &config.sample)?;
            shapes.push(tokenize(
                &sample,
                config.tokens.test_tokens,
                config.tokens.voxels,
            )?);
        }
    }
    write_atomically(&args.out, &model.parity_case(&shapes)?)?;
    print_line(args.out.display())
}
