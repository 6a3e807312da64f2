//! Defines the JSON of the settings and the origin in a carrier file.

use crate::format_version::FORMAT_VERSION;
use partprobe_carrier::{CarrierMeta, Instance, Units};
use serde::{Deserialize, Serialize};

/// [`CarrierMeta`] as JSON, with the versions of format and program.
#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct MetaJson {
    format_version: u32,
    program_version: String,
    id: String,
    source_sha256: String,
    theta_deg: f64,
    tau_min: u32,
    chord_mm: f64,
    angle_rad: f64,
    diagonal_mm: f64,
    units: UnitsJson,
    lost: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
    #[serde(default)]
    instances: Vec<InstanceJson>,
}

#[derive(Debug, Deserialize, Serialize)]
struct InstanceJson {
    path: String,
    product: Option<String>,
    transform: [[f64; 4]; 4],
}

impl From<&Instance> for InstanceJson {
    fn from(instance: &Instance) -> Self {
        let Instance {
            path,
            product,
            transform,
        } = instance.clone();
        Self {
            path,
            product,
            transform,
        }
    }
}

impl From<InstanceJson> for Instance {
    fn from(json: InstanceJson) -> Self {
        Self {
            path: json.path,
            product: json.product,
            transform: json.transform,
        }
    }
}

#[derive(Debug, Deserialize, Serialize)]
struct UnitsJson {
    length: String,
    mm_per_unit: f64,
    angle: String,
    rad_per_unit: f64,
}

impl From<&CarrierMeta> for MetaJson {
    fn from(meta: &CarrierMeta) -> Self {
        let units = &meta.units;
        Self {
            format_version: FORMAT_VERSION,
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            id: meta.id.clone(),
            source_sha256: meta.source_sha256.clone(),
            theta_deg: meta.theta_deg,
            tau_min: meta.tau_min,
            chord_mm: meta.chord_mm,
            angle_rad: meta.angle_rad,
            diagonal_mm: meta.diagonal_mm,
            units: UnitsJson {
                length: units.length.clone(),
                mm_per_unit: units.mm_per_unit,
                angle: units.angle.clone(),
                rad_per_unit: units.rad_per_unit,
            },
            lost: meta.lost.clone(),
            notes: meta.notes.clone(),
            instances: meta.instances.iter().map(InstanceJson::from).collect(),
        }
    }
}

impl From<MetaJson> for CarrierMeta {
    fn from(json: MetaJson) -> Self {
        Self {
            id: json.id,
            source_sha256: json.source_sha256,
            theta_deg: json.theta_deg,
            tau_min: json.tau_min,
            chord_mm: json.chord_mm,
            angle_rad: json.angle_rad,
            diagonal_mm: json.diagonal_mm,
            units: Units {
                length: json.units.length,
                mm_per_unit: json.units.mm_per_unit,
                angle: json.units.angle,
                rad_per_unit: json.units.rad_per_unit,
            },
            lost: json.lost,
            notes: json.notes,
            instances: json.instances.into_iter().map(Instance::from).collect(),
        }
    }
}
