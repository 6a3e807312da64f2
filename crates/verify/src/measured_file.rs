//! Measures one STEP file: its B-Rep, its mesh, its parts and its solids.

use partprobe_brep::{Brep, ReadBudget, ReadError, Tessellation, TessellationOptions};
use partprobe_carrier::{Partition, SolidMesh, solid_mesh, weld};
use partprobe_sources::partition_by_type_and_angle;

/// The settings of the kernel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasureSettings {
    /// Dihedral threshold, in degrees.
    pub theta_deg: f64,
    /// Tessellation.
    pub options: TessellationOptions,
    /// The limits for reading the file.
    pub budget: ReadBudget,
}

impl Default for MeasureSettings {
    /// θ = 8°, and the kernel's own defaults.
    fn default() -> Self {
        Self {
            theta_deg: 8.0,
            options: TessellationOptions::default(),
            budget: ReadBudget::default(),
        }
    }
}

/// A solid: its data in the file, and its mesh.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredSolid {
    /// Whether it is closed in the file: each of its edges is used equally often in both directions.
    pub closed: bool,
    /// Volume that its true surfaces enclose, in cubic millimeters.
    pub volume: f64,
    /// Its triangles.
    pub mesh: SolidMesh,
}

/// A file as the kernel reads it.
#[derive(Clone, Debug)]
pub struct MeasuredFile {
    /// Faces, edges and their nesting.
    pub brep: Brep,
    /// The face graph and the mesh.
    pub shape: Tessellation,
    /// The parts of the faces.
    pub partition: Partition,
    /// Each solid of the file.
    pub solids: Vec<MeasuredSolid>,
}

impl MeasuredFile {
    /// Reads and measures the text of one file.
    ///
    /// # Errors
    /// If the text is not a STEP file, or has no readable face.
    pub fn from_step(text: &[u8], settings: &MeasureSettings) -> Result<Self, ReadError> {
        let brep = partprobe_brep::read(text, &settings.budget)?;
        Ok(Self::from_brep(brep, settings))
    }

    /// Measures a B-Rep.
    #[must_use]
    pub fn from_brep(brep: Brep, settings: &MeasureSettings) -> Self {
        let options = TessellationOptions {
            solid_volumes: true,
            ..settings.options
        };
        let shape = partprobe_brep::tessellate(&brep, &options);
        let partition = partition_by_type_and_angle(&shape.graph, settings.theta_deg);
        let solids = measure_solids(&brep, &shape);
        Self {
            brep,
            shape,
            partition,
            solids,
        }
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
