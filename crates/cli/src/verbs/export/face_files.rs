//! Exports faces in the order of the file, for networks on B-Reps: `brepnet`.

use super::batch::Files;
use super::common_args::CommonArgs;
use super::exporter::ShapeExporter;
use super::mesh_files::with_suffix;
use crate::shape_input::ShapeInput;
use anyhow::{Result, ensure};
use partprobe_carrier::{Carrier, ShapeKind};
use partprobe_dataset::json_document;
use partprobe_formats::{edges_to_csv, faces_to_csv, integer_lines};
use serde::Serialize;
use serde_json::{Value, json};

/// How the adjacency is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
enum TableFormat {
    /// One JSON document per shape.
    Json,
    /// `.faces.csv` and `.edges.csv`.
    Csv,
}

/// The adjacency as JSON: lists of equal length, which pandas and NumPy can use directly.
#[derive(Serialize)]
struct Adjacency<'a> {
    format_version: u32,
    id: &'a str,
    source_sha256: &'a str,
    theta_deg: f64,
    faces: Faces<'a>,
    edges: Edges,
}

#[derive(Serialize)]
struct Faces<'a> {
    step_id: Vec<u64>,
    r#type: Vec<&'static str>,
    part: &'a [i32],
    area: Vec<f64>,
}

#[derive(Serialize)]
struct Edges {
    /// Indices of the two faces.
    faces: Vec<[u32; 2]>,
    step_ids: Vec<[u64; 2]>,
    /// The angles. An undefined angle is null.
    phi: Vec<Option<f64>>,
    length: Vec<f64>,
}

/// What `brepnet` takes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct BrepnetArgs {
    #[command(flatten)]
    common: CommonArgs,
    /// The format of the adjacency.
    #[arg(long = "as", value_enum, default_value_t = TableFormat::Json)]
    format: TableFormat,
}

impl ShapeExporter for BrepnetArgs {
    const NAME: &'static str = "brepnet";
    const EXTENSIONS: &'static [&'static str] = &["seg", "json", "csv"];

    fn common(&self) -> &CommonArgs {
        &self.common
    }

    fn settings(&self) -> Value {
        json!({ "as": self.format })
    }

    /// `<stem>.seg` with the label of each face, and the adjacency.
    fn files(&self, shape: &ShapeInput, carrier: &Carrier) -> Result<Files> {
        ensure!(
            carrier.kind() == ShapeKind::Brep,
            "it has no B-Rep, and BRepNet reads faces and their edges"
        );
        let label = &self.common.label;
        let parts = label.parts_of_faces(carrier)?;
        let mut files = vec![(
            with_suffix(&shape.stem, "seg"),
            integer_lines(&label.of_faces(carrier)?).into_bytes(),
        )];
        match self.format {
            TableFormat::Json => {
                files.push((
                    with_suffix(&shape.stem, "graph.json"),
                    json_document(&adjacency(shape, carrier, &parts))?,
                ));
            }
            TableFormat::Csv => {
                files.push((
                    with_suffix(&shape.stem, "faces.csv"),
                    faces_to_csv(carrier, &parts).into_bytes(),
                ));
                files.push((
                    with_suffix(&shape.stem, "edges.csv"),
                    edges_to_csv(carrier).into_bytes(),
                ));
            }
        }
        Ok(files)
    }
}

fn adjacency<'a>(shape: &'a ShapeInput, carrier: &'a Carrier, part: &'a [i32]) -> Adjacency<'a> {
    let (rows, edges) = (&carrier.graph().faces, &carrier.graph().edges);
    Adjacency {
        format_version: partprobe_formats::FORMAT_VERSION,
        id: &shape.id,
        source_sha256: &carrier.meta().source_sha256,
        theta_deg: carrier.meta().theta_deg,
        faces: Faces {
            step_id: rows.iter().map(|face| face.step_id).collect(),
            r#type: rows.iter().map(|face| face.face_type.name()).collect(),
            part,
            area: rows.iter().map(|face| face.area).collect(),
        },
        edges: Edges {
            faces: edges.iter().map(|edge| edge.faces).collect(),
            step_ids: edges
                .iter()
                .map(|edge| edge.faces.map(|face| rows[face as usize].step_id))
                .collect(),
            phi: edges
                .iter()
                .map(|edge| Some(edge.phi).filter(|phi| phi.is_finite()))
                .collect(),
            length: edges.iter().map(|edge| edge.length).collect(),
        },
    }
}
