//! Runs `partprobe inspect`.

use super::given::GivenReport;
use super::report::{InspectReport, Timings};
use crate::config::{self, LabelConfig};
use crate::given_path::ensure_exists;
use crate::interrupt;
use crate::label::{given_carrier, step_text};
use crate::standard_input::{STDIN_NAME, StandardInput, is_standard_input};
use crate::stdout::{print_line, print_tables};
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_verify::{MeasureSettings, MeasuredFile};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Show the content of a STEP file: faces with types, areas and parts, edges with angles, and lost entities. For a mesh or a
/// point cloud, show its size and its labels.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe inspect bracket.step
  partprobe inspect bracket.step --json | jq '.faces[] | select(.part == 0) | .step_id'
  partprobe inspect chair.obj
  unzip -p parts.zip bracket.step | partprobe inspect -

Keys of the JSON object: faces (step_id, type, area in mm², part, shell, solid, name, color), edges (faces: two step ids, phi in
degrees or null, length in mm), n_parts, lost (kind, step_id, reason), units, mesh (triangles, and solids: closed as in the file,
volume of the true surfaces and mesh_volume in mm³, watertight, manifold), timings.
A mesh is watertight if its triangles, welded at equal coordinates, use each edge equally often in both directions. It is manifold
if exactly two triangles meet at each edge.
For a mesh or a cloud, the keys are kind, n_elements (triangles or points), area, bounding_box, labels (label, name in the file,
n_elements, area), n_unlabeled, notes.")]
pub(crate) struct InspectArgs {
    /// The STEP file, mesh or point cloud. `-` is the standard input, whose first bytes give the format.
    file: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    /// Settings to start from: a shipped config or a file.
    #[arg(long, default_value = "base", value_name = "FILE")]
    config: String,
    /// Change one setting, for example label.theta_deg=12.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Reads the file and prints its content.
///
/// # Errors
/// If the file cannot be read, or has no readable face.
pub(crate) fn inspect(args: &InspectArgs) -> Result<()> {
    let label = config::load(&args.config, &args.set)?.config.label;
    if !is_standard_input(&args.file) {
        check_file(&args.file)?;
    }
    interrupt::end_at_once()?;
    if !is_standard_input(&args.file) {
        return inspect_file(args, &args.file, &label)
            .with_context(|| args.file.display().to_string());
    }
    let input = StandardInput::read(STDIN_NAME, label.max_file_mb << 20)?;
    check_file(input.path())?;
    inspect_file(args, input.path(), &label).context("the standard input")
}

/// Refuses kinds of files that `inspect` does not read, before anything is read.
fn check_file(file: &Path) -> Result<()> {
    let name = file.display();
    ensure_exists(file)?;
    ensure!(
        !file.is_dir(),
        UsageError(format!(
            "{name} is a folder, and `inspect` reads one file; `label` reads folders"
        ))
    );
    let is_npz = file.extension().is_some_and(|ending| ending == "npz");
    ensure!(
        !is_npz,
        UsageError(format!(
            "{name} is labeled already, and `inspect` reads STEP files; `render` and `export` read carriers"
        ))
    );
    Ok(())
}

/// Prints the content of one file.
fn inspect_file(args: &InspectArgs, file: &Path, label: &LabelConfig) -> Result<()> {
    if let Some(carrier) = given_carrier(file, label)? {
        let report = GivenReport::new(&carrier);
        return if args.json {
            print_line(serde_json::to_string(&report)?)
        } else {
            print_line(&report)
        };
    }
    let settings = label.measure_settings();
    let text = step_text(file, settings.budget.max_bytes)?;
    let (measured, timings) = measure(&text, &settings)?;
    let report = InspectReport::new(&measured, timings);
    if args.json {
        print_line(serde_json::to_string(&report)?)
    } else {
        print_tables(&report)
    }
}

/// Measures a file, and the times of its two stages.
fn measure(text: &[u8], settings: &MeasureSettings) -> Result<(MeasuredFile, Timings)> {
    let started = Instant::now();
    let brep = partprobe_brep::read(text, &settings.budget)?;
    let read_s = started.elapsed().as_secs_f64();

    let measured = MeasuredFile::from_brep(brep, settings);
    let shape_s = started.elapsed().as_secs_f64() - read_s;
    Ok((measured, Timings { read_s, shape_s }))
}
