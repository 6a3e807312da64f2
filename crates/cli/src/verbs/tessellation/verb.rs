//! Runs `partprobe tessellation`.

use super::carriers::{TESSELLATIONS, TessellatedShape};
use super::grid::grid;
use super::measure::{Consistency, MeasuredShape, pair_name};
use crate::config::LabelConfig;
use crate::interrupt::Interrupt;
use crate::label::{InputFile, input_files};
use crate::label_sources::listed_sources;
use crate::own_output::OwnOutput;
use crate::shape_choice::ChoiceArgs;
use crate::shape_input::{DataArgs, ShapeInput, ShapeInputs};
use crate::stderr;
use crate::stdout::{print_line, print_tables};
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::{Dataset, write_atomically};
use partprobe_eval::{
    AgreementRow, AgreementTables, AgreementTablesSettings, Bootstrap, RefusedShape,
    agreement_tables,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The number of shapes that are measured between two checks for Ctrl-C. It has no other effect.
const SHAPES_AT_ONCE: usize = 8;
/// Bootstrap draws of the intervals.
const DRAWS: usize = 2000;
/// The number of shapes of which picture grids are made.
const N_GRIDS: usize = 4;

/// Measure whether label sources give the same labels on a finer and on a coarser mesh of the same shape.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe tessellation --data parts/ --sources step-parts,ward-20
  partprobe tessellation --data parts/ --sources step-parts --shapes 240 --min-parts 2 --max-parts 20 --out consistency/

Each STEP file is meshed three times: T0 with the settings as they are, T1 with half and T2 with twice the chord, the angle and
the longest edge of the refined mesh. Points are drawn once, on T0. They take the labels of T1 and T2 from the nearest triangle.
Labels are matched one to one, and labels without a match count 0. Sources that depend on the absorption of small parts are
measured with and without it (label.tau_min).
--out writes tessellation.md, tessellation.csv, tessellation.json, shapes.csv, refused.csv, and a PNG with the pictures of
each of the four shapes on which the labels agree least.")]
pub(crate) struct TessellationArgs {
    /// The sources; `partprobe sources` lists them.
    #[arg(long, required = true, value_delimiter = ',', value_name = "SOURCE,…")]
    sources: Vec<String>,
    #[command(flatten)]
    data: DataArgs,
    #[command(flatten)]
    choice: ChoiceArgs,
    /// The number of points per shape. They are uniform by area.
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    points: u32,
    /// A folder to write tables and pictures to.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the output of an earlier call.
    #[arg(long, requires = "out")]
    force: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// The files of the verb.
const OUTPUT: OwnOutput = OwnOutput {
    verb: "tessellation",
    marker: Some("tessellation.md"),
    is_own: |name| {
        let tables = [
            "tessellation.md",
            "tessellation.csv",
            "tessellation.json",
            "shapes.csv",
            "refused.csv",
        ];
        tables.contains(&name) || (name.starts_with("grid-") && name.ends_with(".png"))
    },
};

/// Measures every shape and prints the tables.
///
/// # Errors
/// If an argument is invalid, no shape could be measured, or a file cannot be written.
pub(crate) fn tessellation(args: &TessellationArgs) -> Result<()> {
    args.choice.check()?;
    args.data.check()?;
    check_surfaces(&args.data.paths)?;
    if let Some(out) = &args.out {
        OUTPUT.ensure_free(out, args.force, &args.data.paths)?;
    }
    let settings = args.data.settings()?;
    let config = settings.label.clone();
    let consistency = Consistency {
        sources: listed_sources(&settings, &args.sources)?,
        tau_min: config.tau_min,
        n_points: args.points as usize,
        seed: args.choice.seed,
    };
    let shape_args = args.data.shape_args();

    let interrupt = Interrupt::listen()?;
    let shapes = shape_args.open_for("tessellation", &interrupt)?;
    let files = input_files(&args.data.paths, &[])?.files;
    let study = Study {
        consistency,
        config,
        files: files
            .into_iter()
            .map(|file| (file.name.clone(), file))
            .collect(),
    };
    let pool = shape_args.thread_pool()?;
    let measured = pool.install(|| study.measure(args, &shapes, &interrupt))?;
    ensure!(
        !measured.rows.is_empty(),
        "no shape could be measured{}",
        measured
            .refused
            .first()
            .map_or_else(String::new, |first| format!(
                "; `{}` on {}: {}",
                first.source, first.shape, first.reason
            ))
    );

    let tables = agreement_tables(&measured.rows, measured.refused, study.table_settings());
    if let Some(out) = &args.out {
        let _lock = OUTPUT.take(out, "writing tables into", args.force, &args.data.paths)?;
        pool.install(|| study.write(out, &tables, &measured.rows, &shapes))?;
    }
    if args.json {
        print_line(tables.to_json().trim_end())
    } else {
        print_tables(tables.to_tessellation_markdown().trim_end())
    }
}

/// Refuses inputs without surfaces, because new meshes are made.
fn check_surfaces(paths: &[PathBuf]) -> Result<()> {
    for path in paths {
        let is_labeled =
            Dataset::is_at(path) || path.extension().is_some_and(|ending| ending == "npz");
        ensure!(
            !is_labeled,
            UsageError(format!(
                "{} holds no surfaces, and `tessellation` makes new meshes: give the STEP files that it was labeled from",
                path.display()
            ))
        );
    }
    Ok(())
}

/// The settings of one call.
struct Study {
    consistency: Consistency,
    config: LabelConfig,
    files: BTreeMap<String, InputFile>,
}

impl Study {
    /// Measures the chosen shapes. Rows are in the order of the shapes' ids, for any speed of the threads.
    fn measure(
        &self,
        args: &TessellationArgs,
        shapes: &ShapeInputs,
        interrupt: &Interrupt,
    ) -> Result<MeasuredShape> {
        let mut all = MeasuredShape::default();
        all.refused.extend(shapes.failed.iter().map(|failed| {
            refused_by_all(&failed.id, format!("it has no carrier: {}", failed.reason))
        }));
        let chosen = args.choice.choose(&shapes.shapes);
        let found = chosen.measured("tessellate", SHAPES_AT_ONCE, interrupt, |shape| {
            self.measured_shape(shape)
        })?;
        for shape in found {
            all.rows.extend(shape.rows);
            all.refused.extend(shape.refused);
        }
        Ok(all)
    }

    fn measured_shape(&self, shape: &ShapeInput) -> MeasuredShape {
        let measured = self.tessellated(shape).and_then(|tessellated| {
            self.consistency
                .measure(&tessellated, &shape.id, &shape.source)
        });
        measured.unwrap_or_else(|error| MeasuredShape {
            rows: Vec::new(),
            refused: vec![refused_by_all(&shape.id, format!("{error:#}"))],
        })
    }

    fn tessellated(&self, shape: &ShapeInput) -> Result<TessellatedShape> {
        let file = self.files.get(&shape.source);
        let file = file.context("its STEP text is inside of an archive; unpack the archive")?;
        TessellatedShape::new(file, &shape.id, &self.config)
    }

    fn table_settings(&self) -> AgreementTablesSettings {
        let consistency = &self.consistency;
        let mut thresholds = vec![consistency.tau_min, 0];
        thresholds.dedup();
        let pairs = thresholds.iter().flat_map(|&tau_min| {
            TESSELLATIONS[1..]
                .iter()
                .map(move |(name, _)| pair_name(name, tau_min))
        });
        AgreementTablesSettings {
            reference: "T0".to_owned(),
            sources: consistency
                .sources
                .iter()
                .map(|source| source.name().to_owned())
                .collect(),
            channels: pairs.collect(),
            n_points: consistency.n_points,
            bootstrap: Bootstrap {
                draws: DRAWS,
                seed: consistency.seed,
                least_groups: Bootstrap::LEAST_GROUPS,
            },
        }
    }

    fn write(
        &self,
        out: &Path,
        tables: &AgreementTables,
        rows: &[AgreementRow],
        shapes: &ShapeInputs,
    ) -> Result<()> {
        let lines: String = rows.iter().map(AgreementRow::to_csv).collect();
        let files = [
            ("tessellation.md", tables.to_tessellation_markdown()),
            ("tessellation.csv", tables.to_csv()),
            ("tessellation.json", tables.to_json()),
            ("shapes.csv", AgreementRow::csv_header() + &lines),
            ("refused.csv", tables.refused_csv()),
        ];
        for (name, text) in files {
            write_atomically(&out.join(name), text.as_bytes())?;
        }
        for (number, id) in (1..).zip(least_consistent(rows, N_GRIDS)) {
            let shape = shapes.shapes.iter().find(|shape| shape.id == id);
            let Some(shape) = shape else { continue };
            let image = grid(&self.consistency, &self.tessellated(shape)?, &shape.id)?;
            write_atomically(&out.join(format!("grid-{number}.png")), &image.to_png()?)?;
        }
        stderr::print_line(format_args!("{}: tables and pictures", out.display()));
        Ok(())
    }
}

fn refused_by_all(shape: &str, reason: String) -> RefusedShape {
    RefusedShape {
        source: "all sources".to_owned(),
        shape: shape.to_owned(),
        reason,
    }
}

/// The shapes with the lowest mean mIoU over all their rows. In a tie, the lower id comes first.
fn least_consistent(rows: &[AgreementRow], n_most: usize) -> Vec<String> {
    let mut sums: BTreeMap<&str, (f64, usize)> = BTreeMap::new();
    for row in rows {
        let (sum, n) = sums.entry(&row.shape).or_default();
        *sum += row.agreement.miou;
        *n += 1;
    }
    let mean = |(shape, (sum, n)): (&'_ str, (f64, usize))| (sum / n as f64, shape.to_owned());
    let mut ranked: Vec<(f64, String)> = sums.into_iter().map(mean).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    ranked
        .into_iter()
        .take(n_most)
        .map(|(_, shape)| shape)
        .collect()
}
