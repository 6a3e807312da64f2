//! Exports one mesh per part of a shape: `parts`.

use super::batch::Files;
use super::common_args::CommonArgs;
use super::exporter::ShapeExporter;
use super::mesh_files::{Vertices, labeled_mesh};
use crate::shape_input::ShapeInput;
use anyhow::Result;
use partprobe_carrier::Carrier;
use partprobe_dataset::json_document;
use partprobe_formats::{mesh_to_obj, mesh_to_ply};
use partprobe_render::FaceLabel;
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The format of the mesh of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
enum PartFormat {
    /// Binary PLY.
    Ply,
    /// Wavefront OBJ.
    Obj,
}

/// What `parts` takes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct PartsArgs {
    #[command(flatten)]
    common: CommonArgs,
    /// The format of the meshes.
    #[arg(long = "as", value_enum, default_value_t = PartFormat::Ply)]
    format: PartFormat,
}

impl ShapeExporter for PartsArgs {
    const NAME: &'static str = "parts";
    const EXTENSIONS: &'static [&'static str] = &["ply", "obj", "json"];

    fn common(&self) -> &CommonArgs {
        &self.common
    }

    fn settings(&self) -> Value {
        json!({ "as": self.format })
    }

    /// `<stem>/part_0003.ply` for each label that has triangles, and `<stem>/parts.json`.
    fn files(&self, shape: &ShapeInput, carrier: &Carrier) -> Result<Files> {
        let label = &self.common.label;
        let numbers = label.of_faces(carrier)?;
        let mesh = labeled_mesh(carrier, &numbers, label, Vertices::Welded)?;
        let mut triangles_of: BTreeMap<i32, Vec<usize>> = BTreeMap::new();
        for (triangle, &part) in mesh.part.iter().enumerate() {
            triangles_of.entry(part).or_default().push(triangle);
        }
        let mut files = Vec::new();
        let mut parts = part_entries(carrier, &numbers);
        for part in &mut parts {
            let Some(triangles) = triangles_of.get(&part.label) else {
                continue;
            };
            let patch = mesh.subset(triangles);
            let (extension, bytes) = match self.format {
                PartFormat::Ply => ("ply", mesh_to_ply(&patch)),
                PartFormat::Obj => ("obj", mesh_to_obj(&patch).into_bytes()),
            };
            let name = format!("{}_{:04}.{extension}", label.noun(), part.label);
            files.push((shape.stem.join(&name), bytes));
            (part.file, part.n_triangles) = (Some(name), triangles.len());
        }
        let list = PartList {
            format_version: partprobe_formats::FORMAT_VERSION,
            id: &shape.id,
            label,
            parts,
        };
        files.push((shape.stem.join("parts.json"), json_document(&list)?));
        Ok(files)
    }
}

/// `parts.json`: the description of the meshes of one shape.
#[derive(Serialize)]
struct PartList<'a> {
    format_version: u32,
    id: &'a str,
    label: &'a FaceLabel,
    parts: Vec<PartEntry>,
}

/// One patch of surface.
#[derive(Serialize)]
struct PartEntry {
    label: i32,
    /// `None` if none of its faces has a triangle.
    file: Option<String>,
    faces: Vec<usize>,
    step_ids: Vec<u64>,
    /// The number of its faces by primitive type.
    types: BTreeMap<&'static str, usize>,
    /// The area of the surfaces, in square millimeters.
    area: f64,
    n_triangles: usize,
}

/// The parts of the labels of faces, in the order of the labels. Faces without a label (−1) do not make a part.
fn part_entries(carrier: &Carrier, numbers: &[i32]) -> Vec<PartEntry> {
    let mut faces_of: BTreeMap<i32, Vec<usize>> = BTreeMap::new();
    for (face, &number) in numbers
        .iter()
        .enumerate()
        .filter(|&(_, &number)| number >= 0)
    {
        faces_of.entry(number).or_default().push(face);
    }
    let rows = &carrier.graph().faces;
    let entry = |(label, faces): (i32, Vec<usize>)| {
        let mut types = BTreeMap::new();
        for &face in &faces {
            *types.entry(rows[face].face_type.name()).or_default() += 1;
        }
        let step_ids = faces.iter().map(|&face| rows[face].step_id).collect();
        let area = faces.iter().map(|&face| rows[face].area).sum();
        PartEntry {
            label,
            file: None,
            faces,
            step_ids,
            types,
            area,
            n_triangles: 0,
        }
    };
    faces_of.into_iter().map(entry).collect()
}
