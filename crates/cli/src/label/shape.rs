//! The labelling of one file: text in, carriers and index lines out.

use super::equal_solids::{SolidOutline, telling_name};
use super::second_kernel::shape_by_truck;
use super::source_files::{SourceFile, id_of_path};
use super::step_text::step_text;
use super::text_hash::hash_of_text;
use crate::config::{Emit, KernelConfig, LabelConfig, UnitConfig};
use crate::counted::counted;
use crate::dataset::{IndexEntry, Status};
use crate::measured::MeasureSettings;
use anyhow::{Context, Result, bail, ensure};
use brep::{Brep, ReadError, Shape};
use carrier::{Carrier, CarrierMeta, Instance};
use std::fs;
use std::path::Path;

/// A shape, with its carrier if it has one.
#[derive(Clone, Debug)]
pub(super) struct LabelledShape {
    /// None where no face of a solid could be triangulated.
    pub(super) carrier: Option<Carrier>,
    /// Its line in the index; `file` is still open.
    pub(super) entry: IndexEntry,
}

/// The file asks for more than the settings allow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct OverBudget(pub(super) String);

impl std::fmt::Display for OverBudget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for OverBudget {}

/// Why a file ends that asks for more memory than its worker has.
pub(super) const OVER_MEMORY: &str = "the file needs more memory than label.memory_mb allows";

/// Sees each carrier beside the surfaces that it was made from.
pub(crate) type Visitor<'a> = &'a dyn Fn(&Carrier, &Brep);

/// Labels the text of one file, as one shape or as one for each distinct solid.
pub(super) fn label_text(text: &[u8], id: &str, name: &str, config: &LabelConfig) -> Result<Vec<LabelledShape>> {
    label_text_visiting(text, id, name, config, &|_, _| {})
}

/// Labels one file and shows each carrier with its surfaces.
///
/// # Errors
/// If the file cannot be read, or has no face.
pub(crate) fn visit_carriers(file: &SourceFile, config: &LabelConfig, visit: Visitor<'_>) -> Result<()> {
    ensure!(
        file.archive.is_none(),
        "`sample` does not read archives; unpack it, or label it and sample the data set (without true surfaces)"
    );
    let text = step_text(&file.path, config.max_file_mb << 20)?;
    label_text_visiting(&text, &file.id, &file.name, config, visit).map(|_| ())
}

fn label_text_visiting(
    text: &[u8],
    id: &str,
    name: &str,
    config: &LabelConfig,
    visit: Visitor<'_>,
) -> Result<Vec<LabelledShape>> {
    let settings = MeasureSettings::from_config(config);
    let sha256 = hash_of_text(text);
    let brep = brep::read(text, &settings.budget).map_err(|error| match error {
        ReadError::OverBudget { .. } => anyhow::Error::from(OverBudget(error.to_string())),
        error => error.into(),
    })?;
    let origin = Origin { name, sha256, config, visit };
    match config.unit {
        UnitConfig::File => {
            let shape = match config.kernel {
                KernelConfig::Own => origin.shape(&brep, &settings),
                KernelConfig::Truck => (shape_by_truck(text, &brep, config)?, Vec::new()),
            };
            Ok(vec![origin.labelled(id.to_owned(), &brep, shape)?])
        }
        UnitConfig::Solid => label_solids(&brep, id, &origin, &settings),
    }
}

fn label_solids(brep: &Brep, id: &str, origin: &Origin<'_>, settings: &MeasureSettings) -> Result<Vec<LabelledShape>> {
    let mut shapes: Vec<LabelledShape> = Vec::new();
    let mut outlines: Vec<SolidOutline> = Vec::new();
    for (solid, _) in (0..).zip(&brep.solids) {
        let part = brep.for_solid(solid);
        if part.faces.is_empty() {
            continue;
        }
        let shape = origin.shape(&part, settings);
        let outline = SolidOutline::new(&shape.0.graph, &shape.0.mesh);
        if let Some(first) = outlines.iter().position(|known| known.equals(&outline)) {
            shapes[first].entry.n_equal_solids += 1;
            continue;
        }
        outlines.push(outline);
        let id = format!("{id}__s{solid}");
        shapes.push(origin.labelled(id.clone(), &part, shape).unwrap_or_else(|error| origin.failed(&id, &error)));
    }
    let Some(first) = shapes.first_mut() else {
        bail!("no face of the file belongs to a solid; label with label.unit = \"file\"");
    };
    first.entry.lost.extend(faces_outside_solids(brep));
    Ok(shapes)
}

/// Labels alone need a mesh only to count the triangles of small parts.
fn needs_mesh(config: &LabelConfig) -> bool {
    config.tau_min > 0 || config.instances || config.emit != [Emit::Labels] || config.unit == UnitConfig::Solid
}

