//! Lists the families of parts. Each family draws the dimensions of one part and builds its shell.

mod blocks;
mod extrusions;
mod plates;
mod surfaces;
mod turned;

use crate::part_builder::PartBuilder;

/// The name of a family, and the function that draws a part.
#[derive(Clone, Copy)]
pub(crate) struct Family {
    pub(crate) name: &'static str,
    pub(crate) draw: fn(&mut PartBuilder),
}

const fn family(name: &'static str, draw: fn(&mut PartBuilder)) -> Family {
    Family { name, draw }
}

/// All families. Their order decides which family a random number selects.
pub(crate) const FAMILIES: [Family; 24] = [
    family("plate", plates::plate),
    family("ribbed-plate", plates::ribbed_plate),
    family("slotted-disc", plates::slotted_disc),
    family("link", plates::link),
    family("flange", plates::flange),
    family("bracket", extrusions::bracket),
    family("channel", extrusions::channel),
    family("stair", extrusions::stair),
    family("heat-sink", extrusions::heat_sink),
    family("gear", extrusions::gear),
    family("cam", extrusions::cam),
    family("shaft", turned::shaft),
    family("pulley", turned::pulley),
    family("cup", turned::cup),
    family("vase", turned::vase),
    family("bolt", turned::bolt),
    family("spacer", turned::spacer),
    family("pin", turned::pin),
    family("nut", blocks::nut),
    family("knob", blocks::knob),
    family("enclosure", blocks::enclosure),
    family("manifold", blocks::manifold),
    family("dome", surfaces::dome),
    family("wave", surfaces::wave),
];

/// The family whose parts have exactly the target number of STEP parts, which is at least 2.
pub(crate) const EXACT: Family = family("stepped-pin", turned::stepped_pin);
