//! Defines the arguments of `sample`, and its loop over shapes.

use super::true_surface::{SurfaceRequest, SurfaceResult, project_points};
use crate::config::{self, Attribute, Config, NormalConfig};
use crate::counted::counted;
use crate::damaged_carriers::{is_damaged_carrier, refuse_damaged_carriers};
use crate::interrupt::Interrupt;
use crate::label::{
    InputFile, InputList, input_files, visit_carriers, warn_of_repeated, warn_of_unread,
};
use crate::label_sources::sources_named;
use crate::output_folder::{is_output_error, remove_if_there};
use crate::own_output::OwnOutput;
use crate::points::{DEFAULT_SOURCES, default_sources, labeled_points};
use crate::progress::Progress;
use crate::standard_input::{STDIN_NAME, with_standard_input};
use crate::stderr;
use crate::stdout::print_line;
use crate::usage::{UsageError, as_usage_error};
use anyhow::{Context, Result, bail, ensure};
use partprobe_brep::Brep;
use partprobe_carrier::{Carrier, GIVEN, SurfaceAttributes};
use partprobe_dataset::{
    Dataset, INDEX_FILE, IndexEntry, SETTINGS_FILE, json_document, write_atomically,
};
use partprobe_formats::{
    Compression, PlyPoints, SampleLabels, colored_points_to_ply, sample_with_attributes_to_npz,
};
use partprobe_label::Kernel;
use partprobe_render::colors_of_labels;
use partprobe_sources::BoxedSource;
use rayon::prelude::*;
use serde_json::json;
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Draw points with normals and labels from each shape, uniformly by area.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe sample dataset/ --out points/ --format npz
  partprobe sample dataset/ --out clouds/ --format ply --n-points 5000 --normals analytic
  partprobe sample parts/ --out points/ --format npz --project --attributes uv,curvature
  cat part.step | partprobe sample - --out points/ --format npz
  partprobe sample robot.step --out points/ --format npz --instances --project

DATA is a labeled data set, or STEP files, folders or lists, which are labeled first, with the config's [label].
Archives are not read here: label them first, and sample the data set.
NPZ: points f32 (N,3), normals f32 (N,3), triangles u32 (N), and label_<source> i32 (N) for each --source; on request uv f64
(N,2), curvature f32 (N,2), direction f32 (N,2,3). PLY: x y z nx ny nz, red green blue, and int part with the labels of the first
--source. Analytic normals are interpolated between those of the vertices; they need carriers that were labeled with --attributes
normal. --project and --attributes need the true surfaces, which only STEP files contain.")]
pub(crate) struct SampleArgs {
    /// A data set, or STEP files, folders, or text files that list paths; `-` is the standard input.
    #[arg(required = true, value_name = "DATA")]
    data: Vec<PathBuf>,
    /// The folder to write.
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
    /// Replace the output of an earlier call.
    #[arg(long)]
    force: bool,
    /// The format of the samples.
    #[arg(long, value_enum)]
    format: SampleFormat,
    /// The number of points per shape; the config's sample.n_points if not given.
    #[arg(long, visible_alias = "points", value_name = "N")]
    n_points: Option<usize>,
    /// The normals of the points; the config's sample.normals if not given.
    #[arg(long, value_enum)]
    normals: Option<NormalConfig>,
    /// Move each point to its face's true surface, and give it that surface's normal.
    #[arg(long)]
    project: bool,
    /// The properties of the true surface to compute at each point.
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',')]
    attributes: Vec<Attribute>,
    /// Place every occurrence of every product of a STEP file; if not given, each product is used once.
    #[arg(long)]
    instances: bool,
    /// The seed; the config's sample.seed if not given.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The number of threads; one per core if not given. The samples do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Label sources. A PLY file contains the labels of the first one.
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
    /// One NumPy archive per shape.
    Npz,
    /// One binary point cloud per shape.
    Ply,
}

/// The name of the file with the settings of the samples.
const SETTINGS: &str = "sample.json";

/// The files of the verb.
const OUTPUT: OwnOutput = OwnOutput {
    verb: "sample",
    marker: Some(SETTINGS),
    is_own: |name| name == SETTINGS || name.ends_with(".npz") || name.ends_with(".ply"),
};

/// The largest number of shapes that are named because they cannot be sampled. Further ones are only counted.
const MAX_WARNINGS: usize = 10;

/// Samples every shape. The files depend only on the data, the settings and the seed.
///
/// # Errors
/// If the data are damaged, a source is unknown, true surfaces of a data set are requested, no shape could be sampled, a carrier
/// of the data set is damaged, or a file cannot be written.
pub(crate) fn sample(args: &SampleArgs) -> Result<()> {
    let requested = SurfaceRequest {
        project: args.project,
        attributes: args.attributes.clone(),
    };
    let config = settings(args, &requested)?;
    let sampler = Sampler {
        args,
        sources: sources_named(&config, &args.sources).map_err(as_usage_error)?,
        given: sources_named(&config, &[GIVEN.to_owned()])?,
        config,
        requested,
    };
    sampler.check_requested()?;
    match args.data.as_slice() {
        [folder] if is_dataset(folder) => sampler.sample_dataset(folder),
        paths => sampler.sample_step_files(paths),
    }
}

