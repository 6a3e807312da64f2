//! Runs `partprobe synth`: it writes generated mechanical parts as STEP files.

use crate::config::{SynthConfig, by_flag, load};
use crate::interrupt;
use crate::output_folder::make_folder;
use crate::own_output::OwnOutput;
use crate::progress::Progress;
use crate::stdout::print_line;
use anyhow::Result;
use partprobe_dataset::write_atomically;
use partprobe_synth::{SynthSettings, part};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Generate parametric mechanical parts and write them as STEP AP214 files.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe synth --out parts/ -n 100 --seed 7
The same seed gives the same files on any machine.")]
pub(crate) struct SynthArgs {
    /// The folder to write to.
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
    /// Replace the output of an earlier call.
    #[arg(long)]
    force: bool,
    /// The number of parts; the config's synth.n if not given.
    #[arg(short, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    n: Option<u64>,
    /// The seed; the config's synth.seed if not given.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The smallest number of STEP parts per generated part.
    #[arg(long)]
    min_parts: Option<u32>,
    /// The largest number of STEP parts per generated part.
    #[arg(long)]
    max_parts: Option<u32>,
    /// A shipped config or a TOML file.
    #[arg(long, default_value = "base", value_name = "NAME|FILE")]
    config: String,
    /// Override a value of the config, for example `synth.n=20`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// The files of the verb.
const OUTPUT: OwnOutput = OwnOutput {
    verb: "synth",
    marker: None,
    is_own: |name| name.starts_with("synth-") && name.ends_with(".step"),
};

/// Writes the parts.
///
/// # Errors
/// If a setting is out of its range or a file cannot be written.
pub(crate) fn synth(args: &SynthArgs) -> Result<()> {
    let mut overrides = args.set.clone();
    let given = [
        ("-n", "n", args.n),
        ("--seed", "seed", args.seed),
        ("--min-parts", "min_parts", args.min_parts.map(u64::from)),
        ("--max-parts", "max_parts", args.max_parts.map(u64::from)),
    ];
    for (flag, key, value) in given {
        overrides.extend(value.map(|value| by_flag(flag, format!("synth.{key}={value}"))));
    }
    let loaded = load(&args.config, &overrides)?;
    interrupt::end_at_once()?;
    let _lock = OUTPUT.take(&args.out, "generating parts in", args.force, &[])?;
    write_parts(&args.out, &loaded.config.synth, &Progress::on_terminal())?;
    print_line(format_args!(
        "{} STEP files in {}",
        loaded.config.synth.n,
        args.out.display()
    ))
}

/// Writes each part of `config` as `<name>.step` into `folder`.
///
/// # Errors
/// If a file cannot be written.
pub(crate) fn write_parts(folder: &Path, config: &SynthConfig, progress: &Progress) -> Result<()> {
    make_folder(folder)?;
    let settings = SynthSettings {
        seed: config.seed,
        min_parts: config.min_parts,
        max_parts: config.max_parts,
    };
    let bar = progress.bar("generate", usize::try_from(config.n)?);
    (0..config.n).into_par_iter().try_for_each(|index| {
        let made = part(&settings, index);
        bar.inc(1);
        write_atomically(
            &folder.join(format!("{}.step", made.name)),
            made.step.as_bytes(),
        )
    })?;
    bar.finish();
    Ok(())
}
