//! Makes one shape at three tessellations.

use crate::config::{Emit, LabelConfig};
use crate::label::{InputFile, visit_carriers};
use anyhow::{Context, Result};
use partprobe_brep::Brep;
use partprobe_carrier::{
    Carrier, CarrierError, CarrierMeta, LabelLayer, REFINE_FRACTION, STEP_PARTS, STEP_PARTS_RAW,
    refine,
};
use partprobe_sources::{absorb_parts_below, partition_by_type_and_angle};
use std::cell::RefCell;

/// The names of the tessellations, and the factor of their chord, angle and longest edge.
pub(super) const TESSELLATIONS: [(&str, f64); 3] = [("T0", 1.0), ("T1", 0.5), ("T2", 2.0)];

/// The plain carriers of one shape, in the order of [`TESSELLATIONS`], before small parts are absorbed.
pub(super) struct TessellatedShape {
    plain: Vec<Carrier>,
}

impl TessellatedShape {
    /// Meshes the shape of a file three times. `id` distinguishes it from other solids of the file.
    ///
    /// # Errors
    /// If the file cannot be read, or one of the meshes has no triangle.
    pub(super) fn new(file: &InputFile, id: &str, config: &LabelConfig) -> Result<Self> {
        let mut plain = Vec::new();
        for (name, factor) in TESSELLATIONS {
            let carrier = carrier_of(file, id, &scaled(config, factor));
            plain.push(carrier.with_context(|| format!("tessellation {name}"))?);
        }
        Ok(Self { plain })
    }

    /// The refined carriers with their labels after absorption of parts with fewer than `tau_min` triangles on them.
    ///
    /// # Errors
    /// If a carrier contradicts itself.
    pub(super) fn at_tau_min(&self, tau_min: u32) -> Result<Vec<Carrier>, CarrierError> {
        let factors = TESSELLATIONS.map(|(_, factor)| factor);
        let pairs = self.plain.iter().zip(factors);
        pairs
            .map(|(plain, factor)| refined(plain, factor, tau_min))
            .collect()
    }
}

/// The settings of a tessellation. The limit for the lost volume of a mesh grows with the square of the angle. Otherwise, this
/// limit would refine a coarse mesh again.
fn scaled(config: &LabelConfig, factor: f64) -> LabelConfig {
    LabelConfig {
        chord_fraction: factor * config.chord_fraction,
        angle_rad: factor * config.angle_rad,
        volume_loss: factor * factor * config.volume_loss,
        tau_min: 0,
        emit: vec![Emit::Carrier],
        attributes: Vec::new(),
        ..config.clone()
    }
}

fn carrier_of(file: &InputFile, id: &str, config: &LabelConfig) -> Result<Carrier> {
    let found: RefCell<Option<Carrier>> = RefCell::new(None);
    let keep = |carrier: &Carrier, _: &Brep| {
        if carrier.meta().id == id {
            *found.borrow_mut() = Some(carrier.clone());
        }
    };
    visit_carriers(file, config, &keep)?;
    found
        .into_inner()
        .context("the shape is not in the file any more")
}

/// The carrier on triangles with a bounded longest edge. The size of small parts is the number of these triangles.
fn refined(plain: &Carrier, factor: f64, tau_min: u32) -> Result<Carrier, CarrierError> {
    let graph = plain.graph();
    let longest_edge = factor * REFINE_FRACTION * plain.meta().diagonal_mm;
    let mesh = refine(plain.mesh(), longest_edge).mesh;
    let parts = partition_by_type_and_angle(graph, plain.meta().theta_deg);
    let labels = match tau_min {
        0 => parts.clone(),
        tau_min => absorb_parts_below(&mesh, graph, &parts, tau_min, f64::INFINITY),
    };
    let meta = CarrierMeta {
        tau_min,
        ..plain.meta().clone()
    };
    let layers = [
        (STEP_PARTS_RAW, LabelLayer::from(&parts)),
        (STEP_PARTS, LabelLayer::from(&labels)),
    ];
    Carrier::new(mesh, graph.clone(), layers, meta)
}
