//! Labels the text of one file: reading, tessellation, parts and further layers, for the file or for each solid.

use crate::equal_solids::{SolidOutline, meaningful_name};
use crate::error::LabelError;
use crate::layers::{layer_sources, with_layers};
use crate::options::{Kernel, LabelOptions, Unit};
use crate::second_kernel::shape_by_truck;
use partprobe_brep::{Brep, Tessellation};
use partprobe_carrier::{Carrier, CarrierMeta, GivenShape, Instance, carrier_of_given, sha256_hex};
use partprobe_sources::{BoxedSource, StepParts};

/// A file with its shapes.
#[derive(Clone, Debug)]
pub struct LabeledFile {
    /// The SHA-256 of the text, in hexadecimal digits.
    pub sha256: String,
    /// The shapes, in the order of the file. The list is never empty.
    pub shapes: Vec<LabeledShape>,
    /// The items that are in no shape: the faces that [`Unit::Solid`] leaves out.
    pub lost: Vec<String>,
}

/// A shape with its carrier.
#[derive(Clone, Debug)]
pub struct LabeledShape {
    /// The id of the file. For a solid, it is `<id>__s<k>` with the number of the solid.
    pub id: String,
    /// The carrier, or the reason why this shape has none.
    pub carrier: Result<Carrier, LabelError>,
    /// The `#` number of the solid, if the shape is one.
    pub solid_step_id: Option<u64>,
    /// The name of the solid, unless modelers give this name automatically.
    pub product: Option<String>,
    /// The number of further solids of the file that equal this one. They do not become separate shapes.
    pub n_equal_solids: usize,
    /// Shared edges at which the angle between the faces is not defined.
    pub n_undefined_angles: usize,
    /// Edges that more than two faces use.
    pub n_non_manifold_edges: u64,
}

/// A function that gets each carrier together with the surfaces from which it was made.
pub type Visitor<'a> = &'a dyn Fn(&Carrier, &Brep);

/// Labels the text of one STEP file.
///
/// # Errors
/// If the text cannot be read, if the whole file is one shape and this shape has no carrier, if each solid should become a shape
/// and there is none, or if the kernel cannot do what the options request. A single solid without a carrier is part of the
/// result.
pub fn label(text: &[u8], id: &str, options: &LabelOptions) -> Result<LabeledFile, LabelError> {
    label_visiting(text, id, options, &|_, _| {})
}

/// Labels the text of one STEP file, and passes each carrier to `visit`, with the surfaces from which it was made.
///
/// # Errors
/// As for [`label`].
pub fn label_visiting(
    text: &[u8],
    id: &str,
    options: &LabelOptions,
    visit: Visitor<'_>,
) -> Result<LabeledFile, LabelError> {
    if options.kernel == Kernel::Truck && (options.unit == Unit::Solid || options.instances) {
        return Err(LabelError::WholeFilesOnly);
    }
    let layer_sources = layer_sources(&options.layers)?;
    let sha256 = sha256_hex(text);
    let brep = partprobe_brep::read(text, &options.budget)?;
    let labeler = Labeler {
        sha256,
        layer_sources,
        options,
        visit,
    };
    match options.unit {
        Unit::File => labeler.label_file(text, &brep, id),
        Unit::Solid => labeler.label_solids(&brep, id),
    }
}

/// The carrier of a mesh or a point cloud without a B-Rep. Its parts are its given labels.
///
/// `sha256` is the hash of its file. Only two of the options are used: the further layers and the limit of triangles.
///
/// # Errors
/// If the shape is empty, its lists do not fit each other, it has too many triangles, or a layer is unknown.
pub fn label_given(
    shape: GivenShape,
    id: &str,
    sha256: &str,
    options: &LabelOptions,
) -> Result<LabeledFile, LabelError> {
    let limit = options.tessellation.max_triangles;
    if shape.triangles.len().max(shape.vertices.len()) as u64 > limit {
        return Err(LabelError::TooManyTriangles { limit });
    }
    let carrier = carrier_of_given(shape, id, sha256)?;
    let carrier = with_layers(carrier, &layer_sources(&options.layers)?)?;
    let shape = LabeledShape {
        id: id.to_owned(),
        carrier: Ok(carrier),
        solid_step_id: None,
        product: None,
        n_equal_solids: 0,
        n_undefined_angles: 0,
        n_non_manifold_edges: 0,
    };
    Ok(LabeledFile {
        sha256: sha256.to_owned(),
        shapes: vec![shape],
        lost: Vec::new(),
    })
}

/// The data that the shapes of one file share.
struct Labeler<'a> {
    sha256: String,
    layer_sources: Vec<BoxedSource>,
    options: &'a LabelOptions,
    visit: Visitor<'a>,
}

