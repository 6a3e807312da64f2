//! Converts the result of the second kernel to the types of our own kernel.

use crate::error::LabelError;
use crate::options::LabelOptions;
use partprobe_brep::{Brep, LostKind, ShapeFlags, Tessellation};
use partprobe_carrier::SurfaceAttributes;
use partprobe_truck::{DroppedEntity, DroppedKind, TruckSettings, TruckShape};

/// The file as truck reads it. truck does not read units, so they come from our own reader.
pub(crate) fn shape_by_truck(
    text: &[u8],
    brep: &Brep,
    options: &LabelOptions,
) -> Result<Tessellation, LabelError> {
    let settings = TruckSettings {
        mm_per_unit: brep.units.mm_per_unit,
        rad_per_unit: brep.units.rad_per_unit,
        chord_fraction: options.tessellation.chord_fraction,
    };
    let text = String::from_utf8_lossy(text);
    let TruckShape {
        graph,
        mesh,
        lost,
        chord_mm,
        diagonal_mm,
    } = partprobe_truck::shape(&text, &settings)?;
    Ok(Tessellation {
        graph,
        mesh,
        attributes: SurfaceAttributes::default(),
        solid_volumes: Vec::new(),
        lost: lost.into_iter().map(loss).collect(),
        notes: brep.notes.clone(),
        flags: ShapeFlags::default(),
        chord_mm,
        diagonal_mm,
        is_over_budget: false,
    })
}

fn loss(
    DroppedEntity {
        kind,
        step_id,
        reason,
    }: DroppedEntity,
) -> partprobe_brep::LostEntity {
    let kind = match kind {
        DroppedKind::Shell => LostKind::Entity,
        DroppedKind::Face => LostKind::Face,
        DroppedKind::Loop => LostKind::Loop,
    };
    partprobe_brep::LostEntity {
        kind,
        step_id,
        reason,
    }
}
