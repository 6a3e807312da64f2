//! Draws the points of a carrier by the settings of `[sample]`, and labels them.

use crate::config::{NormalConfig, SampleConfig};
use anyhow::Result;
use partprobe_carrier::{
    Carrier, GIVEN, NormalKind, PointSample, ShapeKind, keyed_rng, sample_by_area,
};
use partprobe_formats::{Compression, SampleLabels, sample_to_npz};
use partprobe_sources::{BoxedSource, source_named};

/// The points of a carrier, and their labels by each source.
pub(crate) fn labeled_points(
    carrier: &Carrier,
    config: &SampleConfig,
    sources: &[BoxedSource],
) -> Result<(PointSample, Vec<Vec<i32>>)> {
    let sample = points_of(&carrier.meta().id, carrier, config)?;
    let mut labels = Vec::new();
    for source in sources {
        labels.push(
            source
                .labels(carrier, config.seed)?
                .label_of_points(&sample)?,
        );
    }
    Ok((sample, labels))
}

/// The label sources of a point sample if none are named.
pub(crate) const DEFAULT_SOURCES: [&str; 3] = ["step-parts", "brep-face", "primitive"];

/// These sources. For a shape without a B-Rep, they are its given labels, if it has some.
pub(crate) fn default_sources(carrier: &Carrier) -> &'static [&'static str] {
    match carrier.kind() {
        ShapeKind::Brep => &DEFAULT_SOURCES,
        ShapeKind::Mesh | ShapeKind::Cloud if carrier.n_parts() == 0 => &[],
        ShapeKind::Mesh | ShapeKind::Cloud => &[GIVEN],
    }
}

/// The file of points for a carrier, labeled by these sources.
///
/// # Errors
/// If a source is unknown, or the carrier has no area.
pub(crate) fn sample_npz(
    carrier: &Carrier,
    config: &SampleConfig,
    sources: &[&str],
    compression: Compression,
) -> Result<Vec<u8>> {
    let named = sources
        .iter()
        .map(|name| Ok(source_named(name)?))
        .collect::<Result<Vec<BoxedSource>>>()?;
    let (sample, labels) = labeled_points(carrier, config, &named)?;
    let labels: SampleLabels = sources
        .iter()
        .map(|&name| name.to_owned())
        .zip(labels)
        .collect();
    Ok(sample_to_npz(&sample, &labels, compression)?)
}

/// The points of a shape. They are the same in every stage with these settings.
///
/// # Errors
/// If the carrier has no area, or no vertex normals although analytic ones are requested.
pub(crate) fn points_of(
    id: &str,
    carrier: &Carrier,
    config: &SampleConfig,
) -> Result<PointSample, partprobe_carrier::SampleError> {
    let kind = match config.normals {
        NormalConfig::Triangle => NormalKind::Triangle,
        NormalConfig::Analytic => NormalKind::Analytic,
    };
    sample_by_area(
        carrier.mesh(),
        config.n_points,
        kind,
        &mut keyed_rng(config.seed, &["sample", id]),
    )
}
