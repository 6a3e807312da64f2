//! Meshes: `glb`, `ply`, `obj` and `parts`.

use super::batch::Files;
use crate::face_label::FaceLabel;
use crate::json_lines::json_document;
use crate::shape_source::ShapeSource;
use anyhow::Result;
use carrier::Carrier;
use formats::{LabelledMesh, carrier_to_glb, integer_lines, mesh_to_obj, mesh_to_ply};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Whether faces share their vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Vertices {
    /// One vertex at each position: faces are connected, a closed solid is watertight.
    Welded,
    /// Each face has its own vertices, with normals (and colours, in PLY).
    Split,
}

/// The format of the mesh of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum PartFormat {
    /// Binary PLY.
    Ply,
    /// Wavefront OBJ.
    Obj,
}

/// `<stem>.glb`.
pub(super) fn glb_files(shape: &ShapeSource, carrier: &Carrier, label: FaceLabel) -> Result<Files> {
    let bytes = carrier_to_glb(carrier, &label.parts_of_faces(carrier), &label.colors_of_faces(carrier))?;
    Ok(vec![(with_suffix(&shape.stem, "glb"), bytes)])
}

/// `<stem>.ply`.
pub(super) fn ply_files(shape: &ShapeSource, carrier: &Carrier, label: FaceLabel, vertices: Vertices) -> Result<Files> {
    let mesh = labelled_mesh(carrier, &label.parts_of_faces(carrier), label, vertices);
    Ok(vec![(with_suffix(&shape.stem, "ply"), mesh_to_ply(&mesh))])
}

/// `<stem>.obj`, `<stem>.seg` with the label of each triangle and `<stem>.fidx` with its source face.
pub(super) fn obj_files(shape: &ShapeSource, carrier: &Carrier, label: FaceLabel, vertices: Vertices) -> Result<Files> {
    let mesh = labelled_mesh(carrier, &label.of_faces(carrier), label, vertices);
    Ok(vec![
        (with_suffix(&shape.stem, "obj"), mesh_to_obj(&mesh).into_bytes()),
        (with_suffix(&shape.stem, "seg"), integer_lines(&mesh.part).into_bytes()),
        (with_suffix(&shape.stem, "fidx"), integer_lines(&mesh.face).into_bytes()),
    ])
}

fn labelled_mesh(carrier: &Carrier, numbers: &[i32], label: FaceLabel, vertices: Vertices) -> LabelledMesh {
    let colors = label.colors_of_faces(carrier);
    match vertices {
        Vertices::Welded => LabelledMesh::welded(carrier, numbers, &colors),
        Vertices::Split => LabelledMesh::split_at_faces(carrier, numbers, &colors),
    }
}

/// A path with an extension behind the whole name: ids may hold points.
pub(super) fn with_suffix(stem: &Path, extension: &str) -> PathBuf {
    let mut path = stem.as_os_str().to_owned();
    path.push(".");
    path.push(extension);
    path.into()
}

/// `parts.json`: what the meshes of one shape are.
#[derive(Serialize)]
struct PartList<'a> {
    format_version: u32,
    id: &'a str,
    label: FaceLabel,
    parts: Vec<PartEntry>,
}

/// One patch of surface.
#[derive(Serialize)]
struct PartEntry {
    label: i32,
    /// None where none of its faces has a triangle.
    file: Option<String>,
    faces: Vec<usize>,
    step_ids: Vec<u64>,
    /// How many of its faces have each primitive type.
    types: BTreeMap<&'static str, usize>,
    /// Of the surfaces, in square millimetres.
    area: f64,
    n_triangles: usize,
}

/// `<stem>/part_0003.ply` for each label that has triangles, and `<stem>/parts.json`.
pub(super) fn part_files(
    shape: &ShapeSource,
    carrier: &Carrier,
    label: FaceLabel,
    format: PartFormat,
) -> Result<Files> {
    let numbers = label.of_faces(carrier);
    let mesh = labelled_mesh(carrier, &numbers, label, Vertices::Welded);
    let mut triangles_of: BTreeMap<i32, Vec<usize>> = BTreeMap::new();
    for (triangle, &part) in mesh.part.iter().enumerate() {
        triangles_of.entry(part).or_default().push(triangle);
    }
    let mut files = Vec::new();
    let mut parts = part_entries(carrier, &numbers);
    for part in &mut parts {
        let Some(triangles) = triangles_of.get(&part.label) else { continue };
        let patch = mesh.subset(triangles);
        let (extension, bytes) = match format {
            PartFormat::Ply => ("ply", mesh_to_ply(&patch)),
            PartFormat::Obj => ("obj", mesh_to_obj(&patch).into_bytes()),
        };
        let name = format!("{}_{:04}.{extension}", label.noun(), part.label);
        files.push((shape.stem.join(&name), bytes));
        (part.file, part.n_triangles) = (Some(name), triangles.len());
    }
    let list = PartList { format_version: formats::FORMAT_VERSION, id: &shape.id, label, parts };
    files.push((shape.stem.join("parts.json"), json_document(&list)?));
    Ok(files)
}

/// The labels that faces have, in order; faces without one (−1) are no part.
fn part_entries(carrier: &Carrier, numbers: &[i32]) -> Vec<PartEntry> {
    let mut faces_of: BTreeMap<i32, Vec<usize>> = BTreeMap::new();
    for (face, &number) in numbers.iter().enumerate().filter(|&(_, &number)| number >= 0) {
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
        PartEntry { label, file: None, faces, step_ids, types, area, n_triangles: 0 }
    };
    faces_of.into_iter().map(entry).collect()
}
