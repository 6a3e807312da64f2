//! Lists the label sources that follow from the STEP-Parts rule.
//!
//! `step-parts` and `step-parts-raw` read the layers that the carrier stores, because absorption is costly. `canonical`
//! applies the rule again with the settings that the carrier was labeled with.

use crate::factory::SourceFactory;
use crate::source::SourceLabels;
use crate::step_parts::StepParts;
use partprobe_carrier::ShapeKind;

/// The parts of the carrier after small ones were absorbed.
pub(crate) const STEP_PARTS: SourceFactory = SourceFactory::rule(
    partprobe_carrier::STEP_PARTS,
    "faces of one primitive type joined across near-tangent edges, small parts absorbed",
    |carrier, _| {
        Ok(SourceLabels::on_faces(
            carrier.mesh(),
            carrier.part_of_face(),
        ))
    },
)
.labeling_faces()
.needing(ShapeKind::Brep);

/// The parts of the carrier before small ones were absorbed.
pub(crate) const STEP_PARTS_RAW: SourceFactory = SourceFactory::rule(
    partprobe_carrier::STEP_PARTS_RAW,
    "step-parts before small parts are absorbed",
    |carrier, _| {
        Ok(SourceLabels::on_faces(
            carrier.mesh(),
            carrier.raw_part_of_face(),
        ))
    },
)
.labeling_faces()
.needing(ShapeKind::Brep);

/// The same with the types after recognition, so that a primitive that is written as a B-spline counts as this primitive.
pub(crate) const CANONICAL: SourceFactory = SourceFactory::rule(
    "canonical",
    "step-parts with primitives recognized that the file writes as splines or sweeps",
    |carrier, _| {
        let (mesh, graph) = (carrier.mesh(), carrier.graph());
        let parts = StepParts::of_carrier(carrier).canonical_parts(mesh, graph);
        Ok(SourceLabels::on_partition(mesh, &parts))
    },
)
.labeling_faces()
.needing(ShapeKind::Brep);
