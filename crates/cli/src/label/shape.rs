//! Converts the result of `partprobe-label` for one file to lines of the index.

use super::input_bytes::InputBytes;
use super::input_files::{InputFile, id_of_path};
use super::over_budget::OverBudget;
use crate::config::{Emit, LabelConfig};
use anyhow::{Context, Result, bail, ensure};
use partprobe_carrier::Carrier;
use partprobe_dataset::{IndexEntry, Status};
use partprobe_imports::is_given_name;
use partprobe_label::{LabelError, LabelOptions, LabeledFile, LabeledShape, Visitor};
use std::fs;
use std::path::Path;

/// A shape, with its carrier if it has one.
#[derive(Clone, Debug)]
pub(super) struct IndexedShape {
    /// `None` if no face of a solid could be triangulated.
    pub(super) carrier: Option<Carrier>,
    /// Its line in the index. `file` is not set yet.
    pub(super) entry: IndexEntry,
}

/// Labels one file: STEP text gives one shape, or one per distinct solid, and a mesh or a cloud gives one shape.
pub(super) fn label_input(
    input: &InputBytes,
    id: &str,
    name: &str,
    config: &LabelConfig,
) -> Result<Vec<IndexedShape>> {
    let file = labeled_file(input, id, config)?;
    let indexed = |shape| IndexedShape::new(shape, name, &file.sha256);
    let mut shapes: Vec<IndexedShape> = file.shapes.into_iter().map(indexed).collect();
    if let Some(first) = shapes.first_mut() {
        first.entry.lost.extend(file.lost);
    }
    Ok(shapes)
}

fn labeled_file(input: &InputBytes, id: &str, config: &LabelConfig) -> Result<LabeledFile> {
    let options = label_options(config);
    let labeled = match input {
        InputBytes::Step(text) => partprobe_label::label(text, id, &options),
        InputBytes::Given(given) => {
            partprobe_label::label_given(given.shape()?, id, &given.sha256(), &options)
        }
    };
    labeled.map_err(to_anyhow)
}

/// Labels one file and calls a function for each carrier with its surfaces.
///
/// # Errors
/// If the file cannot be read, or has no face.
pub(crate) fn visit_carriers(
    file: &InputFile,
    config: &LabelConfig,
    visit: Visitor<'_>,
) -> Result<()> {
    ensure!(
        file.archive.is_none(),
        "`sample` does not read archives; unpack it, or label it and sample the data set (without true surfaces)"
    );
    let InputBytes::Step(text) = InputBytes::of_path(&file.path, config.max_file_mb << 20)? else {
        bail!(
            "it is a mesh or a point cloud without surfaces; label it, and give the data set: partprobe label {} --out data",
            file.path.display()
        );
    };
    partprobe_label::label_visiting(&text, &file.id, &label_options(config), visit)
        .map(|_| ())
        .map_err(to_anyhow)
}

/// The labeling settings of a config. If only labels are written, no mesh is needed.
fn label_options(config: &LabelConfig) -> LabelOptions {
    LabelOptions {
        unit: config.unit,
        kernel: config.kernel,
        instances: config.instances,
        has_mesh: config.emit != [Emit::Labels],
        theta_deg: config.theta_deg,
        tau_min: config.tau_min,
        layers: config.layers.clone(),
        tessellation: config.shape_options(),
        budget: config.read_budget(),
    }
}

/// Converts the error. It distinguishes files that could be read with other settings.
fn to_anyhow(error: LabelError) -> anyhow::Error {
    if error.is_over_budget() {
        OverBudget(error.to_string()).into()
    } else {
        error.into()
    }
}

impl IndexedShape {
    fn new(shape: LabeledShape, source: &str, sha256: &str) -> Self {
        let entry = match &shape.carrier {
            Ok(carrier) => labeled_entry(carrier, &shape),
            Err(error) => failed_entry(error, &shape.id),
        };
        let entry = IndexEntry {
            source: source.to_owned(),
            sha256: Some(sha256.to_owned()),
            n_equal_solids: shape.n_equal_solids,
            ..entry
        };
        Self {
            carrier: shape.carrier.ok(),
            entry,
        }
    }
}

/// The line of the index for a shape with a carrier.
fn labeled_entry(carrier: &Carrier, shape: &LabeledShape) -> IndexEntry {
    IndexEntry {
        solid_step_id: shape.solid_step_id,
        product: shape.product.clone(),
        n_non_manifold_edges: shape.n_non_manifold_edges,
        ..IndexEntry::of_carrier(carrier)
    }
}

/// The line of the index for a shape without a carrier.
fn failed_entry(error: &LabelError, id: &str) -> IndexEntry {
    let status = if error.is_over_budget() {
        Status::OverBudget
    } else {
        Status::Failed
    };
    IndexEntry {
        reason: Some(error.to_string()),
        ..IndexEntry::new(id, status)
    }
}

/// The carriers of one path, labeled in this process. A carrier file gives its carrier, and any other file gives its shapes.
///
/// # Errors
/// If the file cannot be read, or has no face.
pub(crate) fn carriers_of_path(path: &Path, config: &LabelConfig) -> Result<Vec<Carrier>> {
    if path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("npz"))
    {
        let bytes = fs::read(path).with_context(|| format!("reading {}", path.display()))?;
        return Ok(vec![partprobe_formats::carrier_from_npz(&bytes)?]);
    }
    let input = InputBytes::of_path(path, config.max_file_mb << 20)?;
    labeled_file(&input, &id_of_path(path), config).map(carriers_of)
}

/// The carrier of a mesh or a point cloud. Returns `None` if the file is neither.
///
/// # Errors
/// If the file cannot be read, or is damaged.
pub(crate) fn given_carrier(path: &Path, config: &LabelConfig) -> Result<Option<Carrier>> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if !is_given_name(&name) {
        return Ok(None);
    }
    let input = InputBytes::of_path(path, config.max_file_mb << 20)?;
    if matches!(input, InputBytes::Step(_)) {
        return Ok(None);
    }
    let file = labeled_file(&input, &id_of_path(path), config)?;
    Ok(carriers_of(file).into_iter().next())
}

/// The carriers of a STEP file's text, labeled in this process.
///
/// # Errors
/// If the text cannot be read, or has no face.
pub(crate) fn carriers_of_text(
    text: &[u8],
    id: &str,
    config: &LabelConfig,
) -> Result<Vec<Carrier>> {
    let file = partprobe_label::label(text, id, &label_options(config)).map_err(to_anyhow)?;
    Ok(carriers_of(file))
}

fn carriers_of(file: LabeledFile) -> Vec<Carrier> {
    let carriers = file.shapes.into_iter();
    carriers.filter_map(|shape| shape.carrier.ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::load;
    use partprobe_cluster::{ClustererSettings, KMeansSettings};
    use partprobe_verify::MeasureSettings;

    #[test]
    fn the_defaults_of_the_libraries_are_those_of_base_toml() {
        let base = load("base", &[]).unwrap().config;
        assert_eq!(label_options(&base.label), LabelOptions::default());
        assert_eq!(base.label.measure_settings(), MeasureSettings::default());

        let KMeansSettings {
            restarts,
            max_iterations,
            tolerance,
            ..
        } = KMeansSettings::with_k(1);
        let paper = ClustererSettings {
            restarts,
            max_iterations,
            tolerance,
        };
        assert_eq!(base.eval.clusterer_settings(), paper);
    }
}
