//! `partprobe render`: a picture of labelled parts.

use super::{Image, Picture, draw};
use crate::atomic_write::write_atomically;
use crate::stdout::print_line;
use anyhow::{Context, Result, ensure};
use brep::{ReadBudget, Shape, ShapeOptions};
use carrier::Partition;
use std::fs;
use std::path::{Path, PathBuf};

/// Draw STEP files to a PNG, off-screen, with lines between parts.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe render bracket.step flange.step -o parts.png")]
pub struct RenderArgs {
    /// STEP files; several make a contact sheet.
    #[arg(required = true)]
    paths: Vec<PathBuf>,
    /// The PNG to write.
    #[arg(short, long, value_name = "PNG")]
    output: PathBuf,
    /// What gives a triangle its colour.
    #[arg(long, value_enum, default_value_t = ColorBy::Part)]
    color: ColorBy,
    /// Pictures in a row of a contact sheet; about as many as there are rows if not given.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=256))]
    columns: Option<u16>,
    /// Side of each picture, in pixels.
    #[arg(long, default_value_t = 480, value_parser = clap::value_parser!(u32).range(16..=4096))]
    size: u32,
    /// Dihedral threshold of the parts, in degrees.
    #[arg(long, default_value_t = 8.0)]
    theta: f64,
}

/// What gives a triangle its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum ColorBy {
    /// The source face.
    Face,
    /// The primitive type of the face.
    Type,
    /// The part.
    Part,
}

/// Draws the files.
///
/// # Errors
/// If a file has no face that can be drawn, or the picture cannot be written.
pub fn render(args: &RenderArgs) -> Result<()> {
    ensure!((0.0..=180.0).contains(&args.theta), "--theta must lie in 0..=180");
    let images = args
        .paths
        .iter()
        .map(|path| picture_of(path, args).with_context(|| path.display().to_string()))
        .collect::<Result<Vec<Image>>>()?;
    let columns = args.columns.map_or_else(|| (images.len() as f64).sqrt().ceil() as usize, usize::from);
    write_atomically(&args.output, &Image::sheet(&images, columns).to_png()?)?;
    print_line(format_args!("{}: {} files drawn", args.output.display(), args.paths.len()))
}

fn picture_of(path: &Path, args: &RenderArgs) -> Result<Image> {
    let text = fs::read(path)?;
    let brep = brep::read(&text, &ReadBudget::default())?;
    let options = ShapeOptions { chord_fraction: 0.0005, angle_rad: 0.1, ..ShapeOptions::default() };
    let shape = brep::shape(&brep, &options);
    ensure!(!shape.mesh.triangles.is_empty(), "no face could be triangulated");
    let groups = groups_of_faces(&shape, args);
    let groups: Vec<i32> = shape.mesh.tri_face.iter().map(|&face| groups[face as usize]).collect();
    Ok(draw(&Picture { mesh: &shape.mesh, groups: &groups, size: args.size as usize }))
}

fn groups_of_faces(shape: &Shape, args: &RenderArgs) -> Vec<i32> {
    let faces = &shape.graph.faces;
    match args.color {
        ColorBy::Face => (0..).take(faces.len()).collect(),
        ColorBy::Type => faces.iter().map(|face| i32::from(face.face_type.code())).collect(),
        ColorBy::Part => {
            let partition = Partition::by_type_and_angle(&shape.graph, args.theta);
            partition.parts().iter().map(|&part| part as i32).collect()
        }
    }
}
