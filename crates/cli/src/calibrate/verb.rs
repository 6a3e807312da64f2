//! The verb itself.

use super::histogram_svg::histogram_svg;
use super::shapes::ShapeSource;
use super::sweep_svg::sweep_svg;
use crate::atomic_write::{ensure_empty, write_atomically};
use crate::config::{self, LabelConfig};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::stdout::print_line;
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use eval::{Calibration, CalibrationSettings, CalibrationTables, ShapeCalibration};
use rayon::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

/// Files that are measured between two looks at Ctrl-C; it decides nothing else.
const FILES_AT_ONCE: usize = 64;
/// Deep files must not end the program: threads get more stack than by default.
const STACK_BYTES: usize = 64 << 20;
/// Files that cannot be measured are named up to this number, and counted beyond.
const MAX_WARNINGS: usize = 10;

/// Show what the dihedral angles of a corpus say about the threshold θ: their distribution, a sweep, a stable range.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe calibrate parts/                                 STEP files, labelled on the way
  partprobe calibrate dataset/ --out calibration/            a data set of `partprobe label`, read as it is
  partprobe calibrate parts/ --set label.unit=solid --thetas 2,4,8,16

Prints the shares of small angles by primitive type, for shared edges and for pairs of faces; the statistics of the
parts at each θ (P parts, S boundary sharpness, D intra-part deviation, H part-size entropy, parts by type) with the
share of shapes whose partition changes against the operating θ; and the widest ranges of θ, anywhere in 1–45° and
around the operating θ, over which the partition of at most --tolerance of the shapes changes. All of it is about parts before small ones are absorbed (τ_min).
--out writes calibration.md, calibration.json, histogram.csv, sweep.csv, histogram.svg and sweep.svg.")]
pub struct CalibrateArgs {
    /// STEP files, folders, lists of paths, carrier files or data sets.
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// A folder to write tables and plots to.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The operating threshold in degrees; the config's label.theta_deg if not given.
    #[arg(long, value_name = "DEGREES")]
    theta: Option<f64>,
    /// The thresholds of the sweep, in degrees.
    #[arg(long, value_name = "DEGREES,…", value_delimiter = ',', default_values_t = [4.0, 6.0, 8.0, 10.0, 12.0])]
    thetas: Vec<f64>,
    /// Share of the shapes whose partition may change inside the suggested range.
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    tolerance: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    /// Threads; all cores if not given. The tables do not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    jobs: usize,
    /// Settings to start from: a shipped config or a file.
    #[arg(long, default_value = "base", value_name = "FILE")]
    config: String,
    /// Change one setting, for example label.unit=solid.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Measures every shape and prints the tables.
///
/// # Errors
/// If an argument cannot be meant, no shape could be measured, or a file cannot be written.
pub fn calibrate(args: &CalibrateArgs) -> Result<()> {
    // τ_min plays no part here, and counting triangles for it would cost most of the time.
    let overrides: Vec<String> = args.set.iter().cloned().chain(["label.tau_min=0".to_owned()]).collect();
    let config = config::load(&args.config, &overrides)?.config.label;
    let settings = settings(args, &config)?;
    if let Some(out) = &args.out {
        ensure_empty(out)?;
    }
    let sources = ShapeSource::all(&args.paths)?;
    ensure!(!sources.is_empty(), UsageError("there is no STEP file and no carrier in what was given".to_owned()));
    let calibration = measure(args, &sources, &config, &settings)?;
    let tables = calibration.tables();
    ensure!(tables.n_shapes > 0, "no shape could be measured");
    if let Some(out) = &args.out {
        write_tables(out, &tables)?;
    }
    print_line(if args.json { tables.to_json() } else { tables.to_markdown() }.trim_end())
}

fn settings(args: &CalibrateArgs, config: &LabelConfig) -> Result<CalibrationSettings> {
    let theta_deg = args.theta.unwrap_or(config.theta_deg);
    let mut thetas = args.thetas.iter().chain([&theta_deg]);
    ensure!(
        thetas.all(|theta| (0.0..=180.0).contains(theta)),
        UsageError("--theta and --thetas must lie in 0..=180".to_owned())
    );
    ensure!(
        (0.0..1.0).contains(&args.tolerance),
        UsageError("--tolerance must lie in 0..1, for example 0.05".to_owned())
    );
    let mut thetas_deg = args.thetas.clone();
    thetas_deg.sort_by(f64::total_cmp);
    thetas_deg.dedup();
    Ok(CalibrationSettings { theta_deg, thetas_deg, tolerance: args.tolerance })
}

/// Shapes are added in the order of the files, whichever thread was faster.
fn measure(
    args: &CalibrateArgs,
    sources: &[ShapeSource],
    config: &LabelConfig,
    settings: &CalibrationSettings,
) -> Result<Calibration> {
    let interrupt = Interrupt::listen()?;
    let bar = Progress::on_terminal().bar("calibrate", sources.len());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs).stack_size(STACK_BYTES).build()?;
    let measured = |source: &ShapeSource| -> Result<Vec<ShapeCalibration>> {
        let carriers = source.carriers(config).with_context(|| source.name().to_owned());
        bar.inc(1);
        Ok(carriers?.iter().map(|carrier| ShapeCalibration::of(carrier, settings)).collect())
    };
    let mut calibration = Calibration::new(settings.clone());
    let mut n_failed = 0;
    for chunk in sources.chunks(FILES_AT_ONCE) {
        if interrupt.is_set() {
            bail!("stopped; nothing was written");
        }
        let shapes: Vec<_> = pool.install(|| chunk.par_iter().map(measured).collect());
        for shapes in shapes {
            match shapes {
                Ok(shapes) => shapes.into_iter().for_each(|shape| calibration.add(shape)),
                Err(error) => {
                    n_failed += 1;
                    if n_failed <= MAX_WARNINGS {
                        bar.suspend(|| eprintln!("warning: {error:#}"));
                    }
                }
            }
        }
    }
    bar.finish_and_clear();
    if n_failed > 0 {
        eprintln!("{n_failed} of {} files could not be measured", sources.len());
    }
    Ok(calibration)
}

fn write_tables(out: &Path, tables: &CalibrationTables) -> Result<()> {
    fs::create_dir_all(out).with_context(|| format!("making {}", out.display()))?;
    let files = [
        ("calibration.md", tables.to_markdown()),
        ("calibration.json", tables.to_json()),
        ("histogram.csv", tables.histogram_csv()),
        ("sweep.csv", tables.sweep_csv()),
        ("histogram.svg", histogram_svg(tables)),
        ("sweep.svg", sweep_svg(tables)),
    ];
    files.iter().try_for_each(|(name, text)| write_atomically(&out.join(name), text.as_bytes()))
}