/// A folder that `label` wrote, finished or not.
fn is_dataset(path: &Path) -> bool {
    path.join(INDEX_FILE).exists() || path.join(SETTINGS_FILE).exists()
}

fn settings(args: &SampleArgs, requested: &SurfaceRequest) -> Result<Config> {
    let mut overrides = args.set.clone();
    overrides.extend(
        args.n_points
            .map(|n_points| format!("sample.n_points={n_points}")),
    );
    overrides.extend(args.seed.map(|seed| format!("sample.seed={seed}")));
    overrides.extend(args.normals.map(|normals| match normals {
        NormalConfig::Triangle => "sample.normals=triangle".to_owned(),
        NormalConfig::Analytic => "sample.normals=analytic".to_owned(),
    }));
    overrides.extend(args.instances.then(|| "label.instances=true".to_owned()));
    let mut config = config::load(&args.config, &overrides)?.config;
    if !requested.is_nothing() {
        // The search for the parameters of a point begins at those of the vertices.
        config.label.attributes.push(Attribute::Uv);
    }
    if config.sample.normals == NormalConfig::Analytic {
        config.label.attributes.push(Attribute::Normal);
    }
    Ok(config)
}

/// The settings of one call.
struct Sampler<'a> {
    args: &'a SampleArgs,
    config: Config,
    sources: Vec<BoxedSource>,
    /// The given labels, for shapes without a B-Rep.
    given: Vec<BoxedSource>,
    requested: SurfaceRequest,
}

