//! Defines the arguments of `render`, and draws the shapes that they choose.

use super::page::{Cell, PictureFormat, sheet};
use crate::counted::counted;
use crate::damaged_carriers::{is_damaged_carrier, refuse_damaged_carriers};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::shape_input::{ShapeArgs, ShapeInput};
use crate::stderr;
use crate::stdout::print_line;
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_carrier::{Carrier, CarrierMeta};
use partprobe_dataset::write_atomically;
use partprobe_render::{Background, FaceLabel, PictureStyle, UpAxis, Viewpoint};
use partprobe_sources::StepParts;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The largest number of pixels of a sheet.
const MAX_PIXELS: usize = 1 << 28;

/// Draw shapes to a PNG, SVG or PDF file, off-screen, with lines between parts.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe render bracket.step -o parts.png
  partprobe render parts/ -o stages.png --stages --most-parts 4      faces, types and parts side by side
  partprobe render dataset/ -o sheet.png --most-parts 20 --size 240  a contact sheet with names
  partprobe render bracket.step -o figure.png --legend --background transparent
  partprobe render bracket.step -o figure.pdf --legend               vector graphics, sharp at any size
  partprobe render bracket.step -o top.png --camera top --color cad  the colors of the CAD file
  partprobe render bracket.step -o side.png --camera 30,20           azimuth and elevation in degrees
  partprobe render bracket.step -o fine.png --set label.angle_rad=0.05 --set label.chord_fraction=0.0002

Pictures show the carrier itself, so STEP files are drawn with the tessellation that `label` gives them.")]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    shapes: ShapeArgs,
    /// The picture to write: pixels (.png), or vector graphics without hidden areas and lines (.svg, .pdf).
    #[arg(long, short = 'o', alias = "output", value_name = "FILE")]
    out: PathBuf,
    /// What gives a face its color: part, raw-part (before small parts were absorbed), type, face, cad (the colors of the STEP
    /// file), or the name of a label layer that the carriers store.
    #[arg(long, visible_alias = "label", value_name = "LABEL", default_value_t = FaceLabel::Part)]
    color: FaceLabel,
    /// Draw faces, types and parts of each shape side by side.
    #[arg(long, conflicts_with = "color")]
    stages: bool,
    /// Draw only the N shapes with the most parts.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    most_parts: Option<u32>,
    /// The number of pictures per row of a contact sheet; about the number of rows if not given.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=256))]
    columns: Option<u16>,
    /// The side of each picture, in pixels (in points in a PDF).
    #[arg(long, default_value_t = 480, value_parser = clap::value_parser!(u32).range(16..=4096))]
    size: u32,
    /// The position of the camera: best (the corner that shows most parts), corner (always the upper front right), front, back,
    /// left, right, top, bottom, iso, two angles such as 30,20 (azimuth from the front to the right, and elevation, in degrees),
    /// or a direction from the shape such as 1,-1,0.5.
    #[arg(long, alias = "view", value_name = "VIEW", default_value_t = Viewpoint::Best, allow_hyphen_values = true)]
    camera: Viewpoint,
    /// The axis that points up: x, y, z, -x, -y, -z, or a direction such as 0,1,0.2.
    #[arg(long, value_name = "AXIS", default_value_t = UpAxis::default(), allow_hyphen_values = true)]
    up: UpAxis,
    /// What is behind the shapes: white, transparent, or a color such as #f0f0f0.
    #[arg(long, value_name = "COLOR", default_value_t = Background::White)]
    background: Background,
    /// Add a legend to each picture: for each color the label, its number of faces, and its fraction of the area.
    #[arg(long)]
    legend: bool,
    /// Compute the parts again with this dihedral threshold, in degrees.
    #[arg(long, value_name = "DEGREES")]
    theta: Option<f64>,
}

/// Draws the shapes.
///
/// # Errors
/// If no shape can be drawn, a carrier is not the one that was labeled, or the picture cannot be written.
pub(crate) fn render(args: &RenderArgs) -> Result<()> {
    if let Some(theta) = args.theta {
        ensure!(
            (0.0..=180.0).contains(&theta),
            UsageError("--theta must be from 0 to 180".to_owned())
        );
    }
    let format = output_format(&args.out)?;
    let interrupt = Interrupt::listen()?;
    args.shapes.check()?;
    let scratch = std::env::temp_dir().join(format!("partprobe-render-{}", std::process::id()));
    let sources = args
        .shapes
        .with_settings(["label.attributes=[\"normal\"]".to_owned()])
        .open(&scratch, &interrupt)?;
    let mut warnings: Vec<String> = sources
        .failed
        .iter()
        .map(|failed| format!("{}: {}", failed.id, failed.reason))
        .collect();
    let chosen = match args.most_parts {
        Some(most) => with_most_parts(&sources.shapes, most as usize, &args.color),
        None => sources.shapes.iter().collect(),
    };
    let cells = drawn(args, format, &chosen, &interrupt)?;
    let (mut pictures, mut n_damaged) = (Vec::new(), 0);
    for (shape, cell) in chosen.iter().zip(cells) {
        match cell {
            Ok(picture) => pictures.push(picture),
            Err(error) => {
                n_damaged += usize::from(is_damaged_carrier(&error));
                warnings.push(format!("{}: {error:#}", shape.id));
            }
        }
    }
    warnings
        .iter()
        .for_each(|warning| stderr::print_line(format_args!("warning: {warning}")));
    let n_drawn = pictures.len();
    ensure!(n_drawn > 0, "no shape could be drawn");
    let bytes = sheet(pictures, columns(args, n_drawn), format)?;
    write_atomically(&args.out, &bytes)?;
    let drawn = counted(n_drawn, "shape", "shapes");
    print_line(format_args!(
        "{}: {drawn} drawn, {} failed",
        args.out.display(),
        warnings.len()
    ))?;
    refuse_damaged_carriers(n_damaged)
}

