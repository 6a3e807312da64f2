//! `partprobe sample`: points with normals and labels from each carrier of a data set.

use crate::atomic_write::{ensure_empty, write_atomically};
use crate::config::{self, NormalConfig, SampleConfig};
use crate::dataset::{Dataset, IndexEntry};
use crate::progress::Progress;
use crate::stdout::print_line;
use crate::usage::as_usage_error;
use anyhow::{Context, Result, ensure};
use carrier::{Carrier, NormalKind, PointSample, keyed_rng, sample_by_area};
use formats::{Compression, PlyPoints, SampleLabels, points_to_ply, sample_to_npz};
use rayon::prelude::*;
use sources::{LabelSource, source_named};
use std::fs;
use std::path::PathBuf;

/// Draw points with normals and labels from each carrier of a data set, uniformly by area.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe sample dataset/ --out points/ --format npz
  partprobe sample dataset/ --out clouds/ --format ply --n-points 5000 --normals analytic

NPZ: points f32 (N,3), normals f32 (N,3), triangles u32 (N), and label_<source> i32 (N) for each --source.
PLY: x y z nx ny nz, and int part with the labels of the first --source. Analytic normals need carriers that were
labelled with --set label.vertex_normals=true.")]
pub struct SampleArgs {
    /// The data set.
    dataset: PathBuf,
    /// The folder to write.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The format of the samples.
    #[arg(long, value_enum)]
    format: SampleFormat,
    /// Points of a shape; the config's sample.n_points if not given.
    #[arg(long, value_name = "N")]
    n_points: Option<usize>,
    /// Which normal a point gets; the config's sample.normals if not given.
    #[arg(long, value_enum)]
    normals: Option<Normals>,
    /// The seed; the config's sample.seed if not given.
    #[arg(long)]
    seed: Option<u64>,
    /// Label sources, first the one that a PLY file shows.
    #[arg(long = "source", value_name = "SOURCE", default_values = DEFAULT_SOURCES)]
    sources: Vec<String>,
    /// Settings to start from: a shipped config or a file.
    #[arg(long, default_value = "base", value_name = "FILE")]
    config: String,
    /// Change one setting.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// The formats of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum SampleFormat {
    /// One NumPy archive a shape.
    Npz,
    /// One binary point cloud a shape.
    Ply,
}

/// Which normal a point gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Normals {
    /// The triangle's.
    Triangle,
    /// The true surface's.
    Analytic,
}

/// Shapes that cannot be sampled are named up to this number, and counted beyond.
const MAX_WARNINGS: usize = 10;

type Sources = Vec<Box<dyn LabelSource + Send + Sync>>;

/// Samples every carrier; the files depend on the data set, the settings and the seed alone.
///
/// # Errors
/// If the data set is damaged, a source is unknown, no carrier could be sampled, or a file cannot be written.
pub fn sample(args: &SampleArgs) -> Result<()> {
    let config = settings(args)?;
    let sources =
        args.sources.iter().map(|name| Ok(source_named(name)?)).collect::<Result<Sources>>().map_err(as_usage_error)?;
    let dataset = Dataset::open(&args.dataset)?;
    ensure_empty(&args.out)?;
    fs::create_dir_all(&args.out).with_context(|| format!("making {}", args.out.display()))?;
    let entries = dataset.labelled();
    let bar = Progress::on_terminal().bar("sample", entries.len());
    let written: Vec<Result<()>> = entries
        .par_iter()
        .map(|entry| {
            let written = write_sample(args, &config, &dataset, entry, &sources).with_context(|| entry.id.clone());
            bar.inc(1);
            written
        })
        .collect();
    bar.finish_and_clear();
    let failures: Vec<_> = written.into_iter().filter_map(Result::err).collect();
    failures.iter().take(MAX_WARNINGS).for_each(|error| eprintln!("warning: {error:#}"));
    let n_written = entries.len() - failures.len();
    print_line(format_args!(
        "{}: {n_written} of {} shapes sampled, {} points each",
        args.out.display(),
        entries.len(),
        config.n_points
    ))?;
    ensure!(n_written > 0, "no shape could be sampled");
    Ok(())
}

fn settings(args: &SampleArgs) -> Result<SampleConfig> {
    let mut overrides = args.set.clone();
    overrides.extend(args.n_points.map(|n_points| format!("sample.n_points={n_points}")));
    overrides.extend(args.seed.map(|seed| format!("sample.seed={seed}")));
    overrides.extend(args.normals.map(|normals| match normals {
        Normals::Triangle => "sample.normals=triangle".to_owned(),
        Normals::Analytic => "sample.normals=analytic".to_owned(),
    }));
    Ok(config::load(&args.config, &overrides)?.config.sample)
}

fn write_sample(
    args: &SampleArgs,
    config: &SampleConfig,
    dataset: &Dataset,
    entry: &IndexEntry,
    sources: &Sources,
) -> Result<()> {
    let carrier = dataset.carrier(entry)?;
    let (sample, labels) = labelled_points(&carrier, config, sources)?;
    let (bytes, extension) = match args.format {
        SampleFormat::Npz => {
            let labels: SampleLabels = sources.iter().map(|source| source.name().to_owned()).zip(labels).collect();
            (sample_to_npz(&sample, &labels, Compression::Stored)?, "npz")
        }
        SampleFormat::Ply => {
            let parts = labels.into_iter().next().unwrap_or_default();
            (points_to_ply(&PlyPoints { points: sample.points, normals: sample.normals, parts }), "ply")
        }
    };
    write_atomically(&args.out.join(format!("{}.{extension}", entry.id)), &bytes)
}

/// The points of a carrier, and their labels by each source.
fn labelled_points(
    carrier: &Carrier,
    config: &SampleConfig,
    sources: &Sources,
) -> Result<(PointSample, Vec<Vec<i32>>)> {
    let sample = points_of(&carrier.meta().id, carrier, config)?;
    let mut labels = Vec::new();
    for source in sources {
        labels.push(source.labels(carrier, config.seed)?.label_of_points(&sample)?);
    }
    Ok((sample, labels))
}

/// The label sources of a point sample where none are named.
pub const DEFAULT_SOURCES: [&str; 3] = ["step-parts", "brep-face", "primitive"];

/// The file that this verb writes for a carrier, labelled by these sources.
///
/// # Errors
/// If a source is unknown, or the carrier has no area.
pub fn sample_npz(
    carrier: &Carrier,
    config: &SampleConfig,
    sources: &[&str],
    compression: Compression,
) -> Result<Vec<u8>> {
    let named = sources.iter().map(|name| Ok(source_named(name)?)).collect::<Result<Sources>>()?;
    let (sample, labels) = labelled_points(carrier, config, &named)?;
    let labels: SampleLabels = sources.iter().map(|&name| name.to_owned()).zip(labels).collect();
    Ok(sample_to_npz(&sample, &labels, compression)?)
}

/// The points of a shape: the same for every stage that asks with these settings.
///
/// # Errors
/// If the carrier has no area, or no vertex normals although analytic ones are asked for.
pub fn points_of(id: &str, carrier: &Carrier, config: &SampleConfig) -> Result<PointSample, carrier::SampleError> {
    let kind = match config.normals {
        NormalConfig::Triangle => NormalKind::Triangle,
        NormalConfig::Analytic => NormalKind::Analytic,
    };
    sample_by_area(carrier.mesh(), config.n_points, kind, &mut keyed_rng(config.seed, &["sample", id]))
}
