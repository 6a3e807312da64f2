//! Defines the options of [`label`](crate::label()).
//!
//! They are plain values. The other modules use them.

use partprobe_brep::{ReadBudget, TessellationOptions};

/// The unit that becomes one carrier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Deserialize, serde::Serialize),
    serde(rename_all = "kebab-case")
)]
pub enum Unit {
    /// All faces of a file.
    #[default]
    File,
    /// Each distinct solid of a file.
    Solid,
}

/// The geometry kernel that reads the text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Deserialize, serde::Serialize),
    serde(rename_all = "kebab-case")
)]
pub enum Kernel {
    /// `partprobe-brep`.
    #[default]
    Own,
    /// truck, for comparison. The crate must be built with the feature `truck`. It labels whole files without
    /// instances.
    Truck,
}

/// How a file is labeled.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelOptions {
    /// The unit that becomes one carrier.
    pub unit: Unit,
    /// The kernel.
    pub kernel: Kernel,
    /// Whether each occurrence of a product in an assembly is placed. Otherwise each product is labeled once.
    pub instances: bool,
    /// Whether a mesh is made. Without it, a carrier holds only the labels of the faces. `tau_min`, `instances` and
    /// [`Unit::Solid`] need the mesh, so it is made for them in any case.
    pub has_mesh: bool,
    /// Largest angle between the normals of two faces of one part along their shared edge, in degrees.
    pub theta_deg: f64,
    /// Parts with fewer triangles than this are absorbed by a neighbor.
    pub tau_min: u32,
    /// Names of built-in sources whose face labels the carriers also store, for example `brep-face`. Sources that draw random
    /// numbers get the seed 0.
    pub layers: Vec<String>,
    /// Tolerances, attributes and the limit of triangles.
    pub tessellation: TessellationOptions,
    /// The limits on the work of reading.
    pub budget: ReadBudget,
}

impl Default for LabelOptions {
    /// The settings of the method: θ = 8°, τ_min = 20 triangles, the whole file, with a mesh.
    fn default() -> Self {
        Self {
            unit: Unit::default(),
            kernel: Kernel::default(),
            instances: false,
            has_mesh: true,
            theta_deg: 8.0,
            tau_min: 20,
            layers: Vec::new(),
            tessellation: TessellationOptions::default(),
            budget: ReadBudget::default(),
        }
    }
}

impl LabelOptions {
    /// Whether the options need triangles.
    pub(crate) fn needs_mesh(&self) -> bool {
        self.has_mesh || self.instances || self.tau_min > 0 || self.unit == Unit::Solid
    }
}