/// Says how many faces the unit `solid` leaves out, so that they do not vanish in silence.
fn faces_outside_solids(brep: &Brep) -> Option<String> {
    let outside = || brep.faces.iter().filter(|face| brep.shells[face.shell as usize].solid.is_none());
    let first = outside().next()?;
    let belong = counted(outside().count(), "face belongs", "faces belong");
    Some(format!("{belong} to no solid, first #{}", first.step_id))
}

/// What the shapes of one file share.
struct Origin<'a> {
    name: &'a str,
    sha256: String,
    config: &'a LabelConfig,
    visit: Visitor<'a>,
}

impl Origin<'_> {
    /// The shape, without a mesh where nothing that is asked for needs one, and the occurrences that its faces are of.
    fn shape(&self, brep: &Brep, settings: &MeasureSettings) -> (Shape, Vec<Instance>) {
        if self.config.instances {
            return brep::shape_of_instances(brep, &settings.options);
        }
        let has_mesh = needs_mesh(self.config);
        let shape = if has_mesh { brep::shape(brep, &settings.options) } else { brep::shape_without_mesh(brep) };
        (shape, brep::first_instances(brep))
    }

    fn labelled(&self, id: String, brep: &Brep, (shape, instances): (Shape, Vec<Instance>)) -> Result<LabelledShape> {
        let lost: Vec<String> = shape.lost.iter().map(ToString::to_string).collect();
        let notes: Vec<String> = shape.notes.iter().map(ToString::to_string).collect();
        let meta = CarrierMeta {
            id: id.clone(),
            source_sha256: self.sha256.clone(),
            theta_deg: self.config.theta_deg,
            tau_min: self.config.tau_min,
            chord_mm: shape.chord_mm,
            angle_rad: self.config.angle_rad,
            diagonal_mm: shape.diagonal_mm,
            units: brep.units.clone(),
            lost: lost.clone(),
            notes: notes.clone(),
            instances,
        };
        let limit = self.config.max_triangles;
        ensure!(
            !shape.is_over_budget,
            OverBudget(format!(
                "the mesh has more than {limit} triangles; raise label.max_triangles or the tolerances"
            ))
        );
        let has_no_triangle = needs_mesh(self.config) && shape.mesh.triangles.is_empty();
        ensure!(!has_no_triangle, "no face could be triangulated; {} were lost", lost.len());
        let solid = brep.solids.first().filter(|_| self.config.unit == UnitConfig::Solid);
        let n_undefined_angles = shape.graph.edges.iter().filter(|edge| edge.phi.is_nan()).count();
        let n_non_manifold_edges = shape.flags.non_manifold_edges;
        let carrier = Carrier::new(shape.mesh, shape.graph, meta)?.with_attributes(shape.attributes)?;
        (self.visit)(&carrier, brep);
        let entry = IndexEntry {
            id,
            source: self.name.to_owned(),
            status: Status::Ok,
            reason: None,
            file: None,
            content_hash: None,
            labels_file: None,
            points_file: None,
            member: None,
            n_skipped: None,
            sha256: Some(self.sha256.clone()),
            solid_step_id: solid.map(|solid| solid.step_id),
            product: telling_name(solid.and_then(|solid| solid.name.as_deref())),
            n_equal_solids: 0,
            n_faces: carrier.graph().faces.len(),
            n_parts: carrier.n_parts(),
            n_labels: carrier.n_labels(),
            n_triangles: carrier.mesh().triangles.len(),
            n_edges: carrier.graph().edges.len(),
            n_undefined_angles,
            n_non_manifold_edges,
            lost,
            notes,
        };
        Ok(LabelledShape { carrier: Some(carrier), entry })
    }

    fn failed(&self, id: &str, error: &anyhow::Error) -> LabelledShape {
        let status = if error.is::<OverBudget>() { Status::OverBudget } else { Status::Failed };
        let entry = IndexEntry::without_carrier(id, self.name, status, format!("{error:#}"));
        LabelledShape { carrier: None, entry: IndexEntry { sha256: Some(self.sha256.clone()), ..entry } }
    }
}

/// The carriers of one path, labelled in this process: a carrier file gives itself, a STEP file its shapes.
///
/// # Errors
/// If the file cannot be read, or has no face.
pub fn carriers_of_path(path: &Path, config: &LabelConfig) -> Result<Vec<Carrier>> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npz")) {
        let bytes = fs::read(path).with_context(|| format!("reading {}", path.display()))?;
        return Ok(vec![formats::carrier_from_npz(&bytes)?]);
    }
    carriers_of_text(&step_text(path, config.max_file_mb << 20)?, &id_of_path(path), config)
}

/// The carriers of a STEP file's text, labelled in this process.
///
/// # Errors
/// If the text cannot be read, or has no face.
pub fn carriers_of_text(text: &[u8], id: &str, config: &LabelConfig) -> Result<Vec<Carrier>> {
    let shapes = label_text(text, id, id, config)?;
    Ok(shapes.into_iter().filter_map(|shape| shape.carrier).collect())
}
