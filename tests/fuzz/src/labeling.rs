//! Labels a text, and returns nothing: a panic, a hang or too much memory is what a fuzz target looks for.

use partprobe_formats::{Compression, carrier_from_npz, carrier_to_npz};
use partprobe_label::LabelOptions;

/// Labels a text through the door that the program uses, and reads each carrier back.
///
/// # Panics
/// If the kernel breaks a promise: a coordinate that is not finite, or a carrier that does not survive its file.
pub fn label(text: &[u8]) {
    let mut options = LabelOptions::default();
    options.tessellation.attributes = partprobe_brep::AttributeChoice {
        normal: true,
        uv: true,
        curvature: true,
    };
    let Ok(file) = partprobe_label::label(text, "fuzz", &options) else {
        return;
    };

    for carrier in file
        .shapes
        .into_iter()
        .filter_map(|shape| shape.carrier.ok())
    {
        let coordinates = carrier.mesh().vertices.iter().flatten();
        assert!(
            coordinates.copied().all(f64::is_finite),
            "a vertex is not finite"
        );

        let bytes =
            carrier_to_npz(&carrier, Compression::Stored).expect("a carrier has an NPZ form");
        let read_back = carrier_from_npz(&bytes).expect("what was written can be read");
        assert_eq!(read_back.part_of_face(), carrier.part_of_face());
    }
}