impl Labeler<'_> {
    fn label_file(self, text: &[u8], brep: &Brep, id: &str) -> Result<LabeledFile, LabelError> {
        let tessellated = match self.options.kernel {
            Kernel::Own => self.tessellate(brep),
            Kernel::Truck => (shape_by_truck(text, brep, self.options)?, Vec::new()),
        };
        let mut shape = self.labeled(id.to_owned(), brep, tessellated);
        shape.carrier = Ok(shape.carrier?);
        Ok(LabeledFile {
            sha256: self.sha256,
            shapes: vec![shape],
            lost: Vec::new(),
        })
    }

    /// One shape per solid that does not equal an earlier one.
    fn label_solids(self, brep: &Brep, id: &str) -> Result<LabeledFile, LabelError> {
        let mut shapes: Vec<LabeledShape> = Vec::new();
        let mut outlines: Vec<SolidOutline> = Vec::new();
        for (solid, _) in (0..).zip(&brep.solids) {
            let part = brep.for_solid(solid);
            if part.faces.is_empty() {
                continue;
            }
            let tessellated = self.tessellate(&part);
            let outline = SolidOutline::new(&tessellated.0.graph, &tessellated.0.mesh);
            if let Some(first) = outlines.iter().position(|known| known.equals(&outline)) {
                shapes[first].n_equal_solids += 1;
                continue;
            }
            outlines.push(outline);
            shapes.push(self.labeled(format!("{id}__s{solid}"), &part, tessellated));
        }
        if shapes.is_empty() {
            return Err(LabelError::NoSolid);
        }
        Ok(LabeledFile {
            sha256: self.sha256,
            shapes,
            lost: faces_outside_solids(brep).into_iter().collect(),
        })
    }

    /// The shape and the occurrences of its faces. It has no mesh if the options do not need one.
    fn tessellate(&self, brep: &Brep) -> (Tessellation, Vec<Instance>) {
        let tessellation = &self.options.tessellation;
        if self.options.instances {
            return partprobe_brep::tessellate_instances(brep, tessellation);
        }
        let shape = if self.options.needs_mesh() {
            partprobe_brep::tessellate(brep, tessellation)
        } else {
            partprobe_brep::tessellation_without_mesh(brep)
        };
        (shape, partprobe_brep::first_instances(brep))
    }

    fn labeled(
        &self,
        id: String,
        brep: &Brep,
        (shape, instances): (Tessellation, Vec<Instance>),
    ) -> LabeledShape {
        let solid = brep
            .solids
            .first()
            .filter(|_| self.options.unit == Unit::Solid);
        LabeledShape {
            solid_step_id: solid.map(|solid| solid.step_id),
            product: meaningful_name(solid.and_then(|solid| solid.name.as_deref())),
            n_equal_solids: 0,
            n_undefined_angles: shape
                .graph
                .edges
                .iter()
                .filter(|edge| edge.phi.is_nan())
                .count(),
            n_non_manifold_edges: shape.flags.non_manifold_edges,
            carrier: self.carrier(&id, brep, shape, instances),
            id,
        }
    }

    fn carrier(
        &self,
        id: &str,
        brep: &Brep,
        shape: Tessellation,
        instances: Vec<Instance>,
    ) -> Result<Carrier, LabelError> {
        if shape.is_over_budget {
            return Err(LabelError::TooManyTriangles {
                limit: self.options.tessellation.max_triangles,
            });
        }
        if self.options.needs_mesh() && shape.mesh.triangles.is_empty() {
            return Err(LabelError::NoTriangle {
                n_lost: shape.lost.len(),
            });
        }
        let meta = CarrierMeta {
            id: id.to_owned(),
            source_sha256: self.sha256.clone(),
            theta_deg: self.options.theta_deg,
            tau_min: self.options.tau_min,
            chord_mm: shape.chord_mm,
            angle_rad: self.options.tessellation.angle_rad,
            diagonal_mm: shape.diagonal_mm,
            units: brep.units.clone(),
            lost: shape.lost.iter().map(ToString::to_string).collect(),
            notes: shape.notes.iter().map(ToString::to_string).collect(),
            instances,
        };
        let rule = StepParts {
            theta_deg: self.options.theta_deg,
            tau_min: self.options.tau_min,
        };
        let layers = rule.layers(&shape.mesh, &shape.graph);
        let carrier = Carrier::new(shape.mesh, shape.graph, layers, meta)?
            .with_attributes(shape.attributes)?;
        let carrier = with_layers(carrier, &self.layer_sources)?;
        (self.visit)(&carrier, brep);
        Ok(carrier)
    }
}

/// The message about the number of faces that [`Unit::Solid`] leaves out, so that they do not disappear silently.
fn faces_outside_solids(brep: &Brep) -> Option<String> {
    let outside: Vec<_> = brep
        .faces
        .iter()
        .filter(|face| brep.shells[face.shell as usize].solid.is_none())
        .collect();
    let belong = if outside.len() == 1 {
        "face belongs"
    } else {
        "faces belong"
    };
    let first = outside.first()?;
    Some(format!(
        "{} {belong} to no solid, first #{}",
        outside.len(),
        first.step_id
    ))
}
