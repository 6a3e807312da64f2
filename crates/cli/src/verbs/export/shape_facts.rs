//! Says what the index and the carrier know of a shape, for formats that keep it next to the labels.

use crate::shape_input::ShapeInput;
use partprobe_label::Unit;
use partprobe_tables::ShapeOrigin;

/// Where a shape is from, as the table of shapes has it.
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
