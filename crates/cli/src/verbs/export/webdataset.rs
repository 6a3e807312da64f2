//! Writes tar files of samples for WebDataset: `partprobe export webdataset`.
//!
//! A sample is `<key>.npz` and `<key>.json`. A key is the id of the shape without dots, because WebDataset cuts names at the
//! first dot. The bytes of a file depend only on the shapes: samples are sorted by key, and the times of all members are 0.

use super::common_args::FolderArgs;
use super::exporter::Exporter;
use super::outputs::Outputs;
use super::session::ExportSession;
use super::shape_facts::origin_of;
use super::shape_line::ShapeLine;
use crate::config::{NormalConfig, SampleConfig};
use crate::points::{default_sources, sample_npz};
use crate::shape_input::ShapeInput;
use anyhow::Result;
use partprobe_carrier::Carrier;
use partprobe_dataset::{OutputError, json_document, write_atomically_with};
use partprobe_formats::{Compression, WebdatasetWriter, labels_to_npz, webdataset_keys};
use serde::Serialize;
use serde_json::json;
use std::io;

/// What the NPZ file of a sample holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Content {
    /// The unchanged file of the carrier: mesh, faces, edges and labels.
    Carrier,
    /// Faces, edges and labels without the mesh.
    Labels,
    /// Sampled points with normals and labels.
    Points,
}

/// What `webdataset` takes.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe export webdataset dataset/ --out wds/
  partprobe export webdataset dataset/ --out wds/ --content points --points 20000 --shard-size 500

DIR/shapes-000000.tar and so on contain <key>.npz and <key>.json for each shape. The JSON says which shape it is and how it was
labeled. A key is the id of the shape with `_` in place of each dot.")]
pub(crate) struct WebdatasetArgs {
    #[command(flatten)]
    folder: FolderArgs,
    /// The most shapes in one tar file.
    #[arg(long, default_value_t = 1000, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    shard_size: u32,
    /// The content of the NPZ file of a shape.
    #[arg(long, value_enum, default_value_t = Content::Carrier)]
    content: Content,
    /// The number of points per shape, for `--content points`. They are uniform by area.
    #[arg(long, default_value_t = 20_000, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    points: u32,
    /// The seed of the points.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// The normals of the points; `analytic` needs shapes that were labeled with `--attributes normal`.
    #[arg(long, value_enum, default_value_t = NormalConfig::Triangle)]
    normals: NormalConfig,
}

impl Exporter for WebdatasetArgs {
    const NAME: &'static str = "webdataset";
    const EXTENSIONS: &'static [&'static str] = &["tar"];

    fn export(&self, known: &'static [Outputs]) -> Result<()> {
        let mut settings = json!({ "shard_size": self.shard_size, "content": self.content });
        if self.content == Content::Points {
            settings["points"] = json!(self.points);
            settings["seed"] = json!(self.seed);
            settings["normals"] = json!(self.normals);
        }
        let session = ExportSession::new(Self::NAME, &self.folder, &settings, known)?;
        let mut lines = Vec::new();
        for (number, shapes) in keyed(&session.sources.shapes)
            .chunks(self.shard_size as usize)
            .enumerate()
        {
            let name = format!("shapes-{number:06}.tar");
            lines.extend(self.write_shard(&session, &name, shapes)?);
        }
        lines.extend(session.sources.failed.iter().map(ShapeLine::from));
        session.batch().conclude(&lines)
    }
}

/// A shape and its key.
struct KeyedShape<'a> {
    key: String,
    shape: &'a ShapeInput,
}

/// The shapes with their keys, in the order of the keys.
fn keyed(shapes: &[ShapeInput]) -> Vec<KeyedShape<'_>> {
    let ids: Vec<&str> = shapes.iter().map(|shape| shape.id.as_str()).collect();
    let keys = webdataset_keys(&ids).into_iter();
    let mut keyed: Vec<KeyedShape<'_>> = keys
        .zip(shapes)
        .map(|(key, shape)| KeyedShape { key, shape })
        .collect();
    keyed.sort_by(|a, b| a.key.cmp(&b.key));
    keyed
}

