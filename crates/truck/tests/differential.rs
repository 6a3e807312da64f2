//! Compares both kernels on generated parts: faces, types, adjacency and parts must be the same, and most areas must agree
//! within 1 %.
#![cfg(feature = "truck")]
#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

use partprobe_brep::{ReadBudget, TessellationOptions, read};
use partprobe_shape::FaceGraph;
use partprobe_sources::partition_by_type_and_angle;
use partprobe_synth::{SynthSettings, part};
use partprobe_truck::{KernelAgreement, Reading, TruckError, TruckSettings, TruckShape, shape};

const N_PARTS: u64 = 60;

/// Reads a text with both kernels. truck gets the units from the own kernel, since it cannot read them.
fn both(text: &str) -> (partprobe_brep::Tessellation, TruckShape) {
    let brep = read(text.as_bytes(), &ReadBudget::default()).unwrap();
    let (mm_per_unit, rad_per_unit) = (brep.units.mm_per_unit, brep.units.rad_per_unit);
    // truck has no angular tolerance, so it needs a smaller chord tolerance for the same areas.
    let settings = TruckSettings {
        mm_per_unit,
        rad_per_unit,
        chord_fraction: 1e-4,
    };
    (
        partprobe_brep::tessellate(&brep, &TessellationOptions::default()),
        shape(text, &settings).unwrap(),
    )
}

/// Compares two readings. Their faces are grouped into parts at 8°.
fn agreement(ours: &FaceGraph, theirs: &FaceGraph) -> KernelAgreement {
    let [our_parts, their_parts] =
        [ours, theirs].map(|graph| partition_by_type_and_angle(graph, 8.0));
    let ours = Reading {
        graph: ours,
        parts: our_parts.parts(),
    };
    let theirs = Reading {
        graph: theirs,
        parts: their_parts.parts(),
    };
    KernelAgreement::of(ours, theirs)
}

#[test]
fn generated_parts_are_the_same_by_both_kernels() {
    let settings = SynthSettings {
        seed: 5,
        min_parts: 2,
        max_parts: 20,
    };
    let (mut n_faces, mut n_equal_areas) = (0, 0);
    for index in 0..N_PARTS {
        let part = part(&settings, index);
        let (ours, truck) = both(&part.step);
        let found = agreement(&ours.graph, &truck.graph);
        assert!(
            found.is_exact(),
            "{}: {found:?}, lost {:?}",
            part.name,
            truck.lost
        );
        for (face, theirs) in ours.graph.faces.iter().zip(&truck.graph.faces) {
            let is_named = truck.lost.iter().any(|lost| lost.step_id == face.step_id);
            assert!(
                theirs.area > 0.0 || is_named,
                "{} loses #{} in silence",
                part.name,
                face.step_id
            );
        }
        (n_faces, n_equal_areas) = (
            n_faces + found.n_common_faces,
            n_equal_areas + found.n_equal_areas,
        );
    }
    // truck cannot mesh cones that reach their apex, nor a few fillets at this tolerance.
    assert!(
        100 * n_equal_areas >= 93 * n_faces,
        "{n_equal_areas} of {n_faces} areas agree"
    );
}

#[test]
fn what_truck_drops_is_named() {
    let settings = SynthSettings {
        seed: 5,
        min_parts: 6,
        max_parts: 20,
    };
    let text = part(&settings, 1).step;
    let line = text
        .lines()
        .find(|line| line.contains("CYLINDRICAL_SURFACE"))
        .unwrap();
    let (damaged, entity) = (
        line.replace("CYLINDRICAL_SURFACE", "NO_SURFACE"),
        line.split('=').next().unwrap(),
    );
    let brep = read(text.as_bytes(), &ReadBudget::default()).unwrap();
    let units = TruckSettings {
        mm_per_unit: brep.units.mm_per_unit,
        rad_per_unit: brep.units.rad_per_unit,
        chord_fraction: 1e-3,
    };
    let (whole, less) = (
        shape(&text, &units).unwrap(),
        shape(&text.replace(line, &damaged), &units).unwrap(),
    );
    let uses = text.matches(&format!(",{},", entity.trim())).count();
    assert!(
        uses > 0 && less.graph.faces.len() + uses == whole.graph.faces.len(),
        "{uses}"
    );
    assert_eq!(less.lost.len(), whole.lost.len() + uses);
    assert_eq!(shape("no STEP", &units).err(), Some(TruckError::Unreadable));
    let empty = "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n\
                 FILE_SCHEMA((''));\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n";
    assert_eq!(shape(empty, &units).err(), Some(TruckError::NoFace));
}
