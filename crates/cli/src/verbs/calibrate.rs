//! Runs `partprobe calibrate`: evaluates the dihedral angles of a corpus to choose the threshold θ.
//!
//! Everything that `label` reads, carriers and data sets go in. Tables come out on stdout, and with `--out` as Markdown, CSV,
//! JSON and SVG. `partprobe_calibration` makes every number and every plot. This module writes them.

use crate::damaged_carriers::{is_damaged_carrier, refuse_damaged_carriers};
use crate::interrupt::Interrupt;
use crate::own_output::OwnOutput;
use crate::shape_input::{ShapeArgs, ShapeInput, ShapeInputs};
use crate::shape_loop::for_each_measured;
use crate::stderr;
use crate::stdout::{print_line, print_tables};
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_calibration::{
    Calibration, CalibrationSettings, CalibrationTables, ShapeCalibration, histogram_svg, sweep_svg,
};
use partprobe_dataset::write_atomically;
use std::path::{Path, PathBuf};

/// The number of shapes that are measured between two checks for Ctrl-C. It has no other effect.
const SHAPES_AT_ONCE: usize = 64;
/// The largest number of files that are named because they cannot be measured. Further ones are only counted.
const MAX_WARNINGS: usize = 10;

/// Show how the parts of a corpus depend on the dihedral threshold θ: the distribution of the angles, a sweep over θ, and a
/// stable range of θ.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe calibrate parts/                                 STEP files, labeled on the way; archives too
  partprobe calibrate dataset/ --out calibration/            a data set of `partprobe label`, read as it is
  partprobe calibrate parts/ --set label.unit=solid --thetas 2,4,8,16

Prints the fractions of small angles by primitive type, for shared edges and for pairs of faces; the statistics of the parts at
each θ (P parts, S boundary sharpness, D intra-part deviation, H part-size entropy, parts by type) with the fraction of shapes
whose partition differs from that at the operating θ; and the widest ranges of θ, anywhere in 1–45° and around the operating θ,
over which the partition of at most the fraction --tolerance of the shapes changes. Parts are measured before small ones are
absorbed (τ_min).
--out writes calibration.md, calibration.json, histogram.csv, sweep.csv, histogram.svg and sweep.svg.")]
pub(crate) struct CalibrateArgs {
    #[command(flatten)]
    shapes: ShapeArgs,
    /// A folder to write tables and plots to.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the output of an earlier call.
    #[arg(long, requires = "out")]
    force: bool,
    /// The operating threshold, in degrees.
    #[arg(long, value_name = "DEGREES", default_value_t = 8.0)]
    theta: f64,
    /// The thresholds of the sweep, in degrees.
    #[arg(long, value_name = "DEGREES,…", value_delimiter = ',', default_values_t = [4.0, 6.0, 8.0, 10.0, 12.0])]
    thetas: Vec<f64>,
    /// The fraction of the shapes whose partition may change inside the suggested range.
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    tolerance: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// The files of the verb.
const OUTPUT: OwnOutput = OwnOutput {
    verb: "calibrate",
    marker: Some("calibration.md"),
    is_own: |name| {
        let names = [
            "calibration.md",
            "calibration.json",
            "histogram.csv",
            "histogram.svg",
            "sweep.csv",
            "sweep.svg",
        ];
        names.contains(&name)
    },
};

/// Measures every shape and prints the tables.
///
/// # Errors
/// If an argument is invalid, no shape could be measured, or a file cannot be written.
pub(crate) fn calibrate(args: &CalibrateArgs) -> Result<()> {
    let settings = settings(args)?;
    if let Some(out) = &args.out {
        OUTPUT.ensure_free(out, args.force, &args.shapes.paths)?;
    }
    args.shapes.check()?;
    let interrupt = Interrupt::listen()?;
    // τ_min is not needed here, and counting triangles for it would take most of the time.
    let sources = args
        .shapes
        .with_settings(["label.tau_min=0".to_owned()])
        .open_for("calibrate", &interrupt)?;
    let pool = args.shapes.thread_pool()?;
    let (calibration, n_damaged) = pool.install(|| measure(&sources, &settings, &interrupt))?;
    let tables = calibration.tables();
    ensure!(tables.n_shapes > 0, "no shape could be measured");
    if let Some(out) = &args.out {
        let _lock = OUTPUT.take(out, "writing tables into", args.force, &args.shapes.paths)?;
        write_tables(out, &tables)?;
    }
    if args.json {
        print_line(tables.to_json().trim_end())?;
    } else {
        print_tables(tables.to_markdown().trim_end())?;
    }
    refuse_damaged_carriers(n_damaged)
}

fn settings(args: &CalibrateArgs) -> Result<CalibrationSettings> {
    let mut thetas_deg = args.thetas.clone();
    ensure!(
        thetas_deg
            .iter()
            .chain([&args.theta])
            .all(|theta| (0.0..=180.0).contains(theta)),
        UsageError("--theta and --thetas must be from 0 to 180".to_owned())
    );
    ensure!(
        (0.0..1.0).contains(&args.tolerance),
        UsageError("--tolerance must be from 0 to below 1, for example 0.05".to_owned())
    );
    thetas_deg.sort_by(f64::total_cmp);
    thetas_deg.dedup();
    Ok(CalibrationSettings {
        theta_deg: args.theta,
        thetas_deg,
        tolerance: args.tolerance,
    })
}

/// Measures all shapes. Returns the calibration and the number of damaged carriers. Shapes are added in the order of the sources.
fn measure(
    sources: &ShapeInputs,
    settings: &CalibrationSettings,
    interrupt: &Interrupt,
) -> Result<(Calibration, usize)> {
    let measured = |source: &ShapeInput| {
        let carrier = source.carrier().with_context(|| source.id.clone())?;
        Ok(ShapeCalibration::of(&carrier, settings))
    };
    let mut calibration = Calibration::new(settings.clone());
    let mut failures: Vec<String> = sources
        .failed
        .iter()
        .map(|failed| format!("{}: {}", failed.source, failed.reason))
        .collect();
    let mut n_damaged = 0;
    let take = |shape: Result<ShapeCalibration>| match shape {
        Ok(shape) => calibration.add(shape),
        Err(error) => {
            n_damaged += usize::from(is_damaged_carrier(&error));
            failures.push(format!("{error:#}"));
        }
    };
    let shapes: Vec<&ShapeInput> = sources.shapes.iter().collect();
    for_each_measured(
        &shapes,
        "calibrate",
        SHAPES_AT_ONCE,
        interrupt,
        measured,
        take,
    )?;
    failures
        .iter()
        .take(MAX_WARNINGS)
        .for_each(|failure| stderr::print_line(format_args!("warning: {failure}")));
    if !failures.is_empty() {
        let n_shapes = sources.shapes.len() + sources.failed.len();
        stderr::print_line(format_args!(
            "{} of {n_shapes} could not be measured",
            failures.len()
        ));
    }
    Ok((calibration, n_damaged))
}

fn write_tables(out: &Path, tables: &CalibrationTables) -> Result<()> {
    let files = [
        ("calibration.md", tables.to_markdown()),
        ("calibration.json", tables.to_json()),
        ("histogram.csv", tables.histogram_csv()),
        ("sweep.csv", tables.sweep_csv()),
        ("histogram.svg", histogram_svg(tables)),
        ("sweep.svg", sweep_svg(tables)),
    ];
    for (name, text) in files {
        write_atomically(&out.join(name), text.as_bytes())?;
    }
    Ok(())
}
