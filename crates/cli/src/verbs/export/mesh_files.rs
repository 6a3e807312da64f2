//! Exports one mesh per shape: `glb`, `ply` and `obj`.

use super::batch::Files;
use super::common_args::CommonArgs;
use super::exporter::ShapeExporter;
use crate::shape_input::ShapeInput;
use anyhow::{Result, ensure};
use partprobe_carrier::{Carrier, ShapeKind};
use partprobe_formats::{
    GlbNodes, LabeledMesh, PlyPoints, carrier_to_glb, colored_points_to_ply, integer_lines,
    mesh_to_obj, mesh_to_ply,
};
use partprobe_render::FaceLabel;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Whether faces share their vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Vertices {
    /// One vertex per position: faces are connected, and a closed solid is watertight.
    Welded,
    /// Each face has its own vertices, with normals (and colors, in PLY).
    Split,
}

/// What `glb` takes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct GlbArgs {
    #[command(flatten)]
    common: CommonArgs,
    /// What becomes a node: each part, below the products of the assembly, or the whole shape.
    #[arg(long, value_enum, default_value_t = Nodes::Parts)]
    nodes: Nodes,
}

/// What becomes a node of a GLB.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Nodes {
    /// Each part of each product occurrence, with its name.
    Parts,
    /// The whole shape as one mesh.
    One,
}

impl From<Nodes> for GlbNodes {
    fn from(nodes: Nodes) -> Self {
        match nodes {
            Nodes::Parts => Self::Parts,
            Nodes::One => Self::One,
        }
    }
}

/// What `ply` takes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct PlyArgs {
    #[command(flatten)]
    common: CommonArgs,
    /// Whether faces share their vertices.
    #[arg(long, value_enum, default_value_t = Vertices::Welded)]
    vertices: Vertices,
}

/// What `obj` takes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct ObjArgs {
    #[command(flatten)]
    common: CommonArgs,
    /// Whether faces share their vertices.
    #[arg(long, value_enum, default_value_t = Vertices::Welded)]
    vertices: Vertices,
}

/// Refuses a cloud, because mesh files have triangles.
fn ensure_surface(carrier: &Carrier) -> Result<()> {
    ensure!(
        carrier.kind() != ShapeKind::Cloud,
        "it is a point cloud without triangles; `partprobe export ply` writes its points"
    );
    Ok(())
}

impl ShapeExporter for GlbArgs {
    const NAME: &'static str = "glb";
    const EXTENSIONS: &'static [&'static str] = &["glb"];

    fn common(&self) -> &CommonArgs {
        &self.common
    }

    fn settings(&self) -> Value {
        json!({ "nodes": self.nodes })
    }

    /// `<stem>.glb`.
    fn files(&self, shape: &ShapeInput, carrier: &Carrier) -> Result<Files> {
        ensure_surface(carrier)?;
        let label = &self.common.label;
        let bytes = carrier_to_glb(
            carrier,
            &label.parts_of_faces(carrier)?,
            &label.colors_of_faces(carrier)?,
            self.nodes.into(),
        )?;
        Ok(vec![(with_suffix(&shape.stem, "glb"), bytes)])
    }
}

impl ShapeExporter for PlyArgs {
    const NAME: &'static str = "ply";
    const EXTENSIONS: &'static [&'static str] = &["ply"];

    fn common(&self) -> &CommonArgs {
        &self.common
    }

    fn settings(&self) -> Value {
        json!({ "vertices": self.vertices })
    }

    /// `<stem>.ply`, a mesh, or the points of a cloud.
    fn files(&self, shape: &ShapeInput, carrier: &Carrier) -> Result<Files> {
        let label = &self.common.label;
        if carrier.kind() == ShapeKind::Cloud {
            let bytes = labeled_cloud(carrier, label)?;
            return Ok(vec![(with_suffix(&shape.stem, "ply"), bytes)]);
        }
        let mesh = labeled_mesh(
            carrier,
            &label.parts_of_faces(carrier)?,
            label,
            self.vertices,
        )?;
        Ok(vec![(with_suffix(&shape.stem, "ply"), mesh_to_ply(&mesh))])
    }
}

impl ShapeExporter for ObjArgs {
    const NAME: &'static str = "obj";
    const EXTENSIONS: &'static [&'static str] = &["obj", "seg", "fidx"];

    fn common(&self) -> &CommonArgs {
        &self.common
    }

    fn settings(&self) -> Value {
        json!({ "vertices": self.vertices })
    }

    /// `<stem>.obj`, `<stem>.seg` with the label of each triangle and `<stem>.fidx` with its source face.
    fn files(&self, shape: &ShapeInput, carrier: &Carrier) -> Result<Files> {
        ensure_surface(carrier)?;
        let label = &self.common.label;
        let mesh = labeled_mesh(carrier, &label.of_faces(carrier)?, label, self.vertices)?;
        Ok(vec![
            (
                with_suffix(&shape.stem, "obj"),
                mesh_to_obj(&mesh).into_bytes(),
            ),
            (
                with_suffix(&shape.stem, "seg"),
                integer_lines(&mesh.part).into_bytes(),
            ),
            (
                with_suffix(&shape.stem, "fidx"),
                integer_lines(&mesh.face).into_bytes(),
            ),
        ])
    }
}

/// The points of a cloud with a number and a color each, as a PLY file.
///
/// # Errors
/// If the carrier does not have the label layer.
fn labeled_cloud(carrier: &Carrier, label: &FaceLabel) -> Result<Vec<u8>> {
    let (mesh, parts, colors) = (
        carrier.mesh(),
        label.parts_of_faces(carrier)?,
        label.colors_of_faces(carrier)?,
    );
    let faces = || mesh.vertex_face.iter().map(|&face| face as usize);
    let points = PlyPoints {
        points: mesh
            .vertices
            .iter()
            .map(|point| point.map(|x| x as f32))
            .collect(),
        normals: mesh.vertex_normal.clone(),
        parts: faces().map(|face| parts[face]).collect(),
    };
    let colors: Vec<[u8; 3]> = faces().map(|face| colors[face]).collect();
    Ok(colored_points_to_ply(&points, &colors))
}

/// The mesh with a number and a color on each triangle.
///
/// # Errors
/// If the carrier does not have the label layer.
pub(super) fn labeled_mesh(
    carrier: &Carrier,
    numbers: &[i32],
    label: &FaceLabel,
    vertices: Vertices,
) -> Result<LabeledMesh> {
    let colors = label.colors_of_faces(carrier)?;
    Ok(match vertices {
        Vertices::Welded => LabeledMesh::welded(carrier, numbers, &colors),
        Vertices::Split => LabeledMesh::split_at_faces(carrier, numbers, &colors),
    })
}

/// A path with an extension after the whole name, because ids may contain dots.
pub(super) fn with_suffix(stem: &Path, extension: &str) -> PathBuf {
    let mut path = stem.as_os_str().to_owned();
    path.push(".");
    path.push(extension);
    path.into()
}
