//! Text in, nothing out: a panic, a hang or too much memory is what a fuzz target looks for.

use brep::{AttributeChoice, ReadBudget, ShapeOptions, read, shape};
use carrier::{Carrier, CarrierMeta};
use formats::{Compression, carrier_from_npz, carrier_to_npz};

/// Labels a text as the program does, and reads the carrier back.
///
/// # Panics
/// Where the kernel breaks a promise: indices out of range, a carrier that does not survive its file, NaN coordinates.
pub fn label(text: &[u8]) {
    let Ok(brep) = read(text, &ReadBudget::default()) else { return };
    let attributes = AttributeChoice { normal: true, uv: true, curvature: true };
    let shape = shape(&brep, &ShapeOptions { attributes, ..ShapeOptions::default() });
    assert!(shape.mesh.vertices.iter().flatten().all(|coordinate| coordinate.is_finite()), "a vertex is not finite");
    let meta = CarrierMeta {
        id: "fuzz".to_owned(),
        source_sha256: String::new(),
        theta_deg: 8.0,
        tau_min: 20,
        chord_mm: shape.chord_mm,
        angle_rad: 0.3,
        diagonal_mm: shape.diagonal_mm,
        units: brep.units.clone(),
        lost: shape.lost.iter().map(ToString::to_string).collect(),
        notes: brep.notes.iter().map(ToString::to_string).collect(),
        instances: brep::first_instances(&brep),
    };
    let Ok(carrier) = Carrier::new(shape.mesh, shape.graph, meta) else { panic!("the kernel's own shape is refused") };
    let bytes = carrier_to_npz(&carrier, Compression::Stored).expect("a carrier has an NPZ form");
    let read_back = carrier_from_npz(&bytes).expect("what was written can be read");
    assert_eq!(read_back.face_label(), carrier.face_label());
}