/// The format by the name of the picture. If a file with this name cannot be written, it is refused before anything is drawn.
fn output_format(output: &Path) -> Result<PictureFormat> {
    let name = output.display();
    let format = PictureFormat::of_path(output).ok_or_else(|| {
        UsageError(format!(
            "{name}: pictures are written as PNG, SVG or PDF; give a name that ends in .png, .svg or .pdf"
        ))
    })?;
    ensure!(
        !output.is_dir(),
        UsageError(format!("{name} is a folder; give the name of a file"))
    );
    let folder = output
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    ensure!(
        folder.is_none_or(Path::is_dir),
        UsageError(format!("{name}: its folder does not exist; make it first"))
    );
    Ok(format)
}

/// The shapes with the most parts, beginning with the largest number. In a tie, the lower id comes first.
fn with_most_parts<'a>(
    shapes: &'a [ShapeInput],
    most: usize,
    label: &FaceLabel,
) -> Vec<&'a ShapeInput> {
    let count = |shape: &ShapeInput| {
        let read = || {
            shape
                .carrier()
                .map_or(0, |carrier| n_drawn_parts(&carrier, label))
        };
        match label {
            // The index has these numbers.
            FaceLabel::Part => shape.n_labels.unwrap_or_else(read),
            _ => read(),
        }
    };
    let mut ranked: Vec<(usize, &ShapeInput)> = shapes
        .par_iter()
        .map(|shape| (count(shape), shape))
        .collect();
    ranked.sort_by(|(a, first), (b, second)| b.cmp(a).then_with(|| first.id.cmp(&second.id)));
    ranked
        .into_iter()
        .take(most)
        .map(|(_, shape)| shape)
        .collect()
}

/// The number of pictures in a row. A picture with stages already has three.
fn columns(args: &RenderArgs, n_images: usize) -> usize {
    let square = if args.stages {
        1
    } else {
        (n_images as f64).sqrt().ceil() as usize
    };
    args.columns.map_or(square, usize::from)
}

/// The cell of each shape. Shapes are named if there are several.
fn drawn(
    args: &RenderArgs,
    format: PictureFormat,
    shapes: &[&ShapeInput],
    interrupt: &Interrupt,
) -> Result<Vec<Result<Cell>>> {
    let n_pictures = shapes.len() * if args.stages { 3 } else { 1 };
    let n_pixels = n_pictures
        .saturating_mul(args.size as usize)
        .saturating_mul(args.size as usize);
    ensure!(
        n_pixels <= MAX_PIXELS || !format.has_pixels(),
        UsageError(format!(
            "{n_pictures} pictures are too large for one sheet; choose a smaller --size, or --most-parts"
        ))
    );
    let style = PictureStyle {
        label: args.color.clone(),
        size: args.size as usize,
        viewpoint: args.camera,
        up: args.up,
        background: args.background,
        legend: args.legend,
    };
    let bar = Progress::on_terminal().bar("draw", shapes.len());
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.shapes.n_threads())
        .build()
        .context("starting threads")?;
    let one = |shape: &&ShapeInput| {
        ensure!(!interrupt.is_set(), "stopped");
        let carrier = at_theta(shape.carrier()?, args.theta)?;
        ensure!(
            !carrier.mesh().triangles.is_empty(),
            "no face has a triangle"
        );
        let cell = Cell::of(&carrier, &style, args.stages, format)?;
        bar.inc(1);
        Ok(if shapes.len() > 1 {
            cell.with_caption(&shape.id, &note(&carrier, args), style.text_scale())
        } else {
            cell
        })
    };
    let cells = pool.install(|| shapes.par_iter().map(one).collect());
    bar.finish_and_clear();
    ensure!(!interrupt.is_set(), "stopped; nothing was written");
    Ok(cells)
}

/// The text after the name. It is empty for stages, because they already have their counts.
fn note(carrier: &Carrier, args: &RenderArgs) -> String {
    if args.stages {
        String::new()
    } else {
        let [one, several] = match args.color {
            FaceLabel::Layer(_) => ["label", "labels"],
            _ => ["part", "parts"],
        };
        let n_parts = n_drawn_parts(carrier, &args.color);
        format!(": {}", counted(n_parts, one, several))
    }
}

/// The number of parts that the drawn label distinguishes. Types, faces and colors are shown for the parts of the part rule.
fn n_drawn_parts(carrier: &Carrier, label: &FaceLabel) -> usize {
    let of_faces = label.parts_of_faces(carrier).unwrap_or_default();
    let parts: BTreeSet<i32> = of_faces.into_iter().filter(|&part| part >= 0).collect();
    parts.len()
}

/// The carrier, with new parts if another θ is requested.
fn at_theta(carrier: Carrier, theta: Option<f64>) -> Result<Carrier> {
    let Some(theta_deg) = theta else {
        return Ok(carrier);
    };
    let meta = CarrierMeta {
        theta_deg,
        ..carrier.meta().clone()
    };
    let (mesh, graph) = (carrier.mesh().clone(), carrier.graph().clone());
    let rule = StepParts {
        theta_deg,
        tau_min: meta.tau_min,
    };
    let layers = rule.layers(&mesh, &graph);
    Ok(Carrier::new(mesh, graph, layers, meta)?)
}
