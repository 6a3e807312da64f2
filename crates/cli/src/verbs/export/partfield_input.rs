//! Writes the input of PartField, and the map for importing its results: `partprobe export partfield-input`.
//!
//! PartField names its files after its input, cuts names at `.` and `_`, and moves and scales each mesh without recording it. So
//! each shape gets a plain name and one OBJ file, and `map.json` records its id, its original position, and for each triangle of
//! the mesh the triangle of the carrier that contains it. The type `partfield` of imported labels reads the map.

use super::batch::portable;
use super::common_args::FolderArgs;
use super::exporter::Exporter;
use super::outputs::Outputs;
use super::session::ExportSession;
use super::shape_line::ShapeLine;
use crate::shape_input::ShapeInput;
use anyhow::Result;
use partprobe_carrier::Carrier;
use partprobe_dataset::json_document;
use partprobe_formats::{
    Array, PARTFIELD_MAP_FILE, PartFieldLimits, PartFieldMap, PartFieldMesh, PartFieldShape,
    array_to_npy, partfield_names,
};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// PartField reads every file of this folder whose name contains `.obj`.
const MESHES: &str = "meshes";
/// The triangle of the carrier of each triangle.
const PARENTS: &str = "parents";

/// What `partfield-input` takes.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Example: partprobe export partfield-input dataset/ --out pf/

DIR/meshes/<uid>.obj is a mesh of one object in millimeters, welded, with short edges. DIR/map.json says which shape each <uid>
is. A <uid> has no `.` and no `_`, because PartField cuts names there. Give DIR/meshes to PartField as `dataset.data_path` and
`--source_dir`. Its results are read as a label source with `type = \"partfield\"` and `map = \"DIR\"`."
)]
pub(crate) struct PartFieldInputArgs {
    #[command(flatten)]
    folder: FolderArgs,
    /// The longest edge, as a fraction of the diagonal of the shape: PartField gives each triangle one label.
    #[arg(long, default_value_t = 0.02, value_name = "FRACTION", value_parser = max_edge)]
    max_edge: f64,
    /// Refuse shapes with more triangles: PartField stores 1.8 kB per triangle.
    #[arg(long, default_value_t = 500_000, value_name = "N", value_parser = clap::value_parser!(u32).range(21..))]
    max_triangles: u32,
}

fn max_edge(text: &str) -> Result<f64, String> {
    let fraction: Option<f64> = text.parse().ok();
    fraction
        .filter(|fraction| (1e-4..=1.0).contains(fraction))
        .ok_or_else(|| "a fraction from 0.0001 to 1 is needed".to_owned())
}

impl Exporter for PartFieldInputArgs {
    const NAME: &'static str = "partfield-input";
    const EXTENSIONS: &'static [&'static str] = &["obj", "npy", "json"];

    fn export(&self, known: &'static [Outputs]) -> Result<()> {
        let settings = json!({ "max_edge": self.max_edge, "max_triangles": self.max_triangles });
        let session = ExportSession::new(Self::NAME, &self.folder, &settings, known)?;
        let shapes: Vec<&ShapeInput> = session.sources.shapes.iter().collect();
        let ids: Vec<&str> = shapes.iter().map(|shape| shape.id.as_str()).collect();
        let names = partfield_names(&ids);
        let name_of: BTreeMap<&str, &String> = ids.iter().copied().zip(&names).collect();

        let exported = session.batch().map("export", &shapes, |shape, carrier| {
            self.write_shape(&session, name_of[shape.id.as_str()], shape, carrier)
        })?;

        let mut map = BTreeMap::new();
        let mut lines = Vec::new();
        for ((shape, name), exported) in shapes.iter().zip(&names).zip(exported) {
            match exported {
                Ok(entry) => {
                    let files = vec![entry.mesh.clone(), entry.parents.clone()];
                    lines.push(ShapeLine::written(shape, files));
                    map.insert(name.clone(), entry);
                }
                Err(error) => lines.push(ShapeLine::failed(shape, &error)),
            }
        }
        lines.extend(session.sources.failed.iter().map(ShapeLine::from));
        let map = PartFieldMap::new(self.max_edge, map);
        session
            .folder
            .write(Path::new(PARTFIELD_MAP_FILE), &json_document(&map)?)?;
        session.batch().conclude(&lines)
    }
}

impl PartFieldInputArgs {
    /// Writes the two files of a shape, and returns its entry in the map.
    ///
    /// # Errors
    /// If PartField cannot use the shape, or a file cannot be written.
    fn write_shape(
        &self,
        session: &ExportSession,
        name: &str,
        shape: &ShapeInput,
        carrier: &Carrier,
    ) -> Result<PartFieldShape> {
        let limits = PartFieldLimits {
            max_edge: self.max_edge,
            max_triangles: self.max_triangles,
        };
        let made = PartFieldMesh::new(carrier.mesh(), &limits)?;
        let mesh: PathBuf = [MESHES, &format!("{name}.obj")].iter().collect();
        let parents: PathBuf = [PARENTS, &format!("{name}.npy")].iter().collect();
        session.folder.write(&mesh, made.to_obj().as_bytes())?;
        let array = Array::vector(made.parent.clone());
        session.folder.write(&parents, &array_to_npy(&array))?;
        Ok(PartFieldShape {
            // Results are found by the id in the carrier itself.
            id: carrier.meta().id.clone(),
            source: shape.source.clone(),
            mesh: portable(&mesh),
            parents: portable(&parents),
            n_triangles: made.triangles.len(),
            center: made.center,
            scale: made.scale,
        })
    }
}