impl Sampler<'_> {
    fn check_requested(&self) -> Result<()> {
        let beyond_ply = self
            .requested
            .attributes
            .iter()
            .any(|&attribute| attribute != Attribute::Normal);
        ensure!(
            self.args.format == SampleFormat::Npz || !beyond_ply,
            UsageError(
                "PLY samples have no place for uv and curvature; choose --format npz".to_owned()
            )
        );
        ensure!(
            self.requested.is_nothing() || self.config.label.kernel == Kernel::Own,
            UsageError(
                "--project and --attributes need partprobe's own kernel: label.kernel=own"
                    .to_owned()
            )
        );
        Ok(())
    }

    fn sample_dataset(&self, folder: &Path) -> Result<()> {
        ensure!(
            !self.args.instances,
            UsageError(
                "a data set has the occurrences that it was labeled with: label it with --instances".to_owned()
            )
        );
        ensure!(
            self.requested.is_nothing(),
            UsageError(
                "a data set holds no surfaces: give the STEP files themselves to --project and --attributes, \
                 or take --normals analytic"
                    .to_owned()
            )
        );
        let dataset = Dataset::open(folder)?;
        let sample_entry = |entry: &&IndexEntry| {
            let carrier = dataset.carrier(entry)?;
            self.write_sample(&entry.id, &carrier, None)
                .map(|_| 1)
                .with_context(|| entry.id.clone())
        };
        self.sample_all(&dataset.labeled(), sample_entry, &AtomicUsize::new(0))
    }

    fn sample_step_files(&self, paths: &[PathBuf]) -> Result<()> {
        let max_bytes = self.config.label.max_file_mb << 20;
        // The file of the standard input exists as long as the second value.
        let (paths, _standard_input) = with_standard_input(paths, STDIN_NAME, max_bytes)?;
        let InputList {
            files,
            unread,
            repeated,
        } = input_files(&paths, &[])?.not_empty()?;
        warn_of_unread(unread.iter());
        warn_of_repeated(&repeated);
        let n_unprojected = AtomicUsize::new(0);
        let sample_file = |file: &InputFile| {
            let written = RefCell::new(Vec::new());
            let visit = |carrier: &Carrier, brep: &Brep| {
                written.borrow_mut().push(self.write_sample(
                    &carrier.meta().id,
                    carrier,
                    Some(brep),
                ));
            };
            visit_carriers(file, &self.config.label, &visit).with_context(|| file.name.clone())?;
            let counts = written
                .into_inner()
                .into_iter()
                .collect::<Result<Vec<usize>>>();
            let counts = counts.with_context(|| file.name.clone())?;
            n_unprojected.fetch_add(counts.iter().sum(), Ordering::Relaxed);
            Ok(counts.len())
        };
        self.sample_all(&files, sample_file, &n_unprojected)
    }

    /// Processes files or entries in parallel. Each gives the number of its shapes.
    fn sample_all<T: Sync>(
        &self,
        items: &[T],
        sample_item: impl Fn(&T) -> Result<usize> + Sync,
        n_unprojected: &AtomicUsize,
    ) -> Result<()> {
        let out = &self.args.out;
        let _lock = OUTPUT.take(out, "sampling into", self.args.force, &self.args.data)?;
        self.write_settings()?;
        let bar = Progress::on_terminal().bar("sample", items.len());
        // A file that cannot be written ends the work at once. A shape that cannot be sampled does not.
        let interrupt = Interrupt::listen()?;
        let sampled = |item: &T| {
            ensure!(!interrupt.is_set(), "stopped");
            let written = sample_item(item);
            bar.inc(1);
            match written {
                Err(error) if is_output_error(&error) => Err(error),
                written => Ok(written),
            }
        };
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.args.jobs.map_or(0, usize::from))
            .build()
            .context("starting threads")?;
        let written: Result<Vec<Result<usize>>> =
            pool.install(|| items.par_iter().map(sampled).collect());
        bar.finish_and_clear();
        let incomplete = || {
            format!(
                "{} is not complete; choose another --out, or sample again with --force",
                out.display()
            )
        };
        let written = written.with_context(incomplete)?;
        let n_written: usize = written.iter().flatten().sum();
        let failures: Vec<_> = written.into_iter().filter_map(Result::err).collect();
        failures
            .iter()
            .take(MAX_WARNINGS)
            .for_each(|error| stderr::print_line(format_args!("warning: {error:#}")));
        if failures.len() > MAX_WARNINGS {
            stderr::print_line(format_args!(
                "warning: and {} more",
                failures.len() - MAX_WARNINGS
            ));
        }
        let (n_shapes, n_points) = (n_written + failures.len(), self.config.sample.n_points);
        print_line(format_args!(
            "{}: {n_written} of {} sampled, {} each",
            out.display(),
            counted(n_shapes, "shape", "shapes"),
            counted(n_points, "point", "points")
        ))?;
        let n_unprojected = n_unprojected.load(Ordering::Relaxed);
        if n_unprojected > 0 {
            let points = counted(n_unprojected, "point has", "points have");
            print_line(format_args!(
                "{points} no surface nearby, so their places on the triangles were kept"
            ))?;
        }
        if n_written == 0 {
            remove_if_there(&out.join(SETTINGS))?;
            bail!("no shape could be sampled");
        }
        refuse_damaged_carriers(
            failures
                .iter()
                .filter(|error| is_damaged_carrier(error))
                .count(),
        )
    }

    /// Writes the settings of the samples, which also mark the folder as one of this verb.
    fn write_settings(&self) -> Result<()> {
        let settings = json!({
            "format_version": partprobe_formats::FORMAT_VERSION,
            "program_version": env!("CARGO_PKG_VERSION"),
            "sample": self.config.sample,
            "project": self.args.project,
            "attributes": self.requested.attributes,
            "sources": self.args.sources,
        });
        write_atomically(&self.args.out.join(SETTINGS), &json_document(&settings)?)?;
        Ok(())
    }

    /// The sources of a shape. Without `--source`, a shape without a B-Rep has its given labels.
    fn sources_of(&self, carrier: &Carrier) -> &[BoxedSource] {
        match default_sources(carrier) {
            names if names == DEFAULT_SOURCES => &self.sources,
            _ if self.args.sources != DEFAULT_SOURCES => &self.sources,
            names => &self.given[..names.len()],
        }
    }

    /// Draws and writes the points of one shape. Returns the number of points without a near surface.
    fn write_sample(&self, id: &str, carrier: &Carrier, brep: Option<&Brep>) -> Result<usize> {
        let sources = self.sources_of(carrier);
        let (mut sample, labels) = labeled_points(carrier, &self.config.sample, sources)?;
        let mut projected = SurfaceResult {
            attributes: SurfaceAttributes::default(),
            n_unprojected: 0,
        };
        if let Some(brep) = brep.filter(|_| !self.requested.is_nothing()) {
            projected = project_points(&mut sample, carrier, brep, &self.requested);
        }
        let (bytes, extension) = match self.args.format {
            SampleFormat::Npz => {
                let names = sources.iter().map(|source| source.name().to_owned());
                let labels: SampleLabels = names.zip(labels).collect();
                (
                    sample_with_attributes_to_npz(
                        &sample,
                        &projected.attributes,
                        &labels,
                        Compression::Stored,
                    )?,
                    "npz",
                )
            }
            SampleFormat::Ply => {
                let parts = labels.into_iter().next().unwrap_or_default();
                let colors = colors_of_points(&parts, &sample.triangles, carrier);
                (
                    colored_points_to_ply(
                        &PlyPoints {
                            points: sample.points,
                            normals: sample.normals,
                            parts,
                        },
                        &colors,
                    ),
                    "ply",
                )
            }
        };
        write_atomically(&self.args.out.join(format!("{id}.{extension}")), &bytes)?;
        Ok(projected.n_unprojected)
    }
}

/// One color per point, such that the labels of faces that touch have different colors.
fn colors_of_points(labels: &[i32], triangles: &[u32], carrier: &Carrier) -> Vec<[u8; 3]> {
    let tri_face = &carrier.mesh().tri_face;
    let mut point_of_face: Vec<Option<u32>> = vec![None; carrier.graph().faces.len()];
    for (point, &triangle) in (0..).zip(triangles) {
        point_of_face[tri_face[triangle as usize] as usize].get_or_insert(point);
    }
    let edges = carrier.graph().edges.iter();
    let pairs = edges.filter_map(|edge| {
        let [a, b] = edge.faces.map(|face| point_of_face[face as usize]);
        Some([a?, b?])
    });
    colors_of_labels(labels, pairs)
}
