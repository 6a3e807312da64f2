//! One STEP file, read and measured in this process: what `inspect` shows and `verify` compares.

use crate::config::{Attribute, LabelConfig};
use anyhow::Result;
use partprobe_brep::{AttributeChoice, Brep, ReadBudget, Tessellation, TessellationOptions};
use partprobe_carrier::{Partition, SolidMesh, solid_mesh, weld};
use std::time::{Duration, Instant};

/// What was asked of the kernel.
#[derive(Clone, Copy, Debug)]
pub struct MeasureSettings {
    /// Dihedral threshold, in degrees.
    pub theta_deg: f64,
    /// Tessellation.
    pub options: TessellationOptions,
    /// What the file may cost.
    pub budget: ReadBudget,
}

impl MeasureSettings {
    /// The kernel's part of the labeling settings.
    #[must_use]
    pub fn from_config(label: &LabelConfig) -> Self {
        let options = TessellationOptions {
            chord_fraction: label.chord_fraction,
            angle_rad: label.angle_rad,
            attributes: attribute_choice(&label.attributes),
            volume_loss: label.volume_loss,
            max_triangles: label.max_triangles,
            solid_volumes: false,
        };
        let budget = ReadBudget {
            max_bytes: label.max_file_mb << 20,
            max_entities: label.max_entities,
            ..ReadBudget::default()
        };
        Self {
            theta_deg: label.theta_deg,
            options,
            budget,
        }
    }
}

/// A solid: what the file says of it, and its mesh.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredSolid {
    /// The file closes it: each of its edges is used as often in one direction as in the other.
    pub closed: bool,
    /// Volume that its true surfaces enclose, in cubic millimeters.
    pub volume: f64,
    /// Its triangles.
    pub mesh: SolidMesh,
}

fn attribute_choice(attributes: &[Attribute]) -> AttributeChoice {
    let has = |attribute: Attribute| attributes.contains(&attribute);
    AttributeChoice {
        normal: has(Attribute::Normal),
        uv: has(Attribute::Uv),
        curvature: has(Attribute::Curvature),
    }
}

/// A file as the kernel understands it.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Faces, edges and their nesting.
    pub brep: Brep,
    /// The face graph and the mesh.
    pub shape: Tessellation,
    /// The parts of the faces.
    pub partition: Partition,
    /// Each solid of the file.
    pub solids: Vec<MeasuredSolid>,
    /// How long reading took.
    pub read_time: Duration,
    /// How long the face graph and the mesh took.
    pub shape_time: Duration,
}

impl Measured {
    /// Reads and measures the text of one file.
    ///
    /// # Errors
    /// If the text is no STEP file, or has no readable face.
    pub fn from_step(text: &[u8], settings: &MeasureSettings) -> Result<Self> {
        let started = Instant::now();
        let brep = partprobe_brep::read(text, &settings.budget)?;
        let read_time = started.elapsed();
        let shape = partprobe_brep::tessellate(
            &brep,
            &TessellationOptions {
                solid_volumes: true,
                ..settings.options
            },
        );
        let shape_time = started.elapsed() - read_time;
        let partition = Partition::by_type_and_angle(&shape.graph, settings.theta_deg);
        let solids = measure_solids(&brep, &shape);
        Ok(Self {
            brep,
            shape,
            partition,
            solids,
            read_time,
            shape_time,
        })
    }
}

fn measure_solids(brep: &Brep, shape: &Tessellation) -> Vec<MeasuredSolid> {
    let welded = weld(&shape.mesh);
    let solid_of = |face: u32| shape.graph.faces[face as usize].solid;
    let solids = (0u32..)
        .zip(partprobe_brep::closed_solids(brep))
        .zip(&shape.solid_volumes);
    solids
        .map(|((solid, closed), &volume)| {
            let mesh = solid_mesh(&shape.mesh, &welded, |face| solid_of(face) == Some(solid));
            MeasuredSolid {
                closed,
                volume,
                mesh,
            }
        })
        .collect()
}
