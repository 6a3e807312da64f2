//! Puts the labels of further sources into a carrier.
//!
//! The names of sources go in, and carriers with one more layer per source come out. If a source refuses a shape, the shape is
//! still labeled: only the layer is missing, and the notes of the carrier name the source and the reason.

use partprobe_carrier::{Carrier, CarrierError, LabelLayer};
use partprobe_sources::{BoxedSource, LabelSource, SourceError, face_source_named};

/// The seed of sources that draw random numbers.
const SEED: u64 = 0;

/// The sources with these names. All of them label whole faces.
pub(crate) fn layer_sources(names: &[String]) -> Result<Vec<BoxedSource>, SourceError> {
    names.iter().map(|name| face_source_named(name)).collect()
}

/// The carrier with one layer per source that accepts it.
pub(crate) fn with_layers(
    mut carrier: Carrier,
    sources: &[BoxedSource],
) -> Result<Carrier, CarrierError> {
    for source in sources {
        carrier = match layer_of(&**source, &carrier) {
            Ok(layer) => carrier.with_layer(source.name(), layer)?,
            Err(reason) => {
                let note = format!("there is no layer `{}`: {reason}", source.name());
                carrier.with_note(note)
            }
        };
    }
    Ok(carrier)
}

fn layer_of(source: &dyn LabelSource, carrier: &Carrier) -> Result<LabelLayer, SourceError> {
    let labels = source.labels(carrier, SEED)?;
    let layer = labels.of_faces().cloned();
    layer.ok_or_else(|| SourceError::NotOnFaces {
        source_name: source.name().to_owned(),
    })
}