impl WebdatasetArgs {
    /// Writes one tar file, and returns the lines of its shapes. A file without a sample is removed.
    fn write_shard(
        &self,
        session: &ExportSession,
        name: &str,
        keyed: &[KeyedShape<'_>],
    ) -> Result<Vec<ShapeLine>> {
        let path = session.folder.root().join(name);
        let shapes: Vec<&ShapeInput> = keyed.iter().map(|keyed| keyed.shape).collect();
        let mut lines = Vec::new();
        let mut keys = keyed.iter().map(|keyed| keyed.key.as_str());
        let mut stopped = None;
        let written = write_atomically_with(&path, |file| -> io::Result<()> {
            let mut tar = WebdatasetWriter::new(file);
            let work = |shape: &ShapeInput, carrier: &_| self.sample(shape, carrier);
            let ended = session
                .batch()
                .for_each("export", &shapes, work, |shape, sample| {
                    let key = keys.next().unwrap_or_default();
                    match sample {
                        Ok(sample) => {
                            tar.add(key, &[("npz", &sample.npz), ("json", &sample.json)])
                                .map_err(|error| OutputError::new("writing", &path, error))?;
                            lines.push(ShapeLine::written(shape, vec![name.to_owned()]));
                        }
                        Err(error) => lines.push(ShapeLine::failed(shape, &error)),
                    }
                    Ok(())
                });
            if let Err(error) = ended {
                stopped = Some(error);
                return Err(io::Error::other("the export was stopped"));
            }
            tar.finish()
        });
        if let Some(error) = stopped {
            return Err(error);
        }
        written?;
        Ok(lines)
    }

    /// The two files of a shape.
    fn sample(&self, shape: &ShapeInput, carrier: &Carrier) -> Result<Sample> {
        let npz = match self.content {
            Content::Carrier => shape.file_bytes()?,
            Content::Labels => labels_to_npz(carrier, Compression::Stored)?,
            Content::Points => {
                let config = SampleConfig {
                    n_points: self.points as usize,
                    normals: self.normals,
                    seed: self.seed,
                };
                sample_npz(
                    carrier,
                    &config,
                    default_sources(carrier),
                    Compression::Stored,
                )?
            }
        };
        Ok(Sample {
            npz,
            json: json_document(&SampleJson::new(shape, carrier))?,
        })
    }
}

/// The bytes of the files of a sample.
struct Sample {
    npz: Vec<u8>,
    json: Vec<u8>,
}

/// The content of `<key>.json`.
#[derive(Serialize)]
struct SampleJson {
    format_version: u32,
    id: String,
    source: String,
    source_sha256: String,
    unit: Option<&'static str>,
    solid_step_id: Option<u64>,
    product: Option<String>,
    kind: &'static str,
    settings_sha256: Option<String>,
    theta_deg: f64,
    tau_min: u32,
    n_faces: usize,
    n_edges: usize,
    n_parts: usize,
    n_labels: usize,
    n_triangles: usize,
}

impl SampleJson {
    fn new(shape: &ShapeInput, carrier: &Carrier) -> Self {
        let origin = origin_of(shape);
        Self {
            format_version: partprobe_formats::FORMAT_VERSION,
            id: origin.id,
            source: origin.source,
            source_sha256: carrier.meta().source_sha256.clone(),
            unit: origin.unit,
            solid_step_id: origin.solid_step_id,
            product: origin.product,
            kind: carrier.kind().name(),
            settings_sha256: origin.settings_sha256,
            theta_deg: carrier.meta().theta_deg,
            tau_min: carrier.meta().tau_min,
            n_faces: carrier.graph().faces.len(),
            n_edges: carrier.graph().edges.len(),
            n_parts: carrier.n_raw_parts(),
            n_labels: carrier.n_parts(),
            n_triangles: carrier.mesh().triangles.len(),
        }
    }
}
