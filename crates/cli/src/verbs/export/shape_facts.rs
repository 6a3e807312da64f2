//! Collects the data of a shape from the index and the carrier, for formats that store them with the labels.

use crate::shape_input::ShapeInput;
use partprobe_label::Unit;
use partprobe_tables::ShapeOrigin;

/// The origin of a shape, in the form of the table of shapes.
pub(super) fn origin_of(shape: &ShapeInput) -> ShapeOrigin {
    ShapeOrigin {
        id: shape.id.clone(),
        source: shape.source.clone(),
        unit: shape.unit.map(|unit| match unit {
            Unit::File => "file",
            Unit::Solid => "solid",
        }),
        solid_step_id: shape.solid_step_id,
        product: shape.product.clone(),
        settings_sha256: shape.settings_sha256.as_deref().map(str::to_owned),
    }
}
